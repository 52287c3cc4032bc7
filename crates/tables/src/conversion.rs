//! Options, result and errors of a conversion.

use std::io;
use std::path::PathBuf;

use lgvi_bag::BagError;
use serde::Serialize;
use thiserror::Error;

use crate::cdr::DecodeError;
use crate::table::TableError;

/// File format of the tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Comma-separated values.
    Csv,
    /// Apache Parquet.
    Parquet,
}

impl Format {
    /// Returns the name of the format, which is also the file extension.
    pub fn name(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Parquet => "parquet",
        }
    }
}

/// Options of a conversion.
#[derive(Clone, Debug)]
pub struct Options {
    /// Format of the tables.
    pub format: Format,
    /// Names of the topics to convert, or empty for all.
    pub topics: Vec<String>,
    /// Maximum number of elements for an array to get one column per element, if its length is the same in all
    /// messages.
    pub max_elements: usize,
}

/// Result of a conversion.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Conversion {
    /// The tables.
    pub files: Vec<TableFile>,
    /// Topics that have no table.
    pub left_out: Vec<LeftOut>,
}

/// A table that was written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct TableFile {
    /// Name of the topic.
    pub topic: String,
    /// Type of the topic, `pkg/msg/Type`.
    #[serde(rename = "type")]
    pub type_name: String,
    /// Path of the file.
    pub file: PathBuf,
    /// Number of messages of the topic.
    pub rows: u64,
    /// Columns in order.
    pub columns: Vec<TableColumn>,
}

/// A column of a table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct TableColumn {
    /// Name of the column, such as `pose.position.x` or `bodies.0.name`.
    pub name: String,
    /// Type as in `.msg` files, `list of` such a type, `bytes`, `timestamp`, or `JSON`.
    #[serde(rename = "type")]
    pub type_name: String,
}

/// A topic without a table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// Name of the topic.
    pub topic: String,
    /// Type of the topic, `pkg/msg/Type`.
    #[serde(rename = "type")]
    pub type_name: String,
    /// The reason that the topic has no table.
    pub reason: String,
}

/// The reason that a bag cannot be converted.
#[derive(Debug, Error)]
pub enum ConvertError {
    /// The bag cannot be read.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// A requested topic does not exist in the bag.
    #[error("no topic {topic}; there are {known}")]
    UnknownTopic {
        /// The requested topic.
        topic: String,
        /// Names of all topics.
        known: String,
    },
    /// The output directory exists and is not empty. Files are never overwritten.
    #[error("{path}: exists and is not an empty directory", path = .path.display())]
    Exists {
        /// The output directory.
        path: PathBuf,
    },
    /// The output path does not end with a name, as in `a/..`.
    #[error("{path}: ends without the name of a directory to make", path = .path.display())]
    NoName {
        /// The output path.
        path: PathBuf,
    },
    /// A file operation failed.
    #[error("{path}: {source}", path = .path.display())]
    Io {
        /// The file or directory.
        path: PathBuf,
        /// The error reported by the system.
        source: io::Error,
    },
    /// A table could not be written.
    #[error("{path}: {source}", path = .path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// The underlying error.
        source: TableError,
    },
    /// The content of a message has changed since it was first read.
    #[error("{topic}: the bag changes while it is read: {source}")]
    Changed {
        /// The topic.
        topic: String,
        /// The error in the message.
        source: DecodeError,
    },
}
