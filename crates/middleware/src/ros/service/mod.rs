//! Services: requests to one topic, replies on another.
//!
//! A [`ServiceServer`] takes requests when its owner asks for them and replies whenever the owner is ready; it has no
//! thread. A [`ServiceClient`] calls one request after the other and waits for each reply, for a limited time.
//!
//! # Assumptions and limitations
//! - A request may be executed twice if its server leaves before it has replied.
//! - Service events (introspection) are not published.
//!
//! Over DDS:
//! - Client and server must use the same [`ServiceMapping`](crate::ServiceMapping).
//! - A request is handed out once the reply can reach its client, which is not so for some milliseconds after discovery;
//!   after a second it is handed out in any case.
//! - With the mapping of Fast DDS, RustDDS 0.15 garbles what it has to cut into fragments (it writes the identity a byte
//!   too late). Such requests and replies are refused: those above [1372 bytes](PublishError::TooLong), or 60 000 where
//!   all peers are on the loopback interface alone. The mapping of Cyclone DDS has no such limit.
//! - A server does not answer requests from before it was made. If clocks differ by more than a second, it takes others for
//!   those until it is as old as they differ.
//! - Every client receives the replies to all of them, and drops those that are not its own. One that hangs, or was
//!   killed, holds up the server's replies to the others once 512 are unacknowledged, until its lease ends.

mod client;
mod server;

#[cfg(doc)]
use super::PublishError;

use std::collections::VecDeque;

pub use client::{CallError, ServiceClient};
pub use server::{Request, ServiceServer};

use crate::ros::WriterId;

/// The identity of a request: by it a reply finds the client and the call that it is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RequestId {
    /// The request's publisher.
    pub(super) writer: WriterId,
    /// The client, as it calls itself.
    pub(super) client: [u8; 16],
    /// Counts the client's requests.
    pub(super) sequence: i64,
}

/// Requests that wait to be taken: of one client, so that one that floods the server crowds out none but itself, and of all.
const MAX_WAITING_OF_CLIENT: usize = 16;
const MAX_WAITING: usize = 256;

/// Has a request wait; returns the one that makes room for it.
pub(super) fn enqueue<T>(
    waiting: &mut VecDeque<T>,
    request: T,
    id: impl Fn(&T) -> RequestId,
) -> Option<T> {
    let client = id(&request).writer;
    let mut own = (0..waiting.len()).filter(|place| id(&waiting[*place]).writer == client);
    let oldest = own.next();
    let oldest = if own.count() + 1 >= MAX_WAITING_OF_CLIENT {
        oldest
    } else {
        (waiting.len() >= MAX_WAITING).then_some(0)
    };
    let pushed_out = oldest.and_then(|oldest| waiting.remove(oldest));
    waiting.push_back(request);
    pushed_out
}

impl RequestId {
    #[cfg(test)]
    pub(in crate::ros) fn numbered(sequence: i64) -> Self {
        Self {
            writer: WriterId([1; 16]),
            client: [2; 16],
            sequence,
        }
    }
}
