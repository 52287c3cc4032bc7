//! Samples that cross shared memory between nodes of one host, and their conversion to ROS messages.
//!
//! A state is an iceoryx2 slice of [`BodySample`] under the user header [`StateHeader`]; both are plain `repr(C)` structs
//! with fixed type names, so that processes in other languages can read them. The conversions keep every bit of every
//! number. A control sequence is the CDR of its message, a slice of bytes under [`ControlHeader`].

#![allow(
    unsafe_code,
    reason = "derive(ZeroCopySend) writes an unsafe impl for plain repr(C) structs"
)]

mod control;
mod name;
mod state;

pub use control::ControlHeader;
pub use name::{Name, NameError};
pub use state::{BodySample, StateHeader};

use thiserror::Error;

use crate::stamp::StampError;

/// A message or sample that the other form cannot hold.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ConversionError {
    /// The body's name does not fit a sample.
    #[error(transparent)]
    Name(#[from] NameError),
    /// The time does not fit a message, or the message's is invalid.
    #[error(transparent)]
    Stamp(#[from] StampError),
}
