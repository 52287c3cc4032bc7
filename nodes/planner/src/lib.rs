//! The planner node: solves a scene's maneuver and publishes the control sequence.
//!
//! It publishes each iteration of the solver while it works, and the plan when it has one, over shared memory and over
//! DDS, both for late joiners too. Then it stays until it is told to stop: it follows the flight and plans it anew where
//! the scene says so, and serves the action `plan_maneuver`.
//!
//! Solving is the worker thread's; the node's own thread never waits for it.
//!
//! [`plan`] is the solver itself, free of any middleware. Without the feature `node`, which is one of the defaults, the
//! crate has it alone.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::panic))]
#![cfg_attr(
    not(feature = "node"),
    allow(
        dead_code,
        unused_variables,
        reason = "the node uses more of the solver"
    )
)]

#[cfg(feature = "node")]
mod follower;
#[cfg(feature = "node")]
mod goals;
#[cfg(feature = "node")]
mod markers;
#[cfg(feature = "node")]
mod messages;
#[cfg(feature = "node")]
mod monitor;
mod nominal;
#[cfg(feature = "node")]
mod outlet;
#[cfg(feature = "node")]
mod planner;
#[cfg(feature = "node")]
mod prediction;
#[cfg(feature = "node")]
mod replanner;
#[cfg(feature = "node")]
mod run;
mod sequence;
mod solver;
mod used;
#[cfg(feature = "node")]
mod worker;

pub use nominal::{NoPlan, NominalPlan, plan, plan_rest};
pub use solver::{Iteration, Reason};

/// Runs the node with `args`, the command line without the program's name.
#[cfg(feature = "node")]
pub fn main(args: impl IntoIterator<Item = String>) -> std::process::ExitCode {
    lgvi_middleware::node::main::<planner::Planner>(args)
}
