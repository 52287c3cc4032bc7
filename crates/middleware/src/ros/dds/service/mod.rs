//! Services on two DDS topics: requests on one, replies on the other.

mod client;
mod mapping;
mod server;

use std::time::Duration;

use crate::ros::Qos;

pub(super) use client::Client;
pub(super) use server::Server;

/// Samples that wait to be taken: requests of all clients, or replies to all of them.
const DEPTH: usize = 1000;

/// The longest a reply waits for a hanging client, or for one that has just been found to be introduced.
const MAX_WAIT: Duration = Duration::from_millis(20);

const TAKEN: Qos = Qos::reliable(DEPTH);

/// RustDDS sends to late joiners of every kind what it retains, which is of no use to them here.
const SENT: Qos = Qos::reliable(1).max_wait(MAX_WAIT);
