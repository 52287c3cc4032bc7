//! Parquet tables, compressed with zstd. Rows are kept in memory until they form a row group.

use std::fs::File;
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, TimeUnit, Type as Physical, ZstdLevel};
use parquet::data_type::{
    BoolType, ByteArray, ByteArrayType, DoubleType, FloatType, Int32Type, Int64Type,
};
use parquet::errors::Result;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::Type;

use crate::cdr::Value;
use crate::definition::Number;
use crate::layout::{Cell, Column, Kind};
use crate::table::{Table, TableError};

pub(crate) struct ParquetTable {
    writer: SerializedFileWriter<File>,
    columns: Vec<Buffer>,
    buffered: usize,
}

impl ParquetTable {
    /// Creates the table. Readers find the entries of `metadata` by key.
    pub fn create(
        file: File,
        columns: &[Column],
        metadata: &[(&str, String)],
    ) -> std::result::Result<Self, TableError> {
        let entries = metadata.iter();
        let entries =
            entries.map(|(key, value)| KeyValue::new((*key).to_owned(), Some(value.clone())));
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_key_value_metadata(Some(entries.collect()))
            .build();
        let writer = SerializedFileWriter::new(file, schema(columns)?, Arc::new(properties))?;
        Ok(Self {
            writer,
            columns: columns
                .iter()
                .map(|column| Buffer::new(column.kind))
                .collect(),
            buffered: 0,
        })
    }
}

impl Table for ParquetTable {
    fn row(&mut self, cells: Vec<Cell<'_>>) -> std::result::Result<(), TableError> {
        for (buffer, cell) in self.columns.iter_mut().zip(cells) {
            self.buffered += buffer.push(cell);
        }
        Ok(())
    }

    fn buffered(&self) -> usize {
        self.buffered
    }

    fn flush(&mut self) -> std::result::Result<(), TableError> {
        if self.buffered == 0 {
            return Ok(());
        }
        let mut group = self.writer.next_row_group()?;
        for buffer in &mut self.columns {
            if let Some(mut column) = group.next_column()? {
                buffer.write(&mut column)?;
                column.close()?;
            }
        }
        group.close()?;
        self.buffered = 0;
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> std::result::Result<(), TableError> {
        self.flush()?;
        self.writer.close()?;
        Ok(())
    }
}

fn schema(columns: &[Column]) -> Result<Arc<Type>> {
    let fields = columns.iter().map(|column| {
        let name = &*column.name;
        let field = match column.kind {
            Kind::Time => leaf(
                name,
                Physical::INT64,
                Some(LogicalType::timestamp(true, TimeUnit::NANOS)),
            ),
            Kind::Number(number) => number_leaf(name, number),
            Kind::Text | Kind::Json => text_leaf(name),
            Kind::Octets => leaf(name, Physical::BYTE_ARRAY, None),
            Kind::Numbers(number) => list(name, number_leaf("element", number)?),
            Kind::Texts => list(name, text_leaf("element")?),
        };
        Ok(Arc::new(field?))
    });
    let schema = Type::group_type_builder("schema").with_fields(fields.collect::<Result<_>>()?);
    Ok(Arc::new(schema.build()?))
}

fn leaf(name: &str, physical: Physical, logical: Option<LogicalType>) -> Result<Type> {
    Type::primitive_type_builder(name, physical)
        .with_repetition(Repetition::REQUIRED)
        .with_logical_type(logical)
        .build()
}

fn text_leaf(name: &str) -> Result<Type> {
    leaf(name, Physical::BYTE_ARRAY, Some(LogicalType::String))
}

fn number_leaf(name: &str, number: Number) -> Result<Type> {
    let bits = i8::try_from(8 * number.size()).unwrap_or(i8::MAX);
    let integer = |signed| Some(LogicalType::integer(bits, signed));
    let (physical, logical) = match number {
        Number::Bool => (Physical::BOOLEAN, None),
        Number::Int8 | Number::Int16 | Number::Int32 => (Physical::INT32, integer(true)),
        Number::Uint8 | Number::Uint16 | Number::Uint32 => (Physical::INT32, integer(false)),
        Number::Int64 => (Physical::INT64, integer(true)),
        Number::Uint64 => (Physical::INT64, integer(false)),
        Number::Float32 => (Physical::FLOAT, None),
        Number::Float64 => (Physical::DOUBLE, None),
    };
    leaf(name, physical, logical)
}

/// Returns a list type in the three-level structure that the Parquet format specifies.
fn list(name: &str, element: Type) -> Result<Type> {
    let elements = Type::group_type_builder("list")
        .with_repetition(Repetition::REPEATED)
        .with_fields(vec![Arc::new(element)])
        .build()?;
    Type::group_type_builder(name)
        .with_repetition(Repetition::REQUIRED)
        .with_logical_type(Some(LogicalType::List))
        .with_fields(vec![Arc::new(elements)])
        .build()
}

/// The values of a column until they are written.
struct Buffer {
    values: Values,
    /// Definition and repetition levels of a list: if an element is present, and if it continues the row.
    levels: Option<(Vec<i16>, Vec<i16>)>,
}

enum Values {
    Bool(Vec<bool>),
    Int32(Vec<i32>),
    Int64(Vec<i64>),
    Float(Vec<f32>),
    Double(Vec<f64>),
    Bytes(Vec<ByteArray>),
}

impl Buffer {
    fn new(kind: Kind) -> Self {
        let values = match kind {
            Kind::Time => Values::Int64(Vec::new()),
            Kind::Number(number) | Kind::Numbers(number) => match number {
                Number::Bool => Values::Bool(Vec::new()),
                Number::Int64 | Number::Uint64 => Values::Int64(Vec::new()),
                Number::Float32 => Values::Float(Vec::new()),
                Number::Float64 => Values::Double(Vec::new()),
                _ => Values::Int32(Vec::new()),
            },
            Kind::Text | Kind::Octets | Kind::Texts | Kind::Json => Values::Bytes(Vec::new()),
        };
        let list = matches!(kind, Kind::Numbers(_) | Kind::Texts);
        Self {
            values,
            levels: list.then(Default::default),
        }
    }

    /// Adds a cell and returns the number of bytes that it takes.
    fn push(&mut self, cell: Cell<'_>) -> usize {
        match cell {
            Cell::Number(value) => self.values.push(value),
            Cell::Text(text) => self.values.push_bytes(text.as_bytes()),
            Cell::Octets(octets) => self.values.push_bytes(octets),
            Cell::Json(text) => self.values.push_bytes(text.as_bytes()),
            Cell::Numbers(values) => {
                let bytes: usize = values.iter().map(|value| self.values.push(value)).sum();
                bytes + self.levels(values.iter().count())
            }
            Cell::Texts(texts) => {
                let texts = texts.iter();
                let count = texts.len();
                let bytes: usize = texts
                    .map(|text| self.values.push_bytes(text.as_bytes()))
                    .sum();
                bytes + self.levels(count)
            }
        }
    }

    /// Adds the levels of a list of `count` elements and returns the number of bytes that they take.
    fn levels(&mut self, count: usize) -> usize {
        let Some((definition, repetition)) = &mut self.levels else {
            return 0;
        };
        repetition.push(0);
        if count == 0 {
            definition.push(0);
        } else {
            definition.extend(std::iter::repeat_n(1, count));
            repetition.extend(std::iter::repeat_n(1, count - 1));
        }
        2 * size_of::<i16>() * count.max(1)
    }

    fn write(&mut self, column: &mut SerializedColumnWriter<'_>) -> Result<()> {
        let levels = self.levels.as_ref();
        let definition = levels.map(|(definition, _)| &**definition);
        let repetition = levels.map(|(_, repetition)| &**repetition);
        macro_rules! write {
            ($values:ident as $type:ty) => {{
                let typed = column.typed::<$type>();
                typed.write_batch($values, definition, repetition)?;
                $values.clear();
            }};
        }
        match &mut self.values {
            Values::Bool(values) => write!(values as BoolType),
            Values::Int32(values) => write!(values as Int32Type),
            Values::Int64(values) => write!(values as Int64Type),
            Values::Float(values) => write!(values as FloatType),
            Values::Double(values) => write!(values as DoubleType),
            Values::Bytes(values) => write!(values as ByteArrayType),
        }
        if let Some((definition, repetition)) = &mut self.levels {
            definition.clear();
            repetition.clear();
        }
        Ok(())
    }
}

impl Values {
    /// Adds a number and returns the number of bytes that it takes. Unsigned integers are stored as signed ones with
    /// the same bits, as the format specifies.
    fn push(&mut self, value: Value) -> usize {
        match (&mut *self, value) {
            (Self::Bool(values), Value::Bool(value)) => values.push(value),
            (Self::Int32(values), Value::Int8(value)) => values.push(value.into()),
            (Self::Int32(values), Value::Uint8(value)) => values.push(value.into()),
            (Self::Int32(values), Value::Int16(value)) => values.push(value.into()),
            (Self::Int32(values), Value::Uint16(value)) => values.push(value.into()),
            (Self::Int32(values), Value::Int32(value)) => values.push(value),
            (Self::Int32(values), Value::Uint32(value)) => values.push(value.cast_signed()),
            (Self::Int64(values), Value::Int64(value)) => values.push(value),
            (Self::Int64(values), Value::Uint64(value)) => values.push(value.cast_signed()),
            (Self::Float(values), Value::Float32(value)) => values.push(value),
            (Self::Double(values), Value::Float64(value)) => values.push(value),
            // The buffer is created for the type of its column.
            _ => debug_assert!(false, "{value:?} in a column of another type"),
        }
        size_of::<u64>()
    }

    fn push_bytes(&mut self, bytes: &[u8]) -> usize {
        if let Self::Bytes(values) = self {
            values.push(bytes.into());
        }
        size_of::<ByteArray>() + bytes.len()
    }
}
