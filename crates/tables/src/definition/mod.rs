//! Message definitions as rosbag2 stores them: the message's `.msg` text followed by those of all messages it needs.
//!
//! Source of the language: <https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html>.

mod lines;
mod resolve;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use thiserror::Error;

/// Why a definition cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum DefinitionError {
    /// A line is not of the language of `.msg` files.
    #[error("definition, line {line}: expected {expected}, found {found:?}")]
    Syntax {
        /// Number of the line, counted from 1.
        line: usize,
        /// What should be there.
        expected: &'static str,
        /// What is there.
        found: String,
    },
    /// Two fields of a message have one name.
    #[error("definition, line {line}: a second field {name}")]
    Duplicate {
        /// Number of the line, counted from 1.
        line: usize,
        /// The field.
        name: String,
    },
    /// A message is needed whose text is not there.
    #[error("the definition has no text of {missing}, which {message} needs")]
    Missing {
        /// The message that needs it.
        message: String,
        /// The message that is not there.
        missing: String,
    },
    /// A message contains itself.
    #[error("{cycle}: a message cannot contain itself")]
    Recursive {
        /// The messages on the way, joined by `→`.
        cycle: String,
    },
    /// Messages are nested beyond [`MAX_DEPTH`].
    #[error("{message}: messages are nested more than {MAX_DEPTH} deep")]
    TooDeep {
        /// The message that is too deep.
        message: String,
    },
}

/// Messages may be nested this deep; those of ROS 2 are less than ten.
pub const MAX_DEPTH: usize = 64;

/// A message type.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Message {
    pub fields: Vec<Field>,
    /// No message of the type has fewer bytes.
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

/// Numbers, among which ROS counts truth values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Number {
    Bool,
    Int8,
    /// `byte` and `char` too.
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
    /// At most this many bytes, or units of UTF-16.
    pub bound: Option<usize>,
}

/// Number of an array's elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Length {
    Fixed(usize),
    Bounded(usize),
    Unbounded,
}

impl Message {
    /// The message `type_name` (`pkg/msg/Type`) of a definition.
    pub fn parse(type_name: &str, definition: &str) -> Result<Arc<Self>, DefinitionError> {
        resolve::resolve(type_name, &lines::messages(type_name, definition)?)
    }
}

impl Type {
    /// No value of the type has fewer bytes.
    pub fn least(&self) -> usize {
        match self {
            Self::Number(number) => number.size(),
            Self::Message(message) => message.least,
            Self::Array {
                element,
                length: Length::Fixed(length),
            } => element.least().saturating_mul(*length),
            // Their length is told first.
            Self::Text(_) | Self::Array { .. } => Number::Uint32.size(),
        }
    }
}

impl Number {
    /// Bytes, to multiples of which it is aligned.
    pub fn size(self) -> usize {
        match self {
            Self::Bool | Self::Int8 | Self::Uint8 => 1,
            Self::Int16 | Self::Uint16 => 2,
            Self::Int32 | Self::Uint32 | Self::Float32 => 4,
            Self::Int64 | Self::Uint64 | Self::Float64 => 8,
        }
    }

    /// Its name in `.msg` files.
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
