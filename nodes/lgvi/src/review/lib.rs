//! What can be said of a scene without flying it, of a recorded flight by flying it again, and of many flights of a scene, for
//! the command `lgvi` and for other programs.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod choosing;
mod course;
mod explain;
mod flight_bag;
mod guidance;
mod scenes;
pub mod sweep;
mod threads;
mod verify;

pub use choosing::{choose, decided};
pub use course::Course;
pub use explain::Explanation;
pub use flight_bag::FlightBag;
pub use guidance::guidance;
pub use scenes::SCENES;
pub use threads::{TooManyThreads, check_threads};
pub use verify::{Difference, Outcome, Value, Verdict, verify};

use thiserror::Error;

/// Why a scene or a bag is not reviewed, in words; it names the scene or the bag.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{0}")]
pub struct Unusable(String);

impl Unusable {
    /// For this reason.
    pub fn new(reason: impl ToString) -> Self {
        Self(reason.to_string())
    }
}

#[cfg(feature = "programs")]
impl From<Unusable> for lgvi_middleware::node::NodeError {
    fn from(error: Unusable) -> Self {
        Self::Input(error.0)
    }
}
