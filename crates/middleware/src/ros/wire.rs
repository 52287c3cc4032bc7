//! The wire: carries the bytes of topics and services between nodes, and knows who else is there.
//!
//! All that a ROS 2 node is (names, parameters, lifecycle, services, actions, clock, diagnostics) stands above it and is
//! the same over every wire. Names that cross this door are absolute and remapped; types are `package/msg/Type`; bytes
//! are CDR behind the four-byte encapsulation header.

use std::{
    task::{Context, Poll},
    time::Duration,
};

use lgvi_msgs::{RosMessage, Service, cdr::CdrError};

use super::{
    CallError, Namesake, PublishError, Qos, RequestId, RosError, SampleInfo, TakeError, TopicInfo,
    WriterId, arrivals::Arrivals,
};
use crate::Shutdown;

/// Encapsulation header of what is sent: plain CDR, little-endian.
pub(super) const LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];

/// A service's type, `package/srv/Type`, and its messages, `package/srv/Type_Request` and `package/srv/Type_Response`.
#[derive(Clone, Copy)]
#[cfg_attr(
    not(feature = "zenoh"),
    allow(dead_code, reason = "DDS names the messages only")
)]
pub(super) struct ServiceTypes {
    pub(super) service: &'static str,
    /// REP-2011 hash of the service's type.
    pub(super) hash: &'static str,
    pub(super) request: &'static str,
    pub(super) response: &'static str,
}

impl ServiceTypes {
    pub(super) fn of<S: Service>() -> Self {
        Self {
            service: S::TYPE_NAME,
            hash: S::TYPE_HASH,
            request: S::Request::TYPE_NAME,
            response: S::Response::TYPE_NAME,
        }
    }
}

/// A connection to the other nodes. Endpoints keep it open.
pub(super) trait Wire: Send + Sync {
    fn publisher(
        &self,
        topic: String,
        type_name: &str,
        qos: &Qos,
    ) -> Result<Box<dyn WirePublisher>, RosError>;

    fn subscription(
        &self,
        topic: String,
        type_name: &str,
        qos: &Qos,
    ) -> Result<Box<dyn WireSubscription>, RosError>;

    fn server(&self, service: &str, types: ServiceTypes) -> Result<Box<dyn WireServer>, RosError>;

    fn client(&self, service: &str, types: ServiceTypes) -> Result<Box<dyn WireClient>, RosError>;

    /// Topics of other participants, ordered by name and type.
    fn topics(&self) -> Vec<TopicInfo>;

    /// Fully qualified names of the nodes of other participants, sorted; twice where two nodes have one name.
    fn other_nodes(&self) -> Vec<String>;

    /// Nodes of other participants with this one's name.
    fn namesakes(&self) -> Vec<Namesake>;

    /// While held, changes of the node's endpoints are not announced; afterwards all are, at once.
    fn hold_announcements(&self, held: bool);

    /// Bounds all waits of the node's endpoints once `shutdown` is raised.
    fn leave_on(&self, shutdown: &Shutdown);
}

/// One side of a topic, and who is on the other.
pub(super) trait WireEndpoint: Send + Sync {
    fn matched(&self) -> usize;
    fn wait_for_matches(&self, count: usize, timeout: Duration) -> bool;
    fn incompatible(&self) -> usize;
    fn topic(&self) -> &str;
}

/// Sends samples. Dropped, it waits for acknowledgments for a short time.
pub(super) trait WirePublisher: Send + Sync {
    fn endpoint(&self) -> &dyn WireEndpoint;

    /// Publishes a sample, waiting up to `patience` for room; without one, as long as the quality of service says.
    fn publish(&self, cdr: Vec<u8>, patience: Option<Duration>) -> Result<(), PublishError>;

    /// Blocks until every matched reliable subscription has acknowledged everything, up to `patience`.
    fn flush(&self, patience: Duration) -> Result<(), PublishError>;

    /// The same for a glance: blames none.
    fn acknowledged_within(&self, wait: Duration) -> bool;

    /// How much of `patience` a flush would wait: hardly any, if acknowledgments are not to be expected.
    fn patience(&self, patience: Duration) -> Duration;

    fn sent(&self) -> u64;
    fn dropped(&self) -> u64;
    fn id(&self) -> WriterId;
}

/// Receives samples, those of one publisher in order.
pub(super) trait WireSubscription: Send + Sync {
    fn endpoint(&self) -> &dyn WireEndpoint;
    fn arrivals(&self) -> &Arrivals;
}

/// A request that can be replied to.
pub(super) struct Incoming {
    pub(super) id: RequestId,
    pub(super) cdr: Vec<u8>,
    pub(super) info: SampleInfo,
}

/// Takes requests and sends replies.
pub(super) trait WireServer: Send + Sync {
    /// Takes the next request, or has the task woken when one may be taken.
    fn poll_take(&self, context: &Context<'_>) -> Poll<Result<Incoming, TakeError>>;

    /// The error of a request that is not of the service's type.
    fn undecodable(&self, info: SampleInfo, source: CdrError) -> TakeError {
        TakeError::Decode {
            topic: self.service().into(),
            info,
            source: Box::new(source),
        }
    }

    fn reply(&self, id: RequestId, cdr: Vec<u8>) -> Result<(), PublishError>;

    /// The most bytes of a reply at present, encapsulation header included.
    fn max_reply(&self) -> usize;

    fn service(&self) -> &str;
}

/// Sends requests and waits for their replies.
pub(super) trait WireClient: Send + Sync {
    fn wait_for_server(&self, timeout: Duration) -> bool;

    /// Calls the service; `timeout` includes the discovery of a server.
    fn call(&self, cdr: Vec<u8>, timeout: Duration) -> Result<Vec<u8>, CallError>;

    fn service(&self) -> &str;
}
