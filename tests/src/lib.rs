//! The harness of the integration tests: the programs of the suite as processes, each test in a [`World`] of its own.

#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stderr,
    reason = "a test stops at the first surprise and says why"
)]

mod bags;
mod binaries;
mod chromium;
mod controls;
mod cpp;
mod disks;
mod documented;
mod domain;
mod effort_controller;
mod ending;
mod flight;
mod hosts;
mod keystore;
mod operator;
mod process;
mod python;
mod recording;
mod scenes;
mod states;
mod truth;
mod wait;
mod world;

use std::path::PathBuf;

pub use bags::{earlier_bags, reference_bag, reference_bags};
pub use binaries::{binary, fly_in_release};
pub use chromium::browse;
pub use controls::{coast, publish};
pub use cpp::fast_dds;
pub use disks::{Disk, with_disks};
pub use documented::{Row, codes, documented};
pub use effort_controller::{EffortController, efforts};
pub use ending::{assert_gone, await_node, note};
pub use flight::{Difference, Failure, Replanned, Summary, Verdict};
pub use hosts::{Cut, Host, Hosts, between_hosts};
pub use keystore::Keystore;
pub use nix::sys::signal::Signal;
pub use operator::Operator;
pub use process::{Finished, Process};
pub use python::{python, ros_python};
pub use recording::{Record, Recording};
pub use scenes::{edited, scene, shipped};
pub use states::{Sender, await_stall, state_numbers};
pub use truth::{Deviation, Trajectory, optimal_cost};
pub use wait::{PATIENCE, eventually, settled, within};
pub use world::World;

/// The root of the repository.
pub fn root() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}
