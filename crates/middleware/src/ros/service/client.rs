//! The client's side of a service.

use std::{marker::PhantomData, time::Duration};

use lgvi_msgs::{Service, cdr::CdrError};

use crate::ros::{
    PublishError, RosError, RosNode, TakeError,
    wire::{ServiceTypes, WireClient},
};

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
    wire: Box<dyn WireClient>,
    service: PhantomData<fn() -> S>,
}

impl<S: Service> ServiceClient<S> {
    pub(in crate::ros) fn new(node: &RosNode, service: &str) -> Result<Self, RosError> {
        Ok(Self {
            wire: node.wire().client(service, ServiceTypes::of::<S>())?,
            service: PhantomData,
        })
    }

    /// Blocks until a server is found or the time has passed; returns whether there is one.
    pub fn wait_for_server(&self, timeout: Duration) -> bool {
        self.wire.wait_for_server(timeout)
    }

    /// Sends a request and waits for the reply. `timeout` includes the discovery of the server, but not the wait for
    /// calls of other threads.
    ///
    /// If the server leaves before it has replied, the request is sent again to the next one.
    ///
    /// # Errors
    /// No server or no reply in time, or a failure of the wire.
    pub fn call(&self, request: &S::Request, timeout: Duration) -> Result<S::Response, CallError> {
        let request = lgvi_msgs::cdr::encode(request)?;
        let response = self.wire.call(request, timeout)?;
        Ok(lgvi_msgs::cdr::decode(&response)?)
    }
}
