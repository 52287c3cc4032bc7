//! A ROS node and the making of its endpoints.

use std::{fmt, sync::Arc};

use lgvi_msgs::{Action, RosMessage, Service};

#[cfg(feature = "zenoh")]
use super::zenoh::Zenoh;
use super::{
    RosError,
    action::{ActionClient, ActionServer, Decision},
    dds::Dds,
    namesakes::Namesake,
    publisher::{Publisher, RawPublisher},
    qos::Qos,
    service::{ServiceClient, ServiceServer},
    subscription::{RawSubscription, Subscription},
    topics::TopicInfo,
    wire::Wire,
};
#[cfg(not(feature = "zenoh"))]
use crate::EnvironmentError;
#[cfg(feature = "zenoh")]
use crate::SecurityStrategy;
use crate::{Environment, NameError, NodeArgs, Rmw, Shutdown};

/// A node of the ROS graph. Clones are handles to the same node; it leaves the graph when the last of them and the last
/// of its endpoints are dropped.
#[derive(Clone)]
pub struct RosNode(Arc<Inner>);

struct Inner {
    args: NodeArgs,
    wire: Box<dyn Wire>,
}

impl RosNode {
    /// Joins the domain and announces the node. Discovery of others takes 0.1 s to 1.2 s from here.
    pub fn new(args: &NodeArgs, environment: &Environment) -> Result<Self, RosError> {
        let wire: Box<dyn Wire> = match environment.rmw {
            Rmw::Dds(mapping) => Box::new(Dds::new(args, environment, mapping)?),
            #[cfg(feature = "zenoh")]
            Rmw::Zenoh if environment.security.strategy == Some(SecurityStrategy::Enforce) => {
                return Err(RosError::Join {
                    domain_id: environment.domain_id,
                    reason: "ROS_SECURITY_ENABLE is true, which is DDS security: with rmw_zenoh_cpp set it to false, and \
                             secure the session by ZENOH_SESSION_CONFIG_URI"
                        .into(),
                });
            }
            #[cfg(feature = "zenoh")]
            Rmw::Zenoh => Box::new(Zenoh::new(args, environment)?),
            #[cfg(not(feature = "zenoh"))]
            Rmw::Zenoh => {
                return Err(RosError::Join {
                    domain_id: environment.domain_id,
                    reason: EnvironmentError::NoZenoh.to_string(),
                });
            }
        };
        let args = args.clone();
        Ok(Self(Arc::new(Inner { args, wire })))
    }

    /// Creates a publisher; the topic is expanded and remapped.
    pub fn publisher<M: RosMessage>(
        &self,
        topic: &str,
        qos: &Qos,
    ) -> Result<Publisher<M>, RosError> {
        self.raw_publisher(topic, M::TYPE_NAME, qos)
            .map(Publisher::new)
    }

    /// Creates a subscription; the topic is expanded and remapped.
    pub fn subscription<M: RosMessage>(
        &self,
        topic: &str,
        qos: &Qos,
    ) -> Result<Subscription<M>, RosError> {
        self.raw_subscription(topic, M::TYPE_NAME, qos)
            .map(Subscription::new)
    }

    /// Creates a publisher of ready CDR bytes of the type `package/msg/Type`.
    pub fn raw_publisher(
        &self,
        topic: &str,
        type_name: &str,
        qos: &Qos,
    ) -> Result<RawPublisher, RosError> {
        let topic = self.resolve(topic)?;
        let publisher = self.0.wire.publisher(topic, type_name, qos)?;
        Ok(RawPublisher::new(publisher))
    }

    /// Creates a subscription to the CDR bytes of a topic of the type `package/msg/Type`.
    pub fn raw_subscription(
        &self,
        topic: &str,
        type_name: &str,
        qos: &Qos,
    ) -> Result<RawSubscription, RosError> {
        let topic = self.resolve(topic)?;
        let subscription = self.0.wire.subscription(topic, type_name, qos)?;
        Ok(RawSubscription::new(subscription))
    }

    /// Offers a service; the name is expanded and remapped.
    pub fn service_server<S: Service>(&self, service: &str) -> Result<ServiceServer<S>, RosError> {
        ServiceServer::new(self, &self.0.args.resolve_service(service)?)
    }

    /// Makes a client of a service; the name is expanded and remapped.
    pub fn service_client<S: Service>(&self, service: &str) -> Result<ServiceClient<S>, RosError> {
        ServiceClient::new(self, &self.0.args.resolve_service(service)?)
    }

    /// Offers an action; the name is expanded and remapped. `decide` gets each goal, and how many are active, on the
    /// server's own thread; what it does holds up the protocol.
    pub fn action_server<A: Action>(
        &self,
        action: &str,
        decide: impl FnMut(&A::Goal, usize) -> Decision + Send + 'static,
    ) -> Result<ActionServer<A>, RosError> {
        ActionServer::new(self, &self.0.args.resolve_action(action)?, decide)
    }

    /// Makes a client of an action; the name is expanded and remapped.
    pub fn action_client<A: Action>(&self, action: &str) -> Result<ActionClient<A>, RosError> {
        ActionClient::new(self, &self.0.args.resolve_action(action)?)
    }

    /// The topics of other participants that have been discovered so far, ordered by name and type.
    pub fn topics(&self) -> Vec<TopicInfo> {
        self.0.wire.topics()
    }

    /// The fully qualified names of the nodes that other participants have announced so far, sorted; a name that two
    /// nodes have is there twice.
    pub fn other_nodes(&self) -> Vec<String> {
        self.0.wire.other_nodes()
    }

    /// The nodes of other participants that have this one's name, as discovered so far.
    pub fn namesakes(&self) -> Vec<Namesake> {
        self.0.wire.namesakes()
    }

    /// Has `change` make or drop many endpoints, which other nodes are told of at once: an announcement names all
    /// endpoints of the node.
    pub fn announce_together<T>(&self, change: impl FnOnce() -> T) -> T {
        self.0.wire.hold_announcements(true);
        let changed = change();
        self.0.wire.hold_announcements(false);
        changed
    }

    /// Has the node take its leave quickly once `shutdown` is raised: from then on, all waits for subscriptions that do
    /// not keep up, those of a lossless publisher that are under way among them, take 0.3 s together, and the node's name
    /// is taken back with the first of its endpoints.
    pub fn leave_on(&self, shutdown: &Shutdown) {
        self.0.wire.leave_on(shutdown);
    }

    /// The absolute name of a topic, expanded and remapped.
    pub fn resolve(&self, topic: &str) -> Result<String, NameError> {
        self.0.args.resolve(topic)
    }

    /// Namespace and name of the node.
    pub fn fully_qualified_name(&self) -> String {
        self.0.args.fully_qualified_name()
    }

    pub(super) fn wire(&self) -> &dyn Wire {
        self.0.wire.as_ref()
    }
}

impl fmt::Debug for RosNode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("RosNode")
            .field(&self.fully_qualified_name())
            .finish()
    }
}
