//! The propagator node: integrates a scene, flies control sequences, publishes states.
//!
//! The main thread runs the flight and sends full-rate states over shared memory (`run`); a second thread owns the ROS
//! side and the incoming controls (`link`). Between them go preallocated snapshots and controls, through lock-free
//! queues. [`Flight`] is the flight itself, free of any middleware: what it does depends on the scene and the accepted
//! controls only, so that a recorded flight can be repeated bit for bit.

mod actuation;
mod answers;
mod axes;
mod choosing;
mod command;
mod config;
mod controls;
mod cuts;
mod cycle;
mod docked;
mod effort;
mod ending;
mod flight;
mod law;
mod link;
mod lockstep;
mod messages;
mod monitor;
mod obey;
mod orders;
mod pace;
mod resolution;
mod run;
mod sensors;
mod set_states;
mod timeouts;
mod wrench;

use std::process::ExitCode;

pub use actuation::{Actuation, ActuationError};
pub use axes::Axes;
pub use controls::{ControlError, Controls};
pub use flight::{Flight, SetStatesError};
pub use law::{Law, LawError};
pub use set_states::{SetStates, StateError};

/// Name and version, as a flight's scene message carries them.
pub const SOFTWARE: &str = concat!("lgvi_propagator ", env!("CARGO_PKG_VERSION"));

/// Runs the node with `args`, the command line without the program's name.
pub fn main(args: impl IntoIterator<Item = String>) -> ExitCode {
    lgvi_middleware::node::main::<run::Propagator>(args)
}
