//! The server's side of a service.

use std::{
    collections::VecDeque,
    fmt,
    marker::PhantomData,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    task::{Context, Poll},
    time::{Duration, Instant},
};

use lgvi_msgs::{RosMessage, Service, cdr::CdrError};
use rustdds::GUID;

use super::{RequestId, SENT, TAKEN, wire};
use crate::{
    ServiceMapping,
    block::{Deadline, block_on_for},
    ros::{
        PublishError, RawPublisher, RawSubscription, RosError, RosNode, Sample, SampleInfo,
        TakeError, naming, node::Inner,
    },
    wall,
};

/// How long a request is held back for its client to be reachable.
const PATIENCE: Duration = Duration::from_secs(1);

/// How old, in nanoseconds, a request from before the server may be.
const MAX_AGE: i64 = 1_000_000_000;

/// Requests that wait: of one client, so that one that floods the server crowds out none but itself, and of all.
const MAX_HELD_OF_CLIENT: usize = 16;
const MAX_HELD: usize = 256;

/// How often a request that is held back is looked at.
const CYCLE: Duration = Duration::from_millis(2);

/// A request of a client, and the identity by which it is replied to.
#[derive(Debug, Clone, PartialEq)]
pub struct Request<M> {
    /// To be given back with the reply.
    pub id: RequestId,
    /// What the client asks for.
    pub message: M,
}

/// Takes requests and sends replies, in any order and at any time: a request that is never replied to costs nothing.
///
/// Of requests that nobody takes, 16 of each client and 256 of all are kept, the latest.
pub struct ServiceServer<S> {
    requests: RawSubscription,
    replies: RawPublisher,
    held: Mutex<VecDeque<Held>>,
    /// Nanoseconds since the UNIX epoch.
    created: i64,
    node: Arc<Inner>,
    service: PhantomData<fn() -> S>,
}

/// A request whose client may not yet be reachable.
struct Held {
    id: RequestId,
    cdr: Vec<u8>,
    sample: Sample<()>,
    arrived: Instant,
}

impl<S: Service> ServiceServer<S> {
    pub(in crate::ros) fn new(node: &RosNode, service: &str) -> Result<Self, RosError> {
        let (request, reply) = (naming::dds_request(service), naming::dds_reply(service));
        let reply_type = S::Response::TYPE_NAME;
        Ok(Self {
            // The replies first: who sees where to send requests can expect an answer.
            replies: node.writer(service.into(), reply, reply_type, &SENT)?,
            requests: node.reader(service.into(), request, S::Request::TYPE_NAME, &TAKEN)?,
            held: Mutex::default(),
            created: wall::now(),
            node: Arc::clone(node.inner()),
            service: PhantomData,
        })
    }

    /// Takes the next request; `None` if there is none.
    ///
    /// # Errors
    /// A request that is not of the service's type, which its client waits for in vain. Later ones can be taken.
    pub fn take(&self) -> Result<Option<Request<S::Request>>, TakeError> {
        while let Some(sample) = self.requests.take()? {
            self.hold(sample)?;
        }
        self.next().transpose()
    }

    /// Waits for the next request, up to `timeout`; `None` if none came.
    ///
    /// # Errors
    /// As [`take`](Self::take).
    pub fn recv_timeout(
        &self,
        timeout: Duration,
    ) -> Result<Option<Request<S::Request>>, TakeError> {
        let deadline = Deadline::after(timeout);
        loop {
            if let Some(request) = self.take()? {
                return Ok(Some(request));
            }
            let left = deadline.left();
            if left.is_zero() {
                return Ok(None);
            }
            let limit = self.next_look().unwrap_or(left).min(left);
            if let Some(sample) = block_on_for(self.requests.recv(), limit).transpose()? {
                self.hold(sample)?;
            }
        }
    }

    /// Takes the next request, or has the task woken when one arrives; [`next_look`](Self::next_look) says when to look
    /// without being woken.
    pub(in crate::ros) fn poll_take(
        &self,
        context: &Context<'_>,
    ) -> Poll<Result<Request<S::Request>, TakeError>> {
        while let Poll::Ready(sample) = self.requests.poll_take(context) {
            self.hold(sample?)?;
        }
        self.next().map_or(Poll::Pending, Poll::Ready)
    }

    /// When to look for requests without having been woken, while some are held back.
    pub(in crate::ros) fn next_look(&self) -> Option<Duration> {
        (!self.held().is_empty()).then_some(CYCLE)
    }

    /// Replies to a request. Waits for no client, at most 20 ms for room.
    ///
    /// # Errors
    /// A reply that is not sent, for want of room or because the DDS stack has failed.
    pub fn reply(&self, id: RequestId, response: &S::Response) -> Result<(), PublishError> {
        self.reply_cdr(id, lgvi_msgs::cdr::encode(response)?)
    }

    /// Replies with ready CDR bytes.
    pub(in crate::ros) fn reply_cdr(
        &self,
        id: RequestId,
        cdr: Vec<u8>,
    ) -> Result<(), PublishError> {
        let (cdr, related) = wire::reply(self.node.service_mapping, cdr, id);
        self.replies.publish_related(cdr, related).map(drop)
    }

    /// The most bytes that a reply may have at present, encapsulation header included.
    pub(in crate::ros) fn max_reply(&self) -> usize {
        match self.node.service_mapping {
            ServiceMapping::FastDds => self.replies.max_related(),
            ServiceMapping::Cyclone => usize::MAX,
        }
    }

    /// The absolute name of the service.
    pub fn name(&self) -> &str {
        self.requests.topic()
    }

    fn hold(&self, sample: Sample<Vec<u8>>) -> Result<(), TakeError> {
        let info = sample.info;
        // Clients on RustDDS send their latest request to every server that comes.
        if info.source_time.is_some_and(|sent| {
            sent < self.created && info.received_time.saturating_sub(sent) > MAX_AGE
        }) {
            return Ok(());
        }
        let mapping = self.node.service_mapping;
        // One that is beside the payload is not the one in it.
        let beside = mapping == ServiceMapping::Cyclone && info.related.is_some();
        if beside || wire::differs(mapping, info.writer.0) {
            return Err(self.other_mapping(&info));
        }
        let Some((id, cdr)) = wire::taken_request(mapping, sample) else {
            return Err(self.other_mapping(&info));
        };
        let mut held = self.held();
        let is_own = |other: &Held| other.id.writer == id.writer;
        if held.iter().filter(|other| is_own(other)).count() >= MAX_HELD_OF_CLIENT
            && let Some(oldest) = held.iter().position(is_own)
        {
            held.remove(oldest);
        } else if held.len() >= MAX_HELD {
            held.pop_front();
        }
        held.push_back(Held {
            id,
            cdr,
            sample: Sample { message: (), info },
            arrived: Instant::now(),
        });
        Ok(())
    }

    fn other_mapping(&self, info: &SampleInfo) -> TakeError {
        TakeError::Mapping {
            service: self.name().into(),
            client: info.writer,
            ours: self.node.service_mapping.rmw(),
        }
    }

    fn next(&self) -> Option<Result<Request<S::Request>, TakeError>> {
        let mut held = self.held();
        let ready = held.iter().position(|request| {
            request.arrived.elapsed() >= PATIENCE || self.reaches(&request.id)
        })?;
        let request = held.remove(ready)?;
        drop(held);
        Some(
            lgvi_msgs::cdr::decode(&request.cdr)
                .map(|message| Request {
                    id: request.id,
                    message,
                })
                .map_err(|source| self.undecodable(&request.sample.info, source)),
        )
    }

    fn undecodable(&self, info: &SampleInfo, source: CdrError) -> TakeError {
        // Clients that put the identity beside the payload name their reader there.
        if self.node.service_mapping == ServiceMapping::FastDds && info.related.is_none() {
            return self.other_mapping(info);
        }
        TakeError::Decode {
            topic: self.name().into(),
            info: *info,
            source: Box::new(source),
        }
    }

    /// Whether the client's reader is known, without which a reply is lost.
    fn reaches(&self, id: &RequestId) -> bool {
        let (matches, replies) = (&self.node.matches, self.replies.guid());
        match id.reader() {
            Some(reader) => matches.has(replies, reader),
            None => {
                let writer = GUID::from_bytes(id.writer.0);
                matches.answers(replies, self.requests.guid(), writer)
            }
        }
    }

    fn held(&self) -> MutexGuard<'_, VecDeque<Held>> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<S> fmt::Debug for ServiceServer<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("ServiceServer")
            .field(&self.requests)
            .finish()
    }
}
