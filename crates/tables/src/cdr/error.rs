//! What is wrong with payloads.

use std::fmt::Display;

use thiserror::Error;

use super::{HEADER, MAX_PADDING};

/// A payload that is not what its definition says.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{}{fault}", prefix(.path))]
pub struct DecodeError {
    /// The field, as `pose.position.x`; empty for the payload as a whole.
    pub path: String,
    /// What is wrong with it.
    pub fault: Fault,
}

fn prefix(path: &str) -> String {
    if path.is_empty() {
        String::new()
    } else {
        format!("{path}: ")
    }
}

/// What is wrong with a payload.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Fault {
    /// Fewer bytes than the encapsulation header has.
    #[error("{length} bytes are too few for the encapsulation header of {HEADER}")]
    NoHeader {
        /// Bytes found.
        length: usize,
    },
    /// An encapsulation other than plain CDR.
    #[error("encapsulation {found:#06x}, expected plain CDR: 0x0000 or 0x0001")]
    Encapsulation {
        /// The identifier found.
        found: u16,
    },
    /// The payload ends before the value does.
    #[error("needs {needed} bytes at byte {position}, {left} are left")]
    Short {
        /// Where, counted from the start of the payload.
        position: usize,
        /// Bytes that are needed.
        needed: usize,
        /// Bytes that are left.
        left: usize,
    },
    /// A truth value is neither 0 nor 1.
    #[error("truth value {found}, expected 0 or 1")]
    Truth {
        /// The octet found.
        found: u8,
    },
    /// More elements, bytes or units than the definition allows.
    #[error("length {found}, expected at most {bound}")]
    Bound {
        /// The length found.
        found: usize,
        /// The bound of the definition.
        bound: usize,
    },
    /// Another number of elements than all messages before.
    #[error("{found} elements, expected {expected} as in all messages before")]
    Length {
        /// The length found.
        found: usize,
        /// The length of the others.
        expected: usize,
    },
    /// A `string` does not end with a zero.
    #[error("text of {length} bytes does not end with a zero")]
    Unterminated {
        /// Its length with what should be the zero.
        length: usize,
    },
    /// A text is no Unicode.
    #[error("text is no valid Unicode after {valid} bytes or units")]
    Unicode {
        /// How much of it is.
        valid: usize,
    },
    /// More bytes than the message and its padding take.
    #[error(
        "ends after {consumed} of {length} bytes, expected at most {MAX_PADDING} bytes of padding"
    )]
    Trailing {
        /// Bytes that the message takes, encapsulation header included.
        consumed: usize,
        /// Bytes found.
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
    /// The error of a field or element, as that of what has it.
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
