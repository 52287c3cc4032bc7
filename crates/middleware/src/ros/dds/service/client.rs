//! The client's side of a service on DDS.

use std::{
    collections::BTreeSet,
    future::poll_fn,
    sync::{Arc, Mutex},
    time::Duration,
};

use rustdds::GUID;
use tracing::debug;

use super::{SENT, TAKEN, mapping};
use crate::{
    ServiceMapping,
    block::{Deadline, block_on_for},
    ros::{
        CallError, PublishError, RequestId, RosError, Sample, TakeError, WriterId,
        dds::{naming, participant::Participant, publisher::Writer, subscription::Reader},
        wire::{ServiceTypes, WireClient, WirePublisher, WireSubscription},
    },
    sync::lock,
};

/// How often a client that waits for a reply looks whether the server is still there.
const CYCLE: Duration = Duration::from_millis(100);

/// A writer of requests and a reader of replies.
pub(in crate::ros::dds) struct Client {
    requests: Writer,
    replies: Reader,
    /// The number of the latest request, held during a call.
    turn: Mutex<i64>,
}

impl Client {
    pub(in crate::ros::dds) fn new(
        node: &Arc<Participant>,
        service: &str,
        types: ServiceTypes,
    ) -> Result<Self, RosError> {
        let (request, reply) = (naming::dds_request(service), naming::dds_reply(service));
        Ok(Self {
            replies: Reader::new(node, service, reply, types.response, &TAKEN)?,
            requests: Writer::new(node, service, request, types.request, &SENT)?,
            turn: Mutex::new(0),
        })
    }

    fn next_reply(&self, limit: Duration) -> Result<Option<Sample<Vec<u8>>>, TakeError> {
        let arrivals = self.replies.arrivals();
        block_on_for(poll_fn(|context| arrivals.poll_take(context)), limit).transpose()
    }

    fn send(&self, cdr: Vec<u8>, number: i64) -> Result<RequestId, PublishError> {
        let (writer, reader) = (self.requests.guid(), self.replies.guid());
        let mapping = self.requests.node().service_mapping;
        let mut id = RequestId {
            writer: WriterId(writer.to_bytes()),
            client: mapping::cyclone_client(writer),
            sequence: number,
        };
        let (cdr, related) = mapping::request(mapping, cdr, id, reader);
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
        self.requests.node().matches.paired(requests, replies)
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
            if let Some(sample) = self.next_reply(limit)? {
                if let Some((found, cdr)) = mapping::taken_reply(self.requests.node().service_mapping, sample)
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

impl WireClient for Client {
    fn wait_for_server(&self, timeout: Duration) -> bool {
        let (requests, replies) = (self.requests.guid(), self.replies.guid());
        self.requests
            .node()
            .matches
            .wait_for_pair(requests, replies, timeout)
    }

    fn call(&self, cdr: Vec<u8>, timeout: Duration) -> Result<Vec<u8>, CallError> {
        let mut number = lock(&self.turn);
        let deadline = Deadline::after(timeout);
        let mut first = None;
        while self.wait_for_server(deadline.left()) {
            while self.replies.arrivals().take().is_some() {}
            *number += 1;
            let asked = self.servers();
            let id = self.send(cdr.clone(), *number)?;
            let first = *first.get_or_insert(id.sequence);
            if let Some(reply) = self.reply_to(id, first, &asked, deadline)? {
                return Ok(reply);
            }
            if deadline.left().is_zero() {
                break;
            }
            debug!(
                service = self.service(),
                "the server has left: asking the next one"
            );
        }
        let (service, waited) = (self.service().to_owned(), timeout);
        let mapping = self.requests.node().service_mapping;
        let servers = self.servers();
        let other = |server: &GUID| mapping::differs(mapping, server.to_bytes());
        Err(if !servers.is_empty() && servers.iter().all(other) {
            let ours = mapping.rmw();
            CallError::Mapping { service, ours }
        } else if first.is_some() {
            CallError::NoReply { service, waited }
        } else {
            CallError::NoServer { service, waited }
        })
    }

    fn service(&self) -> &str {
        self.requests.endpoint().topic()
    }
}
