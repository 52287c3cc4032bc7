//! The server's side of a service.

use std::{
    future::poll_fn,
    marker::PhantomData,
    task::{Context, Poll},
    time::Duration,
};

use lgvi_msgs::Service;

use super::RequestId;
use crate::{
    block::block_on_for,
    ros::{
        PublishError, RosError, RosNode, TakeError,
        wire::{Incoming, ServiceTypes, WireServer},
    },
};

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
    wire: Box<dyn WireServer>,
    service: PhantomData<fn() -> S>,
}

impl<S: Service> ServiceServer<S> {
    pub(in crate::ros) fn new(node: &RosNode, service: &str) -> Result<Self, RosError> {
        Ok(Self {
            wire: node.wire().server(service, ServiceTypes::of::<S>())?,
            service: PhantomData,
        })
    }

    /// Waits for the next request, up to `timeout`; `None` if none came.
    ///
    /// # Errors
    /// A request that is not of the service's type, which its client waits for in vain. Later ones can be taken.
    pub fn recv_timeout(
        &self,
        timeout: Duration,
    ) -> Result<Option<Request<S::Request>>, TakeError> {
        block_on_for(self.recv(), timeout).transpose()
    }

    /// Waits for the next request; safe to cancel.
    ///
    /// # Errors
    /// As [`recv_timeout`](Self::recv_timeout).
    pub async fn recv(&self) -> Result<Request<S::Request>, TakeError> {
        poll_fn(|context| self.poll_take(context)).await
    }

    /// Takes the next request, or has the task woken when one may be taken.
    pub(in crate::ros) fn poll_take(
        &self,
        context: &Context<'_>,
    ) -> Poll<Result<Request<S::Request>, TakeError>> {
        self.wire
            .poll_take(context)
            .map(|incoming| self.decode(incoming?))
    }

    /// Replies to a request. Waits for no client, at most 20 ms for room.
    ///
    /// # Errors
    /// A reply that is not sent, for want of room or because the wire has failed.
    pub fn reply(&self, id: RequestId, response: &S::Response) -> Result<(), PublishError> {
        self.reply_cdr(id, lgvi_msgs::cdr::encode(response)?)
    }

    /// Replies with ready CDR bytes.
    pub(in crate::ros) fn reply_cdr(
        &self,
        id: RequestId,
        cdr: Vec<u8>,
    ) -> Result<(), PublishError> {
        self.wire.reply(id, cdr)
    }

    /// The most bytes that a reply may have at present, encapsulation header included.
    pub(in crate::ros) fn max_reply(&self) -> usize {
        self.wire.max_reply()
    }

    fn decode(&self, incoming: Incoming) -> Result<Request<S::Request>, TakeError> {
        let Incoming { id, cdr, info } = incoming;
        lgvi_msgs::cdr::decode(&cdr)
            .map(|message| Request { id, message })
            .map_err(|source| self.wire.undecodable(info, source))
    }
}
