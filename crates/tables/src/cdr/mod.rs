//! Plain CDR of either byte order, read value by value as the definition says.
//!
//! Nothing is allocated for a length that the payload claims before the payload has been found to be long enough.
//! Alignment counts from the end of the encapsulation header. Source: OMG DDS-XTypes 1.3, 7.4.1 (`PLAIN_CDR`).

mod error;
mod reader;
mod value;

pub use error::{DecodeError, Fault};
pub(crate) use reader::Reader;
pub(crate) use value::{Value, Values};

/// Bytes of the encapsulation header.
const HEADER: usize = 4;

/// Payloads are padded to four bytes, so that up to this many may follow the message.
const MAX_PADDING: usize = 3;
