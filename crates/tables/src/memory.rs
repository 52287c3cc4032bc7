//! Tables in memory, column by column.

use std::collections::BTreeMap;

use lgvi_bag::BagReader;

use crate::cdr::{Value, Values};
use crate::conversion::{ConvertError, Format, LeftOut, Options};
use crate::convert::{Key, check_topics, key, learn};
use crate::definition::Number;
use crate::layout::{Cell, Kind};
use crate::open::{Learnt, cells, columns};

/// The table of a topic.
#[derive(Clone, Debug, PartialEq)]
pub struct TopicTable {
    /// Name of the topic.
    pub topic: String,
    /// Type of the topic, `pkg/msg/Type`.
    pub type_name: String,
    /// Names and values of the columns, with a value per message.
    pub columns: Vec<(String, Cells)>,
}

/// The values of a column.
#[derive(Clone, Debug, PartialEq)]
pub enum Cells {
    /// Booleans.
    Bool(Vec<bool>),
    /// Signed integers of 8 bits.
    Int8(Vec<i8>),
    /// Unsigned integers of 8 bits.
    Uint8(Vec<u8>),
    /// Signed integers of 16 bits.
    Int16(Vec<i16>),
    /// Unsigned integers of 16 bits.
    Uint16(Vec<u16>),
    /// Signed integers of 32 bits.
    Int32(Vec<i32>),
    /// Unsigned integers of 32 bits.
    Uint32(Vec<u32>),
    /// Signed integers of 64 bits.
    Int64(Vec<i64>),
    /// Unsigned integers of 64 bits.
    Uint64(Vec<u64>),
    /// Numbers in single precision.
    Float32(Vec<f32>),
    /// Numbers in double precision.
    Float64(Vec<f64>),
    /// Texts. Those of messages in an array are JSON.
    Text(Vec<String>),
    /// Bytes.
    Bytes(Vec<Vec<u8>>),
    /// Arrays whose lengths differ.
    List(Vec<Cells>),
}

/// Reads the tables of the topics of these names, or of all topics if there are none, into memory. An array of fixed length
/// has a column per element if it has at most `max_elements`.
///
/// Topics whose definition or messages cannot be decoded have no table and are listed in the result.
///
/// # Errors
/// Returns an error if the bag cannot be read, or does not have a topic of such a name.
pub fn read(
    bag: &BagReader,
    topics: Vec<String>,
    max_elements: usize,
) -> Result<(Vec<TopicTable>, Vec<LeftOut>), ConvertError> {
    let options = Options {
        format: Format::Parquet,
        topics,
        max_elements,
    };
    check_topics(bag, &options.topics)?;
    let (learnt, left_out) = learn(bag, &options)?;
    let mut tables: BTreeMap<Key<'_>, (Learnt<'_>, TopicTable)> = BTreeMap::new();
    for learnt in learnt {
        let columns = columns(&learnt.layout).into_iter();
        let table = TopicTable {
            topic: learnt.topic.name.clone(),
            type_name: learnt.topic.type_name.clone(),
            columns: columns
                .map(|column| (column.name, Cells::new(column.kind)))
                .collect(),
        };
        tables.insert(key(learnt.topic), (learnt, table));
    }
    for message in bag.messages() {
        let message = message?;
        let Some((learnt, table)) = tables.get_mut(&key(message.topic)) else {
            continue;
        };
        let row = cells(learnt, &message)?;
        for ((_, column), cell) in table.columns.iter_mut().zip(row) {
            column.push(cell);
        }
    }
    let tables = tables.into_values().map(|(_, table)| table);
    Ok((tables.collect(), left_out))
}

impl Cells {
    fn new(kind: Kind) -> Self {
        match kind {
            Kind::Time => Self::Int64(Vec::new()),
            Kind::Number(number) => Self::numbers(number),
            Kind::Text | Kind::Json => Self::Text(Vec::new()),
            Kind::Octets => Self::Bytes(Vec::new()),
            Kind::Numbers(_) | Kind::Texts => Self::List(Vec::new()),
        }
    }

    fn numbers(number: Number) -> Self {
        match number {
            Number::Bool => Self::Bool(Vec::new()),
            Number::Int8 => Self::Int8(Vec::new()),
            Number::Uint8 => Self::Uint8(Vec::new()),
            Number::Int16 => Self::Int16(Vec::new()),
            Number::Uint16 => Self::Uint16(Vec::new()),
            Number::Int32 => Self::Int32(Vec::new()),
            Number::Uint32 => Self::Uint32(Vec::new()),
            Number::Int64 => Self::Int64(Vec::new()),
            Number::Uint64 => Self::Uint64(Vec::new()),
            Number::Float32 => Self::Float32(Vec::new()),
            Number::Float64 => Self::Float64(Vec::new()),
        }
    }

    /// The numbers of an array of a message.
    fn of_values(values: Values<'_>) -> Self {
        let mut cells = Self::numbers(values.number());
        values.iter().for_each(|value| cells.push_value(value));
        cells
    }

    fn push(&mut self, cell: Cell<'_>) {
        match (&mut *self, cell) {
            (_, Cell::Number(value)) => self.push_value(value),
            (Self::Text(column), Cell::Text(text)) => column.push(text.into_owned()),
            (Self::Text(column), Cell::Json(text)) => column.push(text),
            (Self::Bytes(column), Cell::Octets(octets)) => column.push(octets.to_vec()),
            (Self::List(column), Cell::Numbers(values)) => column.push(Self::of_values(values)),
            (Self::List(column), Cell::Texts(texts)) => {
                let texts = texts.into_iter().map(|text| text.into_owned());
                column.push(Self::Text(texts.collect()));
            }
            // The column is created for the kind of its cells.
            _ => debug_assert!(false, "a cell in a column of another kind"),
        }
    }

    fn push_value(&mut self, value: Value) {
        match (&mut *self, value) {
            (Self::Bool(column), Value::Bool(value)) => column.push(value),
            (Self::Int8(column), Value::Int8(value)) => column.push(value),
            (Self::Uint8(column), Value::Uint8(value)) => column.push(value),
            (Self::Int16(column), Value::Int16(value)) => column.push(value),
            (Self::Uint16(column), Value::Uint16(value)) => column.push(value),
            (Self::Int32(column), Value::Int32(value)) => column.push(value),
            (Self::Uint32(column), Value::Uint32(value)) => column.push(value),
            (Self::Int64(column), Value::Int64(value)) => column.push(value),
            // Times, which `learn` has found to fit.
            (Self::Int64(column), Value::Uint64(value)) => column.push(value.cast_signed()),
            (Self::Uint64(column), Value::Uint64(value)) => column.push(value),
            (Self::Float32(column), Value::Float32(value)) => column.push(value),
            (Self::Float64(column), Value::Float64(value)) => column.push(value),
            (_, value) => debug_assert!(false, "{value:?} in a column of another type"),
        }
    }
}
