//! The client's side of a service.

use std::{
    collections::BTreeSet,
    fmt,
    marker::PhantomData,
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use lgvi_msgs::{RosMessage, Service, cdr::CdrError};
use rustdds::GUID;
use tracing::debug;

use super::{RequestId, SENT, TAKEN, wire};
use crate::{
    ServiceMapping,
    block::Deadline,
    ros::{
        PublishError, RawPublisher, RawSubscription, RosError, RosNode, TakeError, WriterId,
        naming, node::Inner,
    },
};

/// How often a client that waits for a reply looks whether the server is still there.
const CYCLE: Duration = Duration::from_millis(100);

/// A call without an answer.
#[derive(Debug, thiserror::Error)]
pub enum CallError {
    /// No server was found.
    #[error("{service}: no server within {waited:?}")]
    NoServer {
        /// The service.
        service: String,
        /// How long was waited.
        waited: Duration,
    },
    /// A server was found and did not reply.
    #[error("{service}: no reply within {waited:?}")]
    NoReply {
        /// The service.
        service: String,
        /// How long was waited, discovery included.
        waited: Duration,
    },
    /// The servers that were found carry identities in another way than this node.
    #[error(
        "{service}: no server answers in the form of {ours}: RMW_IMPLEMENTATION must be the same there and here"
    )]
    Mapping {
        /// The service.
        service: String,
        /// The `RMW_IMPLEMENTATION` of this node.
        ours: &'static str,
    },
    /// The request could not be sent.
    #[error(transparent)]
    Send(#[from] PublishError),
    /// The reply could not be taken.
    #[error(transparent)]
    Take(#[from] TakeError),
    /// The request cannot be encoded, or the reply is not of the service's type.
    #[error(transparent)]
    Cdr(#[from] CdrError),
}

/// Calls a service, one request at a time; calls of other threads wait for their turn.
pub struct ServiceClient<S> {
    requests: RawPublisher,
    replies: RawSubscription,
    /// The number of the latest request, held during a call.
    turn: Mutex<i64>,
    node: Arc<Inner>,
    service: PhantomData<fn() -> S>,
}

impl<S: Service> ServiceClient<S> {
    pub(in crate::ros) fn new(node: &RosNode, service: &str) -> Result<Self, RosError> {
        let (request, reply) = (naming::dds_request(service), naming::dds_reply(service));
        let request_type = S::Request::TYPE_NAME;
        Ok(Self {
            replies: node.reader(service.into(), reply, S::Response::TYPE_NAME, &TAKEN)?,
            requests: node.writer(service.into(), request, request_type, &SENT)?,
            turn: Mutex::new(0),
            node: Arc::clone(node.inner()),
            service: PhantomData,
        })
    }

    /// Blocks until a server is found or the time has passed; returns whether there is one.
    pub fn wait_for_server(&self, timeout: Duration) -> bool {
        let (requests, replies) = (self.requests.guid(), self.replies.guid());
        self.node.matches.wait_for_pair(requests, replies, timeout)
    }

    /// Sends a request and waits for the reply. `timeout` includes the discovery of the server, but not the wait for
    /// calls of other threads.
    ///
    /// If the server leaves before it has replied, the request is sent again to the next one.
    ///
    /// # Errors
    /// No server or no reply in time, or a failure of the DDS stack.
    pub fn call(&self, request: &S::Request, timeout: Duration) -> Result<S::Response, CallError> {
        let cdr = lgvi_msgs::cdr::encode(request)?;
        let mut number = self.turn.lock().unwrap_or_else(PoisonError::into_inner);
        let deadline = Deadline::after(timeout);
        let mut first = None;
        while self.wait_for_server(deadline.left()) {
            while self.replies.take().is_ok_and(|reply| reply.is_some()) {}
            *number += 1;
            let asked = self.servers();
            let id = self.send(cdr.clone(), *number)?;
            let first = *first.get_or_insert(id.sequence);
            if let Some(reply) = self.reply_to(id, first, &asked, deadline)? {
                return Ok(lgvi_msgs::cdr::decode(&reply)?);
            }
            if deadline.left().is_zero() {
                break;
            }
            debug!(
                service = self.name(),
                "the server has left: asking the next one"
            );
        }
        let (service, waited) = (self.name().to_owned(), timeout);
        let mapping = self.node.service_mapping;
        let servers = self.servers();
        let other = |server: &GUID| wire::differs(mapping, server.to_bytes());
        Err(if !servers.is_empty() && servers.iter().all(other) {
            let ours = mapping.rmw();
            CallError::Mapping { service, ours }
        } else if first.is_some() {
            CallError::NoReply { service, waited }
        } else {
            CallError::NoServer { service, waited }
        })
    }

    /// The absolute name of the service.
    pub fn name(&self) -> &str {
        self.requests.topic()
    }

    fn send(&self, cdr: Vec<u8>, number: i64) -> Result<RequestId, PublishError> {
        let (writer, reader) = (self.requests.guid(), self.replies.guid());
        let mapping = self.node.service_mapping;
        let mut id = RequestId {
            writer: WriterId(writer.to_bytes()),
            client: wire::cyclone_client(writer),
            sequence: number,
        };
        let (cdr, related) = wire::request(mapping, cdr, id, reader);
        let sample = self.requests.publish_related(cdr, related)?;
        if mapping == ServiceMapping::FastDds {
            id.client = reader.to_bytes();
            id.sequence = sample.sequence;
        }
        Ok(id)
    }

    /// The servers' readers of requests.
    fn servers(&self) -> BTreeSet<GUID> {
        let (requests, replies) = (self.requests.guid(), self.replies.guid());
        self.node.matches.paired(requests, replies)
    }

    /// Waits until the deadline for the reply to a request, or to an earlier one of the same call, of which `first` is
    /// the first; `None` if it has passed or the servers that were `asked` have left.
    fn reply_to(
        &self,
        id: RequestId,
        first: i64,
        asked: &BTreeSet<GUID>,
        deadline: Deadline,
    ) -> Result<Option<Vec<u8>>, TakeError> {
        loop {
            let limit = deadline.left().min(CYCLE);
            if let Some(sample) = self.replies.recv_timeout(limit)? {
                if let Some((found, cdr)) = wire::taken_reply(self.node.service_mapping, sample)
                    && (first..=id.sequence).contains(&found.sequence)
                    // Servers of DDS-RPC name the writer of the request, those of ROS the reader, if it was named.
                    && (found.client == id.client || found.client == id.writer.0)
                {
                    return Ok(Some(cdr));
                }
            } else if deadline.left().is_zero() || asked.is_disjoint(&self.servers()) {
                return Ok(None);
            }
        }
    }
}

impl<S> fmt::Debug for ServiceClient<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("ServiceClient")
            .field(&self.requests)
            .finish()
    }
}
