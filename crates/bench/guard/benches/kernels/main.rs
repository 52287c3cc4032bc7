//! The hot kernels: 100 steps, loads or messages each, and some iterations of the planner.

#![allow(clippy::expect_used)]
#![allow(missing_docs, unused_qualifications, reason = "made by macros")]

mod fields;
mod newton;
mod recording;
mod simulation;

use gungraun::main;

use fields::gravity;
use newton::planner;
use recording::messages;
use simulation::steps;

/// Calls of a kernel.
const CALLS: u32 = 100;

main!(library_benchmark_groups = [steps, gravity, planner, messages]);
