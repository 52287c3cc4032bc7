//! The propagator node: integrates a scene, flies control sequences, publishes states.
//!
//! The main thread runs the flight and sends full-rate states over shared memory (`run`); a second thread owns the ROS
//! side and the incoming controls (`link`). Between them go preallocated snapshots and controls, through lock-free
//! queues. [`Flight`] is the flight itself, free of any middleware: what it does depends on the scene and the accepted
//! controls only, so that a recorded flight can be repeated bit for bit. Without the feature `node`, which is one of the defaults, the
//! crate has the flight alone.

mod actuation;
mod axes;
mod controls;
mod flight;
mod law;
#[cfg(feature = "node")]
mod node;
mod pushes;
mod set_states;
mod target;

pub use actuation::{Actuation, ActuationError};
pub use axes::Axes;
pub use controls::{ControlError, Controls};
pub use flight::{Flight, SetStatesError};
pub use law::{Law, LawError};
#[cfg(feature = "node")]
pub use node::main;
pub use set_states::{SetStates, StateError};

/// Name and version, as a flight's scene message carries them.
pub const SOFTWARE: &str = concat!("lgvi_propagator ", env!("CARGO_PKG_VERSION"));
