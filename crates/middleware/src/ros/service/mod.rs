//! Services: requests to one topic, replies on another.
//!
//! A [`ServiceServer`] takes requests when its owner asks for them and replies whenever the owner is ready; it has no
//! thread. A [`ServiceClient`] calls one request after the other and waits for each reply, for a limited time.
//!
//! # Assumptions and limitations
//! - Client and server must use the same [`ServiceMapping`](crate::ServiceMapping).
//! - A request is handed out once the reply can reach its client, which is not so for some milliseconds after discovery;
//!   after a second it is handed out in any case.
//! - With the mapping of Fast DDS, RustDDS 0.15 garbles what it has to cut into fragments (it writes the identity a byte
//!   too late). Such requests and replies are refused: those above [1372 bytes](PublishError::TooLong), or 60 000 where
//!   all peers are on the loopback interface alone. The mapping of Cyclone DDS has no such limit.
//! - A request may be executed twice if its server leaves before it has replied.
//! - A server does not answer requests from before it was made; clocks that differ by more than a second make it take
//!   others for those, until it is as old as they differ.
//! - Every client receives the replies to all of them, and drops those that are not its own. One that hangs, or was
//!   killed, holds up the server's replies to the others once 512 are unacknowledged, until its lease ends.
//! - Service events (introspection) are not published.

mod client;
mod server;
mod wire;

use std::time::Duration;

#[cfg(doc)]
use super::PublishError;
use super::Qos;

pub use client::{CallError, ServiceClient};
pub use server::{Request, ServiceServer};
pub use wire::RequestId;

/// Samples that wait to be taken: requests of all clients, or replies to all of them.
const DEPTH: usize = 1000;

/// The longest a reply waits for a hanging client, or for one that has just been found to be introduced.
const MAX_WAIT: Duration = Duration::from_millis(20);

const TAKEN: Qos = Qos::reliable(DEPTH);

/// RustDDS sends to late joiners of every kind what it retains, which is of no use to them here.
const SENT: Qos = Qos::reliable(1).max_wait(MAX_WAIT);
