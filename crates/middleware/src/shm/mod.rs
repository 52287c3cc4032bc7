//! States and controls over shared memory, between the nodes of one host.
//!
//! The transport is iceoryx2: publish-subscribe services of slices under a user header. A service is named
//! `lgvi/<domain id><topic>`, such as `lgvi/0/lgvi_propagator/state`, with the topic's absolute name.
//!
//! | Channel | User header | Slice of | Publishers | Subscribers | Buffer | History |
//! | --- | --- | --- | --- | --- | --- | --- |
//! | [`State`] | `lgvi/StateHeader` | `lgvi/BodySample` | 1 | 8 | 8192 | 1 |
//! | [`Control`] | `lgvi/ControlHeader` | `u8`: the CDR of `lgvi_msgs/msg/ControlSequence` | 8 | 8 | 4 | 1 |
//!
//! The type names in quotes are those a process in another language gives; the structs are `repr(C)` and documented in
//! [`lgvi_msgs::shm`]. Such a process opens the services with the numbers above and with *safe overflow off*.
//!
//! # What happens when a subscriber does not keep up
//! Overflow is a property of a service, which both policies of delivery share. It is off, so that a sample once
//! accepted is never taken back: the *newest* is refused, by [`Delivery::DropNewest`] at once and by
//! [`Delivery::Lossless`] after a wait. The publisher counts what was refused; the subscriber sees a gap in the
//! sequence. (With overflow on, the oldest would vanish under a reader that is only late, and a lossless publisher
//! could not exist beside it.)
//!
//! A publisher has memory for full buffers of all subscribers, but no more than 256 MiB of it, or 2048 states. While
//! all of that waits to be received, all subscribers are as one whose buffer is full. Memory is taken from the system
//! when it is used for the first time, and used again before more is taken. Where the file system of shared memory is full,
//! sending fails with [`ShmError::Full`].
//!
//! # Assumptions and limitations
//! - A subscriber connects to a new publisher when it receives: poll at least every 10 ms.
//! - What a killed process leaves is removed when the next node starts, or by [`ShmNode::clean`]; the description of a service
//!   that it was writing then, by a node that has seen it for 20 s.

mod channel;
mod delivery;
mod node;
mod options;
mod orphans;
mod publisher;
mod room;
mod root;
mod subscriber;

use std::{path::PathBuf, time::Duration};

use iceoryx2::service::ipc_threadsafe;

pub use channel::{Channel, Control, State};
pub use delivery::{Delivered, Delivery};
pub use node::ShmNode;
pub use options::ShmOptions;
pub use publisher::ShmPublisher;
pub use subscriber::{ShmSample, ShmSubscriber};

/// Publishes states.
pub type StatePublisher = ShmPublisher<State>;
/// Receives states.
pub type StateSubscriber = ShmSubscriber<State>;
/// Publishes control sequences.
pub type ControlPublisher = ShmPublisher<Control>;
/// Receives control sequences.
pub type ControlSubscriber = ShmSubscriber<Control>;

type Service = ipc_threadsafe::Service;

/// Shared memory that cannot be used as asked.
#[derive(Debug, thiserror::Error)]
pub enum ShmError {
    /// `LGVI_SHM_ROOT` or the name of the node cannot be used.
    #[error("{what} {value:?} cannot be used for shared memory: {reason}")]
    Name {
        /// What it is.
        what: &'static str,
        /// Its value.
        value: String,
        /// What iceoryx2 says.
        reason: String,
    },
    /// The directory of shared memory cannot be used.
    #[error(
        "shared memory cannot be kept in {}, which {owner} owns, by {user}: {reason}; \
         set LGVI_SHM_ROOT to a directory that {user} may write to",
        path.display()
    )]
    Root {
        /// The directory.
        path: PathBuf,
        /// Who owns it, or what it would lie in.
        owner: String,
        /// As whom the process runs.
        user: String,
        /// Why it cannot be used.
        reason: String,
    },
    /// The node cannot be created.
    #[error(
        "cannot create shared-memory node {name:?} in {}, which {owner} owns: {reason}",
        root.display()
    )]
    Node {
        /// The node's name.
        name: String,
        /// The directory of shared memory.
        root: PathBuf,
        /// Who owns it.
        owner: String,
        /// What iceoryx2 says.
        reason: String,
    },
    /// The service exists with another layout, or it or a port of it cannot be used.
    #[error("{service}: cannot {act}: {reason}")]
    Service {
        /// The service.
        service: String,
        /// What cannot be done.
        act: &'static str,
        /// What iceoryx2 says.
        reason: String,
    },
    /// Another process has begun to create the service and has not come to an end.
    #[error(
        "{service}: cannot open shared memory: another process has not finished creating it within {waited:.1?}: {reason}"
    )]
    Unfinished {
        /// The service.
        service: String,
        /// How long it was waited for.
        waited: Duration,
        /// What iceoryx2 says.
        reason: String,
    },
    /// The process was told to end while another one was creating the service.
    #[error("{service}: stopped after waiting for {waited:.1?} for another process to create it")]
    Interrupted {
        /// The service.
        service: String,
        /// How long it was waited for.
        waited: Duration,
    },
    /// There is already a publisher where only one may be.
    #[error("another instance is running: {service} already has {limit} publisher(s)")]
    AlreadyPublished {
        /// The service.
        service: String,
        /// How many may be.
        limit: usize,
    },
    /// The file system of shared memory is full.
    #[error("{path} is full: {service} needs {needed} bytes, {free} are free")]
    Full {
        /// The service.
        service: String,
        /// Where it is mounted.
        path: String,
        /// What is needed (byte).
        needed: u64,
        /// What is free (byte).
        free: u64,
    },
    /// More elements than the publisher was made for.
    #[error("{service}: a sample of {length} elements was sent; the limit is {limit}")]
    TooLong {
        /// The service.
        service: String,
        /// The sample's elements.
        length: usize,
        /// The most there may be.
        limit: usize,
    },
}

impl ShmError {
    fn service(service: &str, act: &'static str, reason: impl ToString) -> Self {
        Self::Service {
            service: service.into(),
            act,
            reason: reason.to_string(),
        }
    }
}
