//! Services: requests to one topic, replies on another.
//!
//! A [`ServiceServer`] takes requests when its owner asks for them and replies whenever the owner is ready; it has no
//! thread. A [`ServiceClient`] calls one request after the other and waits for each reply, for a limited time.
//!
//! # Assumptions and limitations
//! - Client and server must use the same [`ServiceMapping`](crate::ServiceMapping).
//! - A request is handed out once the reply can reach its client, which is not so for some milliseconds after discovery;
//!   after [`PATIENCE`](server) it is handed out in any case.
//! - Every client receives the replies to all of them, and drops those that are not its own. One that hangs, or was
//!   killed, holds up the server's replies to the others once 512 are unacknowledged, until its lease ends.
//! - Service events (introspection) are not published.

mod client;
mod server;
mod wire;

use super::Qos;
use std::time::Duration;

pub use client::{CallError, ServiceClient};
pub use server::{Request, ServiceServer};
pub use wire::RequestId;

/// Requests that wait for the server, and replies that wait for a client.
const DEPTH: usize = 64;

/// The longest a reply waits for a hanging client, or for one that has just been found to be introduced.
const MAX_WAIT: Duration = Duration::from_millis(20);

const QOS: Qos = Qos::reliable(DEPTH).max_wait(MAX_WAIT);
