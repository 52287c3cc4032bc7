//! Errors in payloads.

use std::fmt::Display;

use thiserror::Error;

use super::{HEADER, MAX_PADDING};

/// An error in a payload with respect to its definition.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{}{fault}", prefix(.path))]
pub struct DecodeError {
    /// Path of the field, such as `pose.position.x`. It is empty for the payload as a whole.
    pub path: String,
    /// The fault of the field.
    pub fault: Fault,
}

fn prefix(path: &str) -> String {
    if path.is_empty() {
        String::new()
    } else {
        format!("{path}: ")
    }
}

/// A fault in a payload.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Fault {
    /// The payload is shorter than the encapsulation header.
    #[error("{length} bytes are too few for the encapsulation header of {HEADER}")]
    NoHeader {
        /// Number of bytes found.
        length: usize,
    },
    /// The encapsulation is not plain CDR.
    #[error("encapsulation {found:#06x}, expected plain CDR: 0x0000 or 0x0001")]
    Encapsulation {
        /// The identifier found.
        found: u16,
    },
    /// The payload ends before the value does.
    #[error("needs {needed} bytes at byte {position}, {left} are left")]
    Short {
        /// Position in bytes from the start of the payload.
        position: usize,
        /// Number of bytes needed.
        needed: usize,
        /// Number of bytes left.
        left: usize,
    },
    /// A Boolean is neither 0 nor 1.
    #[error("truth value {found}, expected 0 or 1")]
    Truth {
        /// The octet found.
        found: u8,
    },
    /// A value has more elements, bytes or code units than the definition allows.
    #[error("length {found}, expected at most {bound}")]
    Bound {
        /// The length found.
        found: usize,
        /// The bound of the definition.
        bound: usize,
    },
    /// The number of elements differs from that of all previous messages.
    #[error("{found} elements, expected {expected} as in all messages before")]
    Length {
        /// The length found.
        found: usize,
        /// The length in the previous messages.
        expected: usize,
    },
    /// A `string` does not end with a zero.
    #[error("text of {length} bytes does not end with a zero")]
    Unterminated {
        /// Length of the text including the missing zero.
        length: usize,
    },
    /// A text is not valid Unicode.
    #[error("text is not valid Unicode after {valid} bytes or units")]
    Unicode {
        /// Length of the valid part.
        valid: usize,
    },
    /// The payload is longer than the message and its padding.
    #[error(
        "ends after {consumed} of {length} bytes, expected at most {MAX_PADDING} bytes of padding"
    )]
    Trailing {
        /// Number of bytes of the message, including the encapsulation header.
        consumed: usize,
        /// Number of bytes found.
        length: usize,
    },
}

impl From<Fault> for DecodeError {
    fn from(fault: Fault) -> Self {
        Self {
            path: String::new(),
            fault,
        }
    }
}

impl DecodeError {
    /// Returns the error with `segment` prepended to its path.
    pub(crate) fn within(self, segment: impl Display) -> Self {
        let Self { path, fault } = self;
        let path = if path.is_empty() {
            segment.to_string()
        } else {
            format!("{segment}.{path}")
        };
        Self { path, fault }
    }
}
