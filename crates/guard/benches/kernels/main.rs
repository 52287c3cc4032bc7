//! The hot kernels: 100 steps, loads or messages each, and some iterations of the planner.

#![allow(clippy::expect_used)]
#![allow(missing_docs, reason = "made by macros")]

mod gravity;
mod messages;
mod planner;
mod steps;

use gungraun::main;

use gravity::gravity;
use messages::messages;
use planner::planner;
use steps::steps;

/// Calls of a kernel.
const CALLS: u32 = 100;

main!(library_benchmark_groups = [steps, gravity, planner, messages]);
