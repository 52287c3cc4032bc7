//! The recorder node: full-rate states from shared memory and all other topics from DDS, into a rosbag2 directory.
//!
//! Two threads receive (`states`, `topics`) and one writes (`sink`), so that a slow disk delays neither; the queue between
//! them is bounded in bytes, and when it is full the receivers wait, and with them publishers that fly without loss. How
//! often and how long they have waited, and what is missing of each topic, the `account` has.

mod account;
mod batch;
mod config;
mod definitions;
mod drain;
mod elsewhere;
mod fields;
mod log_time;
mod outlet;
mod participants;
mod queue;
mod recorded;
mod request;
mod run;
mod seen;
mod selection;
mod services;
mod sink;
mod source;
mod stamp;
mod states;
mod topics;

use std::io::Write;
use std::process::ExitCode;

/// Runs the node with `args`, the command line without the program's name.
pub fn main(args: impl IntoIterator<Item = String>) -> ExitCode {
    lgvi_middleware::node::main::<run::Recorder>(args)
}

/// The same in a program of another's; the node's reports go to `reports`.
pub fn main_reporting(
    args: impl IntoIterator<Item = String>,
    reports: impl Write + Send + 'static,
) -> ExitCode {
    lgvi_middleware::node::main_reporting::<run::Recorder>(args, reports)
}
