//! Samples that cross shared memory between nodes of one host, and their conversion to ROS messages.
//!
//! A state is an iceoryx2 slice of [`BodySample`] under the user header [`StateHeader`]; a control sequence is a slice
//! of [`ControlInterval`] under [`ControlHeader`], or with a feedback law of [`FeedbackInterval`] under
//! [`FeedbackHeader`]. All are plain `repr(C)` structs with fixed type names, so that
//! processes in other languages can read them. The conversions keep every bit of every number.

#![allow(
    unsafe_code,
    reason = "derive(ZeroCopySend) writes an unsafe impl for plain repr(C) structs"
)]

mod control;
mod feedback;
mod name;
mod state;

pub use control::{ControlHeader, ControlInterval};
pub use feedback::{FeedbackHeader, FeedbackInterval, Limits};
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
    /// A control sequence needs as many moments as forces.
    #[error(
        "control sequence for {body:?} has {forces} forces and {moments} moments, expected as many"
    )]
    LengthMismatch {
        /// The controlled body.
        body: String,
        /// Forces in the message.
        forces: usize,
        /// Moments in the message.
        moments: usize,
    },
    /// A feedback law has as much of everything as there are intervals, or is not there at all.
    #[error(
        "control sequence for {body:?} has {found} elements in `{field}`, expected {expected} for its {intervals} \
         intervals, or an open loop without `reference` and `feedback`"
    )]
    LawLength {
        /// The controlled body.
        body: String,
        /// `reference` or `feedback`.
        field: &'static str,
        /// Its elements.
        found: usize,
        /// What there should be.
        expected: usize,
        /// Intervals of the sequence.
        intervals: usize,
    },
}
