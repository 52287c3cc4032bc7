//! Which columns a topic has, and which values of a message go into them.
//!
//! All messages of a topic are shown to a [`Layout`] first: it learns which arrays have one length in all of them. Then
//! it takes them apart. In what order they are shown makes no difference.

mod cells;
mod columns;
mod observe;
mod shape;

use std::borrow::Cow;
use std::sync::Arc;

use thiserror::Error;

use self::observe::Sizes;
use self::shape::{Maker, Shape, collapse, count, depth};
use crate::cdr::{DecodeError, Reader, Value, Values};
use crate::definition::{MAX_DEPTH, Message, Number};

/// Columns that a topic's fields may have.
pub const MAX_COLUMNS: usize = 10_000;

/// Fields and elements of a topic, and what has them, that are kept in mind.
const MAX_SHAPES: usize = 1 << 17;

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
    #[error("more than {MAX_COLUMNS} columns, even with one for each array")]
    TooWide,
}

/// The columns of a topic.
pub(crate) struct Layout {
    message: Arc<Message>,
    fields: Vec<Shape>,
    /// Arrays of more elements have one column.
    elements: usize,
    /// Arrays within so many others have one column.
    depth: usize,
}

impl Layout {
    /// Arrays of more than `elements` elements become one column.
    pub fn new(message: Arc<Message>, elements: usize) -> Result<Self, LayoutError> {
        let make = |depth| {
            let mut maker = Maker::new(elements, depth);
            let fields = maker.fields(&message, 0)?;
            Ok::<_, LayoutError>((fields, maker.left()))
        };
        let (mut fields, mut left) = make(0)?;
        let mut limit = MAX_DEPTH;
        for depth in 1..=MAX_DEPTH {
            let Ok(deeper) = make(depth) else {
                limit = depth - 1;
                break;
            };
            let is_deepest = deeper.1 == left;
            (fields, left) = deeper;
            if is_deepest {
                break;
            }
        }
        Ok(Self {
            message,
            fields,
            elements,
            depth: limit,
        })
    }

    /// Learns from a message.
    pub fn observe(&mut self, payload: &[u8]) -> Result<(), LayoutError> {
        let sizes = Sizes::of(&self.message, payload, self.elements, self.depth)?;
        let depth = sizes.depth_within(MAX_SHAPES);
        if depth < self.depth {
            collapse(&mut self.fields, depth);
            self.depth = depth;
        }
        let mut reader = Reader::new(payload).map_err(DecodeError::from)?;
        let mut maker = Maker::new(self.elements, self.depth);
        maker.observe_fields(&self.message, &mut self.fields, 0, &mut reader)
    }

    /// Ends learning. Where there are too many columns, arrays become one column each: first those within the most others.
    pub fn finish(&mut self) -> Result<(), LayoutError> {
        let mut depth = depth(&self.fields);
        while count(&self.fields) > MAX_COLUMNS {
            depth = depth.checked_sub(1).ok_or(LayoutError::TooWide)?;
            collapse(&mut self.fields, depth);
        }
        Ok(())
    }

    /// All columns.
    pub fn columns(&self) -> Vec<Column> {
        let mut columns = Vec::new();
        columns::append_fields("", &self.message, &self.fields, &mut columns);
        columns
    }

    /// Takes a message apart: a cell for each column, in their order.
    pub fn cells<'a>(&self, payload: &'a [u8]) -> Result<Vec<Cell<'a>>, DecodeError> {
        let mut reader = Reader::new(payload)?;
        let mut cells = Vec::new();
        cells::append_fields(&self.message, &self.fields, &mut reader, &mut cells)?;
        reader.finish()?;
        Ok(cells)
    }
}
