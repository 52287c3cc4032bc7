//! The planner node: solves a scene's maneuver and publishes the control sequence.
//!
//! It publishes each iteration of the solver while it works, and the plan when it has one, over shared memory and over
//! DDS, both for late joiners too. Then it stays until it is told to stop: it follows the flight and plans it anew where
//! the scene says so, and serves the action `plan_maneuver`.
//!
//! Solving is the worker thread's; the node's own thread never waits for it.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::panic))]

mod follower;
mod goals;
mod markers;
mod messages;
mod monitor;
mod nominal;
mod outlet;
mod planner;
mod prediction;
mod replanner;
mod run;
mod sequence;
mod solver;
mod worker;

use std::process::ExitCode;

pub use nominal::{NominalPlan, plan};

/// Runs the node with `args`, the command line without the program's name.
pub fn main(args: impl IntoIterator<Item = String>) -> ExitCode {
    lgvi_middleware::node::main::<planner::Planner>(args)
}
