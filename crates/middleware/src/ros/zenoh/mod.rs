//! The wire of Zenoh, as `rmw_zenoh_cpp` speaks it: key expressions with type hashes, liveliness tokens, attachments.
//!
//! Source: the design document of ros2/rmw_zenoh, branch `jazzy`.
//!
//! # Assumptions and limitations
//! - As with `rmw_zenoh_cpp`, nodes find each other through a router, unless the configuration says otherwise.
//! - Samples of a reliable publisher are delivered or hold it up: Zenoh has no acknowledgments of the subscriptions, so
//!   that [`flush`](super::RawPublisher::flush) waits for none. A peer that does not read for 5 s is disconnected.
//! - Messages of a type that this build does not know have no type hash: a subscription takes any, a publisher reaches
//!   those that do the same.

mod attachment;
mod config;
mod graph;
mod keys;
mod ordered;
mod publisher;
mod service;
mod subscription;

use std::{
    fmt,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use ::zenoh::{Session, Wait, liveliness::LivelinessToken, qos::Reliability};
use sha2::{Digest, Sha256};

use super::{
    Namesake, Qos, RosError, TopicInfo, type_names,
    wire::{
        ServiceTypes, Wire, WireClient, WireEndpoint, WirePublisher, WireServer, WireSubscription,
    },
};
use crate::{Environment, NodeArgs, Shutdown, wall};
use graph::Graph;
use keys::{Endpoint, Kind, Offer};
use publisher::Publisher;
use service::{Client, Server};
use subscription::Subscription;

/// A node on Zenoh.
pub(super) struct Zenoh(Arc<Connection>);

/// A session and the node in it. Fields are dropped in this order.
struct Connection {
    _token: LivelinessToken,
    graph: Graph,
    node: keys::Node,
    endpoints: AtomicU64,
    session: Session,
}

/// An endpoint that is announced as long as it lives, and keeps its node. It is dropped after what it announces.
struct Announced {
    endpoint: Endpoint,
    gid: [u8; 16],
    _token: LivelinessToken,
    node: Arc<Connection>,
}

impl Zenoh {
    /// Opens a session and announces the node.
    pub(super) fn new(args: &NodeArgs, environment: &Environment) -> Result<Self, RosError> {
        let domain_id = environment.domain_id;
        Connection::open(args, environment)
            .map(|connection| Self(Arc::new(connection)))
            .map_err(|reason| RosError::Join { domain_id, reason })
    }

    fn make<E>(
        &self,
        endpoint: Endpoint,
        make: impl FnOnce(&Arc<Connection>, Endpoint) -> Result<E, String>,
    ) -> Result<Box<E>, RosError> {
        let (topic, type_name) = (endpoint.topic.clone(), endpoint.type_name.clone());
        make(&self.0, endpoint)
            .map(Box::new)
            .map_err(|reason| RosError::Endpoint {
                topic,
                type_name,
                reason,
            })
    }
}

impl Connection {
    fn open(args: &NodeArgs, environment: &Environment) -> Result<Self, String> {
        let session = ::zenoh::open(config::config(&environment.zenoh)?)
            .wait()
            .map_err(text)?;
        let node = keys::Node {
            domain_id: environment.domain_id,
            session: session.zid().to_string(),
            // Others print it, none reads it: here it says when the node was born.
            id: wall::now().unsigned_abs(),
            namespace: args.namespace().to_owned(),
            name: args.name().to_owned(),
        };
        let graph = Graph::listen(&session, &node)?;
        let token = session.liveliness().declare_token(node.token());
        Ok(Self {
            _token: token.wait().map_err(text)?,
            graph,
            node,
            endpoints: AtomicU64::new(1),
            session,
        })
    }

    /// Describes an endpoint on a topic.
    fn endpoint(
        &self,
        kind: Kind,
        topic: String,
        type_name: &str,
        qos: &Qos,
    ) -> Result<Endpoint, RosError> {
        Ok(Endpoint {
            kind,
            topic,
            type_name: type_names::dds_type(type_name)?,
            hash: lgvi_msgs::lookup(type_name).map(|known| known.hash.to_owned()),
            offer: Offer {
                reliable: qos.reliable,
                durable: match kind {
                    Kind::Publisher => qos.reliable && !qos.volatile,
                    _ => qos.latched,
                },
                depth: qos.depth(),
            },
        })
    }

    /// Describes an endpoint of a service.
    fn service(
        &self,
        kind: Kind,
        service: &str,
        types: ServiceTypes,
    ) -> Result<Endpoint, RosError> {
        Ok(Endpoint {
            kind,
            topic: service.to_owned(),
            type_name: type_names::dds_type(types.service)?,
            hash: Some(types.hash.to_owned()),
            offer: Offer {
                reliable: true,
                durable: false,
                depth: 10,
            },
        })
    }
}

impl Announced {
    /// Announces an endpoint, which must be there before others know of it.
    fn new(node: &Arc<Connection>, endpoint: Endpoint) -> Result<Self, String> {
        let id = node.endpoints.fetch_add(1, Ordering::Relaxed);
        let token = endpoint.token(&node.node, id);
        let gid = gid(&token);
        let declared = node.session.liveliness().declare_token(token);
        let declared = declared.wait().map_err(text)?;
        node.graph.watch(&endpoint);
        Ok(Self {
            endpoint,
            gid,
            _token: declared,
            node: Arc::clone(node),
        })
    }
}

impl WireEndpoint for Announced {
    fn matched(&self) -> usize {
        self.node.graph.matched(&self.endpoint)
    }

    fn wait_for_matches(&self, count: usize, timeout: Duration) -> bool {
        self.node.graph.wait(&self.endpoint, count, timeout)
    }

    fn incompatible(&self) -> usize {
        self.node.graph.incompatible(&self.endpoint)
    }

    fn topic(&self) -> &str {
        &self.endpoint.topic
    }
}

impl Drop for Announced {
    fn drop(&mut self) {
        self.node.graph.forget(&self.endpoint);
    }
}

impl Wire for Zenoh {
    fn publisher(
        &self,
        topic: String,
        type_name: &str,
        qos: &Qos,
    ) -> Result<Box<dyn WirePublisher>, RosError> {
        let endpoint = self.0.endpoint(Kind::Publisher, topic, type_name, qos)?;
        Ok(self.make(endpoint, Publisher::new)?)
    }

    fn subscription(
        &self,
        topic: String,
        type_name: &str,
        qos: &Qos,
    ) -> Result<Box<dyn WireSubscription>, RosError> {
        let endpoint = self.0.endpoint(Kind::Subscription, topic, type_name, qos)?;
        Ok(self.make(endpoint, Subscription::new)?)
    }

    fn server(&self, service: &str, types: ServiceTypes) -> Result<Box<dyn WireServer>, RosError> {
        let endpoint = self.0.service(Kind::Server, service, types)?;
        Ok(self.make(endpoint, Server::new)?)
    }

    fn client(&self, service: &str, types: ServiceTypes) -> Result<Box<dyn WireClient>, RosError> {
        let endpoint = self.0.service(Kind::Client, service, types)?;
        Ok(self.make(endpoint, Client::new)?)
    }

    fn topics(&self) -> Vec<TopicInfo> {
        self.0.graph.topics()
    }

    fn other_nodes(&self) -> Vec<String> {
        self.0.graph.nodes()
    }

    fn namesakes(&self) -> Vec<Namesake> {
        self.0.graph.namesakes(&self.0.node)
    }

    /// Tokens are announced one by one, each once.
    fn hold_announcements(&self, _: bool) {}

    /// No endpoint waits for another.
    fn leave_on(&self, _: &Shutdown) {}
}

impl Drop for Connection {
    /// Sends what is queued, and tells the others.
    fn drop(&mut self) {
        if let Err(error) = self.session.close().wait() {
            tracing::debug!(%error, "the Zenoh session does not close in order");
        }
    }
}

fn reliability(offer: Offer) -> Reliability {
    if offer.reliable {
        Reliability::Reliable
    } else {
        Reliability::BestEffort
    }
}

/// The identity of an endpoint: as good as its token's.
fn gid(token: &str) -> [u8; 16] {
    let digest = Sha256::digest(token);
    let mut gid = [0; 16];
    gid.copy_from_slice(&digest[..16]);
    gid
}

fn text(error: impl fmt::Display) -> String {
    error.to_string()
}
