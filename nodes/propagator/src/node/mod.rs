//! The node around the flight.

mod answers;
mod choosing;
mod command;
mod config;
mod cuts;
mod cycle;
mod docked;
mod effort;
mod ending;
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
mod throttle;
mod timeouts;
mod wrench;

use std::process::ExitCode;

/// Runs the node with `args`, the command line without the program's name.
pub fn main(args: impl IntoIterator<Item = String>) -> ExitCode {
    lgvi_middleware::node::main::<run::Propagator>(args)
}
