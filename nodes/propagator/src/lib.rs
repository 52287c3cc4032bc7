//! The propagator node: integrates a scene, flies control sequences, publishes states.
//!
//! The main thread runs the flight and sends full-rate states over shared memory (`run`); a second thread owns the ROS
//! side and the incoming controls (`link`). Between them go preallocated snapshots and controls, through lock-free
//! queues. [`Flight`] is the flight itself, free of any middleware: what it does depends on the scene and the accepted
//! controls only, so that a recorded flight can be repeated bit for bit. Without the feature `node`, which is one of the defaults, the
//! crate has the flight alone.

#[cfg(feature = "node")]
mod choosing;
#[cfg(feature = "node")]
mod command;
#[cfg(feature = "node")]
mod config;
mod controls;
#[cfg(feature = "node")]
mod cuts;
#[cfg(feature = "node")]
mod cycle;
#[cfg(feature = "node")]
mod docked;
#[cfg(feature = "node")]
mod ending;
mod flight;
mod law;
#[cfg(feature = "node")]
mod link;
#[cfg(feature = "node")]
mod lockstep;
#[cfg(feature = "node")]
mod messages;
#[cfg(feature = "node")]
mod monitor;
#[cfg(feature = "node")]
mod obey;
#[cfg(feature = "node")]
mod orders;
#[cfg(feature = "node")]
mod pace;
#[cfg(feature = "node")]
mod resolution;
#[cfg(feature = "node")]
mod run;
#[cfg(feature = "node")]
mod sensors;
mod set_states;
#[cfg(feature = "node")]
mod torque;
#[cfg(feature = "node")]
mod wrench;

pub use controls::{ControlError, Controls, ForceAxes};
pub use flight::{Flight, SetStatesError};
pub use law::{Law, LawError};
pub use set_states::{SetStates, StateError};

/// Name and version, as a flight's scene message carries them.
pub const SOFTWARE: &str = concat!("lgvi_propagator ", env!("CARGO_PKG_VERSION"));

/// Runs the node with `args`, the command line without the program's name.
#[cfg(feature = "node")]
pub fn main(args: impl IntoIterator<Item = String>) -> std::process::ExitCode {
    lgvi_middleware::node::main::<run::Propagator>(args)
}
