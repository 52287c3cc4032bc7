//! Reader of plain CDR in either byte order, value by value according to the definition.
//!
//! A length claimed by the payload leads to an allocation only after the payload has been found to be long enough.
//! Alignment is relative to the end of the encapsulation header. Source: OMG DDS-XTypes 1.3, 7.4.1 (`PLAIN_CDR`).

mod error;
mod reader;
mod value;

pub use error::{DecodeError, Fault};
pub(crate) use reader::Reader;
pub(crate) use value::{Value, Values};

/// Size of the encapsulation header in bytes.
const HEADER: usize = 4;

/// Maximum number of bytes after the message, because payloads are padded to a multiple of four bytes.
const MAX_PADDING: usize = 3;
