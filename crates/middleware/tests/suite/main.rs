//! Shared memory and DDS, between participants and processes, and with foreign peers.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

#[path = "../wires/actions.rs"]
mod actions;
mod cyclone;
mod cyclone_action;
mod graph;
mod layers;
mod mappings;
mod parameters;
mod processes;
mod qos;
mod rosout;
#[path = "../wires/services.rs"]
mod services;
mod shm;
mod stall;
mod static_peers;
mod storm;
#[path = "../wires/topics.rs"]
mod topics;
