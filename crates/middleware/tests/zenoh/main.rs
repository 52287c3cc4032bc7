//! The wire of Zenoh: what holds by every wire, and what is Zenoh's own.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

#[path = "../wires/actions.rs"]
mod actions;
mod graph;
mod hiroz;
mod security;
#[path = "../wires/services.rs"]
mod services;
#[path = "../wires/topics.rs"]
mod topics;
