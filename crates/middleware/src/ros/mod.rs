//! Topics, services and actions of ROS 2, parameters, lifecycle, clock and diagnostics.
//!
//! A [`RosNode`] is one ROS node. What it is stands in the files here; how its bytes reach others stands behind `wire`:
//! `dds`, the default, and `zenoh`, with the feature of that name.
//!
//! # Assumptions and limitations
//! - A publisher and a subscription of the *same* [`RosNode`] do not reliably match: use two nodes.
//! - Only plain CDR (XCDR1) is sent and received, which is what ROS 2 uses.
//! - Over DDS, type hashes are not announced.
//! - Over DDS, a peer that is killed is noticed when its lease ends: 10 s to 50 s. One that is suspended for longer is kept on
//!   this host (Linux), and lost for good beyond it: RustDDS 0.15 does not match a participant that returns.
//! - Over DDS, a process that was stopped and continued (Ctrl-Z, `fg`) neither hears nor is heard: RustDDS 0.15 ends its
//!   threads when a system call of theirs is interrupted. Restart it.
//! - An endpoint may be used from several threads, but a subscription has room for only one waiting task at a time.

mod action;
mod arrivals;
mod clock;
mod dds;
mod diagnostics;
mod executor;
mod lifecycle;
mod namesakes;
mod node;
mod publisher;
mod qos;
mod service;
mod subscription;
mod topics;
mod type_names;
mod wire;
#[cfg(feature = "zenoh")]
mod zenoh;

use std::io;

use crate::{NameError, SecurityError};

pub use action::{
    ActionClient, ActionServer, Decision, GoalHandle, GoalId, GoalOutcome, GoalState,
    SendGoalError, StopReason,
};
pub use clock::Clock;
pub use diagnostics::{Diagnosed, Diagnostics, Level, Status};
pub use executor::{Executor, Reply, Running};
pub use lifecycle::{Asked, Change, Lifecycle, Outcome, State};
pub use namesakes::Namesake;
pub use node::RosNode;
pub use publisher::{PublishError, Publisher, RawPublisher};
pub use qos::Qos;
pub use service::{CallError, Request, RequestId, ServiceClient, ServiceServer};
pub use subscription::{
    RawSubscription, Sample, SampleId, SampleInfo, Subscription, TakeError, WriterId,
};
pub use topics::TopicInfo;

/// A node or an endpoint that cannot be created.
#[derive(Debug, thiserror::Error)]
pub enum RosError {
    /// The topic's name is not allowed.
    #[error(transparent)]
    Name(#[from] NameError),
    /// Not of the form `package/msg/Type`.
    #[error("message type {0:?} is not of the form package/msg/Type")]
    TypeName(String),
    /// Security is asked for and cannot be had.
    #[error(transparent)]
    Security(#[from] SecurityError),
    /// The threads that serve it cannot be started.
    #[error(transparent)]
    Threads(#[from] io::Error),
    /// The domain cannot be joined.
    #[error("cannot join domain {domain_id}: {reason}")]
    Join {
        /// The domain.
        domain_id: u16,
        /// What the wire says.
        reason: String,
    },
    /// The endpoint cannot be created.
    #[error("cannot create an endpoint on {topic} of type {type_name}: {reason}")]
    Endpoint {
        /// The absolute topic name.
        topic: String,
        /// The message type.
        type_name: String,
        /// What the wire says.
        reason: String,
    },
}
