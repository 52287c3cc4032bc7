//! Which columns a topic has, and which values of a message go into them.
//!
//! All messages of a topic are shown to a [`Layout`] first: it learns which arrays have one length in all of them. Then
//! it takes them apart.

use std::borrow::Cow;
use std::sync::Arc;

use thiserror::Error;

use crate::cdr::{DecodeError, Fault, Reader, Value, Values};
use crate::definition::{Length, Message, Number, Text, Type};
use crate::text;

/// Fields and elements of a topic that may have a column of their own.
pub const MAX_COLUMNS: usize = 10_000;

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Nanoseconds since the UNIX epoch.
    Time,
    Number(Number),
    Text,
    Octets,
    Numbers(Number),
    Texts,
    /// A list of messages.
    Json,
}

/// A column of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Column {
    /// As `pose.position.x`, or `bodies.0.name`.
    pub name: String,
    pub kind: Kind,
}

impl Kind {
    pub fn name(self) -> String {
        match self {
            Self::Time => "timestamp".to_owned(),
            Self::Number(number) => number.name().to_owned(),
            Self::Text => "string".to_owned(),
            Self::Octets => "bytes".to_owned(),
            Self::Numbers(number) => format!("list of {}", number.name()),
            Self::Texts => "list of string".to_owned(),
            Self::Json => "JSON".to_owned(),
        }
    }
}

/// What one column holds of one message.
pub(crate) enum Cell<'a> {
    Number(Value),
    Text(Cow<'a, str>),
    Octets(&'a [u8]),
    Numbers(Values<'a>),
    Texts(Vec<Cow<'a, str>>),
    Json(String),
}

/// Why a message has no place in the table.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub(crate) enum LayoutError {
    #[error(transparent)]
    Decode(#[from] DecodeError),
    #[error("more than {MAX_COLUMNS} columns; spread shorter arrays only")]
    TooWide,
}

/// The columns of a topic.
pub(crate) struct Layout {
    message: Arc<Message>,
    fields: Vec<Shape>,
    limits: Limits,
}

/// How a value is spread over columns.
enum Shape {
    Number(Number),
    Text(Text),
    Message(Arc<Message>, Vec<Shape>),
    Array {
        element: Type,
        length: Length,
        spread: Spread,
    },
}

enum Spread {
    /// No message was seen yet.
    Unseen,
    /// All have as many elements; each has its own columns.
    Elements(Vec<Shape>),
    /// One column.
    Whole,
}

struct Limits {
    /// Elements of an array that is spread.
    elements: usize,
    /// Shapes that may still be made.
    shapes: usize,
}

impl Limits {
    fn shape(&mut self, kind: &Type) -> Result<Shape, LayoutError> {
        self.shapes = self.shapes.checked_sub(1).ok_or(LayoutError::TooWide)?;
        Ok(match kind {
            Type::Number(number) => Shape::Number(*number),
            Type::Text(text) => Shape::Text(*text),
            Type::Message(message) => Shape::Message(Arc::clone(message), self.fields(message)?),
            Type::Array { element, length } => Shape::Array {
                element: (**element).clone(),
                length: *length,
                spread: match (&**element, *length) {
                    (Type::Number(Number::Uint8), _) => Spread::Whole,
                    (element, Length::Fixed(count)) => self.spread(element, count)?,
                    _ => Spread::Unseen,
                },
            },
        })
    }

    fn fields(&mut self, message: &Message) -> Result<Vec<Shape>, LayoutError> {
        let fields = message.fields.iter();
        fields.map(|field| self.shape(&field.kind)).collect()
    }

    fn spread(&mut self, element: &Type, count: usize) -> Result<Spread, LayoutError> {
        if count == 0 || count > self.elements {
            return Ok(Spread::Whole);
        }
        let elements = (0..count).map(|_| self.shape(element));
        Ok(Spread::Elements(elements.collect::<Result<_, _>>()?))
    }
}

impl Layout {
    /// Arrays of more than `elements` elements become one column.
    pub fn new(message: Arc<Message>, elements: usize) -> Result<Self, LayoutError> {
        let mut limits = Limits {
            elements,
            shapes: MAX_COLUMNS,
        };
        Ok(Self {
            fields: limits.fields(&message)?,
            message,
            limits,
        })
    }

    /// Learns from a message.
    pub fn observe(&mut self, payload: &[u8]) -> Result<(), LayoutError> {
        let mut reader = Reader::new(payload).map_err(DecodeError::from)?;
        self.limits
            .observe_fields(&self.message, &mut self.fields, &mut reader)?;
        reader.finish().map_err(DecodeError::from)?;
        Ok(())
    }

    /// All columns.
    pub fn columns(&self) -> Vec<Column> {
        let mut columns = Vec::new();
        append_fields("", &self.message, &self.fields, &mut columns);
        columns
    }

    /// Takes a message apart: a cell for each column, in their order.
    pub fn cells<'a>(&self, payload: &'a [u8]) -> Result<Vec<Cell<'a>>, DecodeError> {
        let mut reader = Reader::new(payload)?;
        let mut cells = Vec::new();
        cells_of_fields(&self.message, &self.fields, &mut reader, &mut cells)?;
        reader.finish()?;
        Ok(cells)
    }
}

impl Limits {
    fn observe_fields(
        &mut self,
        message: &Message,
        shapes: &mut [Shape],
        reader: &mut Reader<'_>,
    ) -> Result<(), LayoutError> {
        reader.open(message).map_err(DecodeError::from)?;
        for (field, shape) in message.fields.iter().zip(shapes) {
            self.observe(shape, reader)
                .map_err(|error| within(error, &field.name))?;
        }
        Ok(())
    }

    fn observe(&mut self, shape: &mut Shape, reader: &mut Reader<'_>) -> Result<(), LayoutError> {
        match shape {
            Shape::Number(number) => reader
                .number(*number)
                .map(drop)
                .map_err(DecodeError::from)?,
            Shape::Text(text) => reader.text(*text).map(drop).map_err(DecodeError::from)?,
            Shape::Message(message, shapes) => self.observe_fields(message, shapes, reader)?,
            Shape::Array {
                element,
                length,
                spread,
            } => {
                let count = reader.count(*length, element).map_err(DecodeError::from)?;
                if matches!(spread, Spread::Unseen) {
                    *spread = self.spread(element, count)?;
                }
                match spread {
                    Spread::Elements(shapes) if shapes.len() == count => {
                        for (index, shape) in shapes.iter_mut().enumerate() {
                            self.observe(shape, reader)
                                .map_err(|error| within(error, index))?;
                        }
                    }
                    _ => {
                        *spread = Spread::Whole;
                        reader.skip_elements(element, count)?;
                    }
                }
            }
        }
        Ok(())
    }
}

fn within(error: LayoutError, segment: impl std::fmt::Display) -> LayoutError {
    match error {
        LayoutError::Decode(error) => LayoutError::Decode(error.within(segment)),
        error => error,
    }
}

fn append_fields(prefix: &str, message: &Message, shapes: &[Shape], columns: &mut Vec<Column>) {
    for (field, shape) in message.fields.iter().zip(shapes) {
        append(format!("{prefix}{}", field.name), shape, columns);
    }
}

fn append(name: String, shape: &Shape, columns: &mut Vec<Column>) {
    let kind = match shape {
        Shape::Number(number) => Kind::Number(*number),
        Shape::Text(_) => Kind::Text,
        Shape::Message(message, shapes) => {
            return append_fields(&format!("{name}."), message, shapes, columns);
        }
        Shape::Array {
            spread: Spread::Elements(shapes),
            ..
        } => {
            for (index, shape) in shapes.iter().enumerate() {
                append(format!("{name}.{index}"), shape, columns);
            }
            return;
        }
        Shape::Array { element, .. } => match element {
            Type::Number(Number::Uint8) => Kind::Octets,
            Type::Number(number) => Kind::Numbers(*number),
            Type::Text(_) => Kind::Texts,
            Type::Message(_) | Type::Array { .. } => Kind::Json,
        },
    };
    columns.push(Column { name, kind });
}

fn cells_of_fields<'a>(
    message: &Message,
    shapes: &[Shape],
    reader: &mut Reader<'a>,
    cells: &mut Vec<Cell<'a>>,
) -> Result<(), DecodeError> {
    reader.open(message)?;
    for (field, shape) in message.fields.iter().zip(shapes) {
        cells_of(shape, reader, cells).map_err(|error| error.within(&field.name))?;
    }
    Ok(())
}

fn cells_of<'a>(
    shape: &Shape,
    reader: &mut Reader<'a>,
    cells: &mut Vec<Cell<'a>>,
) -> Result<(), DecodeError> {
    let cell = match shape {
        Shape::Number(number) => Cell::Number(reader.number(*number)?),
        Shape::Text(text) => Cell::Text(reader.text(*text)?),
        Shape::Message(message, shapes) => return cells_of_fields(message, shapes, reader, cells),
        Shape::Array {
            element,
            length,
            spread,
        } => {
            if let Spread::Elements(shapes) = spread {
                let count = reader.count(*length, element)?;
                if count != shapes.len() {
                    return Err(Fault::Length {
                        found: count,
                        expected: shapes.len(),
                    }
                    .into());
                }
                for (index, shape) in shapes.iter().enumerate() {
                    cells_of(shape, reader, cells).map_err(|error| error.within(index))?;
                }
                return Ok(());
            }
            whole(element, *length, reader)?
        }
    };
    cells.push(cell);
    Ok(())
}

/// An array that has one column.
fn whole<'a>(
    element: &Type,
    length: Length,
    reader: &mut Reader<'a>,
) -> Result<Cell<'a>, DecodeError> {
    match element {
        Type::Number(number) => {
            let count = reader.count(length, element)?;
            let values = reader.numbers(*number, count)?;
            Ok(values.octets().map_or(Cell::Numbers(values), Cell::Octets))
        }
        Type::Text(text) => {
            let count = reader.count(length, element)?;
            let texts = (0..count).map(|_| reader.text(*text));
            Ok(Cell::Texts(texts.collect::<Result<_, _>>()?))
        }
        Type::Message(_) | Type::Array { .. } => {
            let mut text = String::new();
            text::json_array(&mut text, reader, element, length)?;
            Ok(Cell::Json(text))
        }
    }
}
