//! The player node: replays a rosbag2 directory over shared memory and DDS, and ends with it.
//!
//! Each message goes out as the bytes that were recorded. States go over shared memory too, as they came.

mod channel;
mod channels;
mod clock;
mod config;
mod depths;
mod latched;
mod pace;
mod range;
mod reel;
mod remote;
mod replay;
mod run;
mod services;
mod states;

use std::io::Write;
use std::process::ExitCode;

/// Runs the node with `args`, the command line without the program's name.
pub fn main(args: impl IntoIterator<Item = String>) -> ExitCode {
    lgvi_middleware::node::main::<run::Player>(args)
}

/// The same in a program of another's; the node's reports go to `reports`.
pub fn main_reporting(
    args: impl IntoIterator<Item = String>,
    reports: impl Write + Send + 'static,
) -> ExitCode {
    lgvi_middleware::node::main_reporting::<run::Player>(args, reports)
}
