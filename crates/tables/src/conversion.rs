//! What is asked for, what is made, and what can go wrong.

use std::io;
use std::path::PathBuf;

use lgvi_bag::BagError;
use serde::Serialize;
use thiserror::Error;

use crate::cdr::DecodeError;
use crate::table::TableError;

/// Format of tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Comma-separated values.
    Csv,
    /// Apache Parquet.
    Parquet,
}

impl Format {
    /// Name of the format, and of its files' extension.
    pub fn name(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Parquet => "parquet",
        }
    }
}

/// What is converted, and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// Format of the tables.
    pub format: Format,
    /// Names of topics; all if there are none.
    pub topics: Vec<String>,
    /// Arrays of up to this many elements have a column for each, if their length is the same in all messages.
    pub max_elements: usize,
}

/// What was converted, and what was not.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Conversion {
    /// The tables.
    pub files: Vec<TableFile>,
    /// Topics that have no table.
    pub left_out: Vec<LeftOut>,
}

/// A table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct TableFile {
    /// Name of the topic.
    pub topic: String,
    /// Type of the topic, `pkg/msg/Type`.
    #[serde(rename = "type")]
    pub type_name: String,
    /// The file.
    pub file: PathBuf,
    /// Messages of the topic.
    pub rows: u64,
    /// Columns, in their order.
    pub columns: Vec<TableColumn>,
}

/// A column of a table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct TableColumn {
    /// As `pose.position.x`, or `bodies.0.name`.
    pub name: String,
    /// Its type in `.msg` files, `list of` one, `bytes`, `timestamp`, or `JSON`.
    #[serde(rename = "type")]
    pub type_name: String,
}

/// A topic without table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// Name of the topic.
    pub topic: String,
    /// Type of the topic, `pkg/msg/Type`.
    #[serde(rename = "type")]
    pub type_name: String,
    /// Why it has no table.
    pub reason: String,
}

/// Why a bag cannot be converted.
#[derive(Debug, Error)]
pub enum ConvertError {
    /// The bag cannot be read.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// A topic was asked for that the bag does not have.
    #[error("no topic {topic}; there are {known}")]
    UnknownTopic {
        /// The topic asked for.
        topic: String,
        /// Names of all topics.
        known: String,
    },
    /// Nothing is ever overwritten.
    #[error("{path}: exists and is not an empty directory", path = .path.display())]
    Exists {
        /// Where the tables were to be made.
        path: PathBuf,
    },
    /// Where the tables were to be made, there is no name at the end, as in `a/..`.
    #[error("{path}: ends without the name of a directory to make", path = .path.display())]
    NoName {
        /// Where the tables were to be made.
        path: PathBuf,
    },
    /// A file operation failed.
    #[error("{path}: {source}", path = .path.display())]
    Io {
        /// File or directory.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A table could not be written.
    #[error("{path}: {source}", path = .path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: TableError,
    },
    /// A message is another than it was a moment ago.
    #[error("{topic}: the bag changes while it is read: {source}")]
    Changed {
        /// The topic.
        topic: String,
        /// What is wrong with the message.
        source: DecodeError,
    },
}
