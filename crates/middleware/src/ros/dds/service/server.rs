//! The server's side of a service on DDS.

use std::{
    collections::VecDeque,
    sync::{Arc, Mutex},
    task::{Context, Poll, Waker},
    time::{Duration, Instant},
};

use lgvi_msgs::cdr::CdrError;
use rustdds::GUID;
use tokio::time::sleep;

use super::{SENT, TAKEN, mapping};
use crate::{
    ServiceMapping,
    ros::{
        PublishError, RequestId, RosError, Sample, SampleInfo, TakeError,
        dds::{naming, participant::Participant, publisher::Writer, subscription::Reader},
        service::enqueue,
        wire::{Incoming, ServiceTypes, WireServer, WireSubscription},
    },
    runtime::runtime,
    sync::lock,
    wall,
};

/// How long a request is held back for the client's reader that it names to be discovered. What discovery loses is told again
/// after seconds.
const DISCOVERY: Duration = Duration::from_secs(10);

/// The same where the request does not name its client's reader, so that it may be known all the same.
const PATIENCE: Duration = Duration::from_secs(1);

/// How old, in nanoseconds, a request from before the server may be.
const MAX_AGE: i64 = 1_000_000_000;

/// How often a request that is held back is looked at.
const CYCLE: Duration = Duration::from_millis(2);

/// A reader of requests and a writer of replies.
pub(in crate::ros::dds) struct Server {
    requests: Reader,
    replies: Writer,
    held: Mutex<VecDeque<Held>>,
    /// Who is about to look at them again.
    taker: Arc<Mutex<Option<Waker>>>,
    /// Nanoseconds since the UNIX epoch.
    created: i64,
}

/// A request whose client may not yet be reachable.
struct Held {
    incoming: Incoming,
    arrived: Instant,
}

impl Server {
    pub(in crate::ros::dds) fn new(
        node: &Arc<Participant>,
        service: &str,
        types: ServiceTypes,
    ) -> Result<Self, RosError> {
        let (request, reply) = (naming::dds_request(service), naming::dds_reply(service));
        // The replies first: who sees where to send requests can expect an answer.
        let replies = Writer::new(node, service, reply, types.response, &SENT)?;
        let requests = Reader::new(node, service, request, types.request, &TAKEN)?;
        node.serve(requests.guid());
        Ok(Self {
            replies,
            requests,
            held: Mutex::default(),
            taker: Arc::default(),
            created: wall::now(),
        })
    }

    fn node(&self) -> &Participant {
        self.replies.node()
    }

    fn hold(&self, sample: Sample<Vec<u8>>) -> Result<(), TakeError> {
        let info = sample.info;
        // Clients on RustDDS send their latest request to every server that comes.
        if info.source_time.is_some_and(|sent| {
            sent < self.created && info.received_time.saturating_sub(sent) > MAX_AGE
        }) {
            return Ok(());
        }
        let mapping = self.node().service_mapping;
        // One that is beside the payload is not the one in it.
        let beside = mapping == ServiceMapping::Cyclone && info.related.is_some();
        if beside || mapping::differs(mapping, info.writer.0) {
            return Err(self.other_mapping(&info));
        }
        let Some((id, cdr)) = mapping::taken_request(mapping, sample) else {
            return Err(self.other_mapping(&info));
        };
        let held = Held {
            incoming: Incoming { id, cdr, info },
            arrived: Instant::now(),
        };
        enqueue(&mut lock(&self.held), held, |other| other.incoming.id);
        Ok(())
    }

    fn other_mapping(&self, info: &SampleInfo) -> TakeError {
        TakeError::Mapping {
            service: self.service().into(),
            client: info.writer,
            ours: self.node().service_mapping.rmw(),
        }
    }

    fn next(&self) -> Option<Incoming> {
        let mut held = lock(&self.held);
        let ready = held.iter().position(|request| {
            let id = &request.incoming.id;
            request.arrived.elapsed() >= patience(id) || self.reaches(id)
        })?;
        held.remove(ready).map(|request| request.incoming)
    }

    /// Has a task look at what is held back after a while.
    fn look_again(&self, waker: Waker) {
        let is_due = lock(&self.taker).replace(waker).is_some();
        if !is_due && let Ok(runtime) = runtime() {
            let taker = Arc::clone(&self.taker);
            runtime.spawn(async move {
                sleep(CYCLE).await;
                let taker = lock(&taker).take();
                taker.map(Waker::wake)
            });
        }
    }

    /// Whether the client's reader is known, without which a reply is lost.
    fn reaches(&self, id: &RequestId) -> bool {
        let (matches, replies) = (&self.node().matches, self.replies.guid());
        match mapping::reader(id) {
            Some(reader) => matches.has(replies, reader),
            None => {
                let writer = GUID::from_bytes(id.writer.0);
                matches.answers(replies, self.requests.guid(), writer)
            }
        }
    }
}

/// How long a request of this client is held back.
fn patience(id: &RequestId) -> Duration {
    match mapping::reader(id) {
        Some(_) => DISCOVERY,
        None => PATIENCE,
    }
}

impl WireServer for Server {
    fn poll_take(&self, context: &Context<'_>) -> Poll<Result<Incoming, TakeError>> {
        while let Poll::Ready(sample) = self.requests.arrivals().poll_take(context) {
            self.hold(sample?)?;
        }
        if let Some(next) = self.next() {
            return Poll::Ready(Ok(next));
        }
        if !lock(&self.held).is_empty() {
            self.look_again(context.waker().clone());
        }
        Poll::Pending
    }

    fn undecodable(&self, info: SampleInfo, source: CdrError) -> TakeError {
        // Clients that put the identity beside the payload name their reader there.
        if self.node().service_mapping == ServiceMapping::FastDds && info.related.is_none() {
            return self.other_mapping(&info);
        }
        TakeError::Decode {
            topic: self.service().into(),
            info,
            source: Box::new(source),
        }
    }

    fn reply(&self, id: RequestId, cdr: Vec<u8>) -> Result<(), PublishError> {
        let (cdr, related) = mapping::reply(self.node().service_mapping, cdr, id);
        self.replies.publish_related(cdr, related).map(drop)
    }

    fn max_reply(&self) -> usize {
        match self.node().service_mapping {
            ServiceMapping::FastDds => self.replies.max_related(),
            ServiceMapping::Cyclone => usize::MAX,
        }
    }

    fn service(&self) -> &str {
        self.requests.endpoint().topic()
    }
}
