//! Shared memory and DDS, between participants and processes, and with foreign peers.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

mod actions;
mod cyclone;
mod cyclone_action;
mod graph;
mod parameters;
mod qos;
mod ros;
mod rosout;
mod services;
mod shm;
mod stall;
mod static_peers;
mod storm;
