use std::{fmt::Debug, io};

use mcap::McapError;
use thiserror::Error;

/// What is wrong with bytes of an MCAP file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Damage {
    /// A checksum does not match.
    #[error("checksum of the {of} is {calculated:08x}, expected {saved:08x}")]
    Checksum {
        /// The part of the file.
        of: &'static str,
        /// The checksum in the file.
        saved: u32,
        /// The checksum of the bytes.
        calculated: u32,
    },
    /// A record is longer than any that is read.
    #[error("record {opcode:#04x} is of {length} bytes, expected at most {limit}")]
    TooLong {
        /// Its operation code.
        opcode: u8,
        /// Its length.
        length: u64,
        /// The longest that is read.
        limit: usize,
    },
    /// A record or a chunk ends within a field.
    #[error("record {opcode:#04x}: a field needs {needed} bytes, {left} are left")]
    Short {
        /// The record's operation code.
        opcode: u8,
        /// Bytes that the field needs.
        needed: usize,
        /// Bytes left in the record.
        left: usize,
    },
    /// A chunk is compressed in a way that this crate does not know.
    #[error(
        "chunk compression is {found:?}, expected none, \"lz4\" or \"zstd\"; convert the file: mcap compress"
    )]
    Compression {
        /// The compression found.
        found: String,
    },
    /// Compressed data is damaged.
    #[error("cannot be decompressed: {source}")]
    Unpack {
        /// The decompressor's error.
        source: io::Error,
    },
    /// A record cannot be read.
    #[error("cannot be read: {source}")]
    Mcap {
        /// The reader's error.
        source: Box<McapError>,
    },
    /// Two definitions of one id differ.
    #[error("{record} {id} has two different definitions")]
    Redefined {
        /// Kind of the definition.
        record: &'static str,
        /// The id.
        id: u16,
    },
    /// The definition of an id is not in the file before it is needed.
    #[error("{record} {id} is not in the file")]
    Undefined {
        /// Kind of the definition.
        record: &'static str,
        /// The id.
        id: u16,
    },
    /// A record says of others what is not so.
    #[error("{record} record: {field}: {told}, found {found}")]
    Disagrees {
        /// Kind of the record.
        record: &'static str,
        /// The subject of what it says.
        field: &'static str,
        /// The value in the record.
        told: String,
        /// The value found.
        found: String,
    },
}

impl Damage {
    pub(crate) fn short(opcode: u8, needed: usize, left: &[u8]) -> Self {
        let left = left.len();
        Self::Short {
            opcode,
            needed,
            left,
        }
    }
}

impl From<McapError> for Damage {
    fn from(source: McapError) -> Self {
        let checksum = |of, saved, calculated| Self::Checksum {
            of,
            saved,
            calculated,
        };
        match source {
            McapError::BadDataCrc { saved, calculated } => {
                checksum("data section", saved, calculated)
            }
            McapError::BadSummaryCrc { saved, calculated } => {
                checksum("summary", saved, calculated)
            }
            McapError::BadAttachmentCrc { saved, calculated } => {
                checksum("attachment", saved, calculated)
            }
            source => Self::Mcap {
                source: Box::new(source),
            },
        }
    }
}

/// Compares a value that a record tells with the one found.
pub(crate) fn agree<T: PartialEq + Debug>(
    record: &'static str,
    field: &'static str,
    told: T,
    found: T,
) -> Result<(), Damage> {
    if told == found {
        return Ok(());
    }
    Err(Damage::Disagrees {
        record,
        field,
        told: format!("{told:?}"),
        found: format!("{found:?}"),
    })
}

/// Checks the length of what is read into memory.
pub(crate) fn limited(opcode: u8, length: u64, limit: usize) -> Result<usize, Damage> {
    let fits = usize::try_from(length)
        .ok()
        .filter(|length| *length <= limit);
    fits.ok_or(Damage::TooLong {
        opcode,
        length,
        limit,
    })
}
