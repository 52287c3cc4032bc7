//! What the lgvi nodes have in common with the rest of the ROS 2 world and with each other.
//!
//! - [`NodeArgs`], [`Parameters`], [`Environment`]: the command line, parameter files and environment of a ROS 2 node.
//! - [`parameters`]: what a node declares, and others see and set.
//! - [`node`]: managed nodes, to build your own on.
//! - [`ros`]: topics, services and actions over DDS or Zenoh.
//! - [`shm`]: states and controls over shared memory, on one host.
//! - [`log`], [`Shutdown`], [`report`]: logging, signals, and the channel to the process that started a node.

#![cfg_attr(
    not(feature = "transport"),
    allow(dead_code, reason = "services of parameters go by DDS")
)]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod args;
mod assignment;
#[cfg(feature = "transport")]
mod block;
mod environment;
#[cfg(feature = "transport")]
pub mod log;
mod log_settings;
mod names;
#[cfg(feature = "transport")]
pub mod node;
pub mod parameters;
mod params_file;
mod remap;
pub mod report;
#[cfg(feature = "transport")]
pub mod ros;
#[cfg(feature = "transport")]
mod runtime;
mod security;
#[cfg(feature = "transport")]
pub mod shm;
#[cfg(feature = "transport")]
mod shutdown;
pub mod sync;
#[cfg(feature = "transport")]
mod wall;
mod yaml;

pub use args::{ArgsError, NodeArgs};
#[cfg(feature = "transport")]
pub use block::thread_waker;
pub use environment::{
    Environment, EnvironmentError, MAX_DOMAIN_ID, Reach, Rmw, ServiceMapping, ZenohSettings,
};
pub use log_settings::LogSettings;
pub use names::NameError;
pub use parameters::{
    Change as ParameterChange, Given, ParameterError, ParameterKind, ParameterSpec, ParameterType,
    ParameterValue, Parameters,
};
pub use security::{Security, SecurityError, SecurityStrategy};
#[cfg(feature = "transport")]
pub use shutdown::Shutdown;
