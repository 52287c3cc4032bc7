//! The columns of a topic, and the distribution of a message's values over them.
//!
//! All messages of a topic are first shown to a [`Layout`], which determines the arrays whose length is the same in all
//! of them. Afterwards it splits messages into cells. The order of the messages does not affect the layout.

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

/// Maximum number of columns for the fields of a topic.
pub const MAX_COLUMNS: usize = 10_000;

/// Maximum number of shapes of a topic: fields, elements, and the messages and arrays that contain them.
const MAX_SHAPES: usize = 1 << 17;

/// Kind of the values of a column.
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
    /// Name of the column, such as `pose.position.x` or `bodies.0.name`.
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

/// The value of one message in one column.
pub(crate) enum Cell<'a> {
    Number(Value),
    Text(Cow<'a, str>),
    Octets(&'a [u8]),
    Numbers(Values<'a>),
    Texts(Vec<Cow<'a, str>>),
    Json(String),
}

/// The reason that a message does not fit into a table.
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
    /// Maximum number of elements of an array with one column per element.
    elements: usize,
    /// Number of nested arrays from which on an inner array has a single column.
    depth: usize,
}

impl Layout {
    /// Creates the layout of a message type. Arrays of more than `elements` elements get a single column.
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

    /// Updates the layout with the array lengths of a message.
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

    /// Completes the layout. If it has too many columns, arrays are reduced to a single column each, starting with the
    /// most deeply nested ones.
    pub fn finish(&mut self) -> Result<(), LayoutError> {
        let mut depth = depth(&self.fields);
        while count(&self.fields) > MAX_COLUMNS {
            depth = depth.checked_sub(1).ok_or(LayoutError::TooWide)?;
            collapse(&mut self.fields, depth);
        }
        Ok(())
    }

    /// Returns all columns.
    pub fn columns(&self) -> Vec<Column> {
        let mut columns = Vec::new();
        columns::append_fields("", &self.message, &self.fields, &mut columns);
        columns
    }

    /// Splits a message into cells, one per column in order.
    pub fn cells<'a>(&self, payload: &'a [u8]) -> Result<Vec<Cell<'a>>, DecodeError> {
        let mut reader = Reader::new(payload)?;
        let mut cells = Vec::new();
        cells::append_fields(&self.message, &self.fields, &mut reader, &mut cells)?;
        reader.finish()?;
        Ok(cells)
    }
}
