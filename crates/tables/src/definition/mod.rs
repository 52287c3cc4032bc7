//! Message definitions as stored by rosbag2: the `.msg` text of the message, followed by the texts of all messages that
//! it contains.
//!
//! Source of the language: <https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html>.

mod lines;
mod resolve;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use thiserror::Error;

/// The reason that a definition cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum DefinitionError {
    /// A line does not follow the syntax of `.msg` files.
    #[error("definition, line {line}: expected {expected}, found {found:?}")]
    Syntax {
        /// Number of the line, counted from 1.
        line: usize,
        /// A description of the expected text.
        expected: &'static str,
        /// The text found.
        found: String,
    },
    /// Two fields of a message have the same name.
    #[error("definition, line {line}: a second field {name}")]
    Duplicate {
        /// Number of the line, counted from 1.
        line: usize,
        /// Name of the field.
        name: String,
    },
    /// The text of a required message is missing.
    #[error("the definition has no text of {missing}, which {message} needs")]
    Missing {
        /// The message that requires it.
        message: String,
        /// The missing message.
        missing: String,
    },
    /// A message contains itself.
    #[error("{cycle}: a message cannot contain itself")]
    Recursive {
        /// The messages of the cycle, joined by `→`.
        cycle: String,
    },
    /// Messages are nested more deeply than [`MAX_DEPTH`].
    #[error("{message}: messages are nested more than {MAX_DEPTH} deep")]
    TooDeep {
        /// The message at which the limit is exceeded.
        message: String,
    },
}

/// Maximum nesting depth of messages. Those of ROS 2 have depths less than ten.
pub const MAX_DEPTH: usize = 64;

/// A message type.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Message {
    pub fields: Vec<Field>,
    /// Minimum size of a message of this type in bytes.
    pub least: usize,
}

/// A field of a message.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Field {
    pub name: String,
    pub kind: Type,
}

/// Type of a field.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Type {
    Number(Number),
    Text(Text),
    Message(Arc<Message>),
    Array { element: Box<Type>, length: Length },
}

/// Numeric types. ROS includes Booleans among them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Number {
    Bool,
    Int8,
    /// Also `byte` and `char`.
    Uint8,
    Int16,
    Uint16,
    Int32,
    Uint32,
    Int64,
    Uint64,
    Float32,
    Float64,
}

/// `string`, or `wstring`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Text {
    pub wide: bool,
    /// Maximum number of bytes, or of UTF-16 code units if wide.
    pub bound: Option<usize>,
}

/// Number of elements of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Length {
    Fixed(usize),
    Bounded(usize),
    Unbounded,
}

impl Message {
    /// Parses the definition of the message `type_name` (`pkg/msg/Type`).
    pub fn parse(type_name: &str, definition: &str) -> Result<Arc<Self>, DefinitionError> {
        resolve::resolve(type_name, &lines::messages(type_name, definition)?)
    }
}

impl Type {
    /// Returns the minimum size of a value of this type in bytes.
    pub fn least(&self) -> usize {
        match self {
            Self::Number(number) => number.size(),
            Self::Message(message) => message.least,
            Self::Array {
                element,
                length: Length::Fixed(length),
            } => element.least().saturating_mul(*length),
            // The encoding starts with the length.
            Self::Text(_) | Self::Array { .. } => Number::Uint32.size(),
        }
    }
}

impl Number {
    /// Returns the size in bytes, which is also the alignment.
    pub fn size(self) -> usize {
        match self {
            Self::Bool | Self::Int8 | Self::Uint8 => 1,
            Self::Int16 | Self::Uint16 => 2,
            Self::Int32 | Self::Uint32 | Self::Float32 => 4,
            Self::Int64 | Self::Uint64 | Self::Float64 => 8,
        }
    }

    /// Returns the name in `.msg` files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bool => "bool",
            Self::Int8 => "int8",
            Self::Uint8 => "uint8",
            Self::Int16 => "int16",
            Self::Uint16 => "uint16",
            Self::Int32 => "int32",
            Self::Uint32 => "uint32",
            Self::Int64 => "int64",
            Self::Uint64 => "uint64",
            Self::Float32 => "float32",
            Self::Float64 => "float64",
        }
    }
}
