//! A ROS node: one DDS participant and its endpoints.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt,
    net::{IpAddr, Ipv4Addr, SocketAddr},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread,
    time::{Duration, Instant},
};

use lgvi_msgs::{Action, RosMessage, Service};
use ros2_client::NodeName;
use rustdds::policy::{Durability, Reliability};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, GUID, QosPolicies, RTPSEntity, Topic,
    TopicDescription, TopicKind, dds::result::CreateResult,
};
use tracing::warn;

use super::{
    RosError,
    action::{ActionClient, ActionServer, Decision},
    background::{Background, Keeps},
    farewell::Farewell,
    faults::Faults,
    fence::{Fence, MakeError},
    graph::{Graph, Side},
    inbox::{Inbox, nanoseconds},
    laggards::{Laggards, RemoteReader},
    matches::Matches,
    names::Names,
    namesakes::{self, Namesake},
    naming,
    peers::{self, StaticPeers},
    publisher::{Publisher, RawPublisher},
    qos::Qos,
    rtps, security,
    service::{ServiceClient, ServiceServer},
    subscription::{RawSubscription, Subscription},
};
use crate::{Environment, NameError, NodeArgs, Reach, ServiceMapping, Shutdown, security::Enclave};

/// When RustDDS first announces a participant, and how soon it answers one that it discovers, with a margin.
const FIRST_ANNOUNCEMENT: Duration = Duration::from_millis(100 + 20);
const ANSWER: Duration = Duration::from_millis(10 + 20);

/// Announcements of other participants that may wait for the background thread.
const MAX_ANNOUNCEMENTS: usize = 1024;

/// A node of the ROS graph. Clones are handles to the same node; it leaves the graph when the last of them and the last
/// of its endpoints are dropped.
#[derive(Clone)]
pub struct RosNode(Arc<Inner>);

/// What a node and its endpoints share. Fields are dropped in this order: the participant goes last.
pub(super) struct Inner {
    args: NodeArgs,
    pub(super) service_mapping: ServiceMapping,
    graph: Mutex<Graph>,
    pub(super) background: Background,
    pub(super) matches: Arc<Matches>,
    pub(super) laggards: Arc<Laggards>,
    pub(super) faults: Arc<Faults>,
    names: Arc<Names>,
    fence: Arc<Fence>,
    pub(super) farewell: Farewell,
    publisher: rustdds::Publisher,
    subscriber: rustdds::Subscriber,
    created: Instant,
    _static_peers: Option<StaticPeers>,
    participant: DomainParticipant,
}

/// A topic of which other participants have announced endpoints.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TopicInfo {
    /// The absolute name.
    pub name: String,
    /// `package/msg/Type`.
    pub type_name: String,
    /// Publishers of other participants.
    pub publishers: usize,
    /// Whether all of them are reliable.
    pub reliable: bool,
    /// Whether all of them keep samples for late joiners.
    pub durable: bool,
    /// Subscriptions of other participants.
    pub subscriptions: usize,
}

/// What has been announced of one topic.
#[derive(Default)]
struct Announced {
    publishers: usize,
    unreliable: bool,
    volatile: bool,
    subscriptions: usize,
}

impl RosNode {
    /// Joins the domain and announces the node. Discovery of others takes 0.1 s to 1.2 s from here.
    pub fn new(args: &NodeArgs, environment: &Environment) -> Result<Self, RosError> {
        let enclave = security::enclave(args, environment)?;
        Inner::new(args, environment, enclave.as_ref())
            .map(|inner| Self(Arc::new(inner)))
            .map_err(|reason| RosError::Join {
                domain_id: environment.domain_id,
                reason,
            })
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
        let dds_topic = naming::dds_topic(&topic);
        self.writer(topic, dds_topic, type_name, qos)
    }

    /// Creates a subscription to the CDR bytes of a topic of the type `package/msg/Type`.
    pub fn raw_subscription(
        &self,
        topic: &str,
        type_name: &str,
        qos: &Qos,
    ) -> Result<RawSubscription, RosError> {
        let topic = self.resolve(topic)?;
        let dds_topic = naming::dds_topic(&topic);
        self.reader(topic, dds_topic, type_name, qos)
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
        let participant = &self.0.participant;
        let mut topics = BTreeMap::<_, Announced>::new();
        for writer in participant.discovered_writers() {
            let data = writer.publication_topic_data;
            let topic = topics.entry((data.topic_name, data.type_name)).or_default();
            topic.publishers += 1;
            topic.unreliable |= !matches!(data.reliability, Some(Reliability::Reliable { .. }));
            topic.volatile |= matches!(data.durability, None | Some(Durability::Volatile));
        }
        for reader in participant.discovered_readers() {
            let data = reader.subscription_topic_data;
            let key = (data.topic_name().clone(), data.type_name().clone());
            topics.entry(key).or_default().subscriptions += 1;
        }
        topics
            .into_iter()
            .filter_map(|((topic, dds_type), announced)| {
                Some(TopicInfo {
                    name: naming::ros_topic(&topic)?.into(),
                    type_name: naming::ros_type(&dds_type)?,
                    publishers: announced.publishers,
                    reliable: !announced.unreliable,
                    durable: !announced.volatile,
                    subscriptions: announced.subscriptions,
                })
            })
            .collect()
    }

    /// The fully qualified names of the nodes that other participants have announced so far, sorted; a name that two
    /// nodes have is there twice.
    pub fn other_nodes(&self) -> Vec<String> {
        self.0.names.all()
    }

    /// The nodes of other participants that have this one's name, as discovered so far.
    pub fn namesakes(&self) -> Vec<Namesake> {
        let inner = &self.0;
        let born = nanoseconds(inner.graph().born()).unwrap_or_default();
        let own = (born, inner.participant.guid().to_bytes());
        let others = inner.names.namesakes(&self.fully_qualified_name());
        let namesakes = others.into_iter().map(|other| {
            let participant = GUID::from_bytes(other.1);
            Namesake {
                participant: namesakes::identity(participant),
                addresses: inner.addresses(participant),
                elder: namesakes::is_elder(own, inner.created.elapsed(), other),
            }
        });
        namesakes.collect()
    }

    /// Has `change` make or drop many endpoints, which other nodes are told of at once: an announcement names all
    /// endpoints of the node.
    pub fn announce_together<T>(&self, change: impl FnOnce() -> T) -> T {
        self.0.graph().hold(true);
        let changed = change();
        self.0.graph().hold(false);
        changed
    }

    /// Has the node take its leave quickly once `shutdown` is raised: from then on, all waits for subscriptions that do
    /// not keep up, those of a lossless publisher that are under way among them, take 0.3 s together, and the node's name
    /// is taken back with the first of its endpoints.
    pub fn leave_on(&self, shutdown: &Shutdown) {
        self.0.farewell.on(shutdown);
    }

    /// The absolute name of a topic, expanded and remapped.
    pub fn resolve(&self, topic: &str) -> Result<String, NameError> {
        self.0.args.resolve(topic)
    }

    /// Namespace and name of the node.
    pub fn fully_qualified_name(&self) -> String {
        self.0.args.fully_qualified_name()
    }

    pub(super) fn inner(&self) -> &Arc<Inner> {
        &self.0
    }

    /// Creates a publisher on a DDS topic; `topic` is what it is called in ROS.
    pub(super) fn writer(
        &self,
        topic: String,
        dds_topic: String,
        type_name: &str,
        qos: &Qos,
    ) -> Result<RawPublisher, RosError> {
        self.endpoint(topic, dds_topic, type_name, |topic| {
            let publisher = &self.0.publisher;
            publisher.create_datawriter_no_key(topic, Some(qos.offered()))
        })
        .map(|(topic, writer)| {
            self.note(writer.guid(), Side::Publisher, &topic, type_name);
            RawPublisher::new(Arc::clone(&self.0), topic, writer, qos)
        })
    }

    /// Creates a subscription to a DDS topic; `topic` is what it is called in ROS.
    pub(super) fn reader(
        &self,
        topic: String,
        dds_topic: String,
        type_name: &str,
        qos: &Qos,
    ) -> Result<RawSubscription, RosError> {
        self.endpoint(topic, dds_topic, type_name, |topic| {
            let subscriber = &self.0.subscriber;
            subscriber.create_simple_datareader_no_key(topic, Some(qos.requested()))
        })
        .map(|(topic, reader)| {
            self.note(reader.guid(), Side::Subscription, &topic, type_name);
            RawSubscription::new(Arc::clone(&self.0), Inbox::new(reader, topic, qos.depth()))
        })
    }

    /// Has faults of an endpoint reported.
    fn note(&self, guid: GUID, side: Side, topic: &str, type_name: &str) {
        if let Ok(dds_type) = naming::dds_type(type_name) {
            self.0.faults.add(guid, side, topic, &dds_type);
        }
    }

    fn endpoint<E>(
        &self,
        topic: String,
        dds_topic: String,
        type_name: &str,
        create: impl FnOnce(&Topic) -> CreateResult<E>,
    ) -> Result<(String, E), RosError> {
        let dds_type = naming::dds_type(type_name)?;
        let none = QosPolicies::qos_none();
        let participant = &self.0.participant;
        participant
            .create_topic(dds_topic, dds_type, &none, TopicKind::NoKey)
            .map_err(MakeError::from)
            .and_then(|topic| self.0.fence.make(|| create(&topic)))
            .map(|endpoint| (topic.clone(), endpoint))
            .map_err(|error| RosError::Endpoint {
                topic,
                type_name: type_name.into(),
                reason: error.to_string(),
            })
    }
}

impl fmt::Debug for RosNode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("RosNode")
            .field(&self.fully_qualified_name())
            .finish()
    }
}

impl Inner {
    fn new(
        args: &NodeArgs,
        environment: &Environment,
        enclave: Option<&Enclave>,
    ) -> Result<Self, String> {
        for variable in &environment.overridden {
            warn!("{variable} is overridden by ROS_LOCALHOST_ONLY=1");
        }
        let builder = DomainParticipantBuilder::new(environment.domain_id);
        let addresses = peers::addresses(&environment.static_peers)?;
        let builder = match environment.reach {
            Reach::Localhost => builder.with_only_networks(networks(&addresses)),
            Reach::Subnet => builder,
        };
        let participant = security::join(builder, enclave)?;
        let static_peers = match addresses.as_slice() {
            [] => None,
            addresses => Some(StaticPeers::start(&participant, addresses).map_err(text)?),
        };
        let none = QosPolicies::qos_none();
        let publisher = participant.create_publisher(&none).map_err(text)?;
        let subscriber = participant.create_subscriber(&none).map_err(text)?;
        let name = NodeName::new(args.namespace(), args.name()).map_err(text)?;
        let matches = Arc::new(Matches::default());
        let loopback_only = environment.reach == Reach::Localhost;
        let laggards = Laggards::new(&participant, loopback_only).map_err(text)?;
        let laggards = Arc::new(laggards.secured(enclave.is_some()));
        let names = Arc::new(Names::new(participant.guid()));
        let faults = Arc::new(Faults::default());
        let fence = Arc::new(Fence::new(participant.guid(), Arc::clone(&laggards)));
        let keeps = Keeps {
            matches: Arc::clone(&matches),
            laggards: Arc::clone(&laggards),
            names: Arc::clone(&names),
            faults: Arc::clone(&faults),
            fence: Arc::clone(&fence),
        };
        let background = Background::start(&participant, keeps).map_err(text)?;
        // RustDDS has begun with its own endpoints.
        fence.settle().map_err(text)?;
        let (graph, announcements) =
            Graph::new(&participant, &publisher, name, &fence).map_err(text)?;
        let qos = Some(Qos::latched(1).requested());
        let others = fence
            .make(|| subscriber.create_simple_datareader_no_key(&announcements, qos))
            .map_err(text)?;
        let others = Inbox::new(others, announcements.name(), MAX_ANNOUNCEMENTS);
        names.listen(Arc::clone(&others));
        background.add(others);
        Ok(Self {
            args: args.clone(),
            service_mapping: environment.service_mapping,
            background,
            matches,
            laggards,
            faults,
            names,
            fence,
            farewell: Farewell::default(),
            graph: Mutex::new(graph),
            publisher,
            subscriber,
            created: Instant::now(),
            _static_peers: static_peers,
            participant,
        })
    }

    /// Announces an endpoint.
    pub(super) fn add(&self, side: Side, endpoint: GUID) {
        self.graph().add(side, endpoint);
    }

    /// Takes back the announcement of an endpoint.
    pub(super) fn remove(&self, side: Side, endpoint: GUID) {
        if self.farewell.begun() {
            // One announcement for all.
            self.graph().leave();
        }
        self.graph().remove(side, endpoint);
        self.matches.forget(endpoint);
        self.faults.remove(endpoint);
    }

    /// Whether a writer's matched readers say of themselves that they are on the loopback interface, and nowhere else.
    pub(super) fn reaches_loopback_only(&self, writer: GUID) -> bool {
        let mut matched = self.matches.of(writer);
        for reader in self.participant.discovered_readers() {
            let locators = &reader.reader_proxy.unicast_locator_list;
            let loopback = locators
                .iter()
                .all(|locator| SocketAddr::from(*locator).ip().is_loopback());
            if loopback && !locators.is_empty() {
                matched.remove(&reader.reader_proxy.remote_reader_guid);
            }
        }
        matched.is_empty()
    }

    /// The reliable readers that a writer is matched with.
    pub(super) fn reliable_readers(&self, writer: GUID) -> Vec<RemoteReader> {
        let matched = self.matches.of(writer);
        let mut readers = self.participant.discovered_readers();
        readers.retain(|reader| {
            matched.contains(&reader.reader_proxy.remote_reader_guid)
                && reader.subscription_topic_data.qos().is_reliable()
        });
        readers
            .into_iter()
            .map(|reader| RemoteReader {
                guid: reader.reader_proxy.remote_reader_guid,
                locators: reader
                    .reader_proxy
                    .unicast_locator_list
                    .into_iter()
                    .map(SocketAddr::from)
                    .collect(),
            })
            .collect()
    }

    /// Tells the other participants that this one leaves, in the way that Fast DDS understands too: it would list the
    /// endpoints until the lease has run out, 50 s later.
    fn depart(&self) {
        let domain_id = self.participant.domain_id();
        let readers = self.participant.discovered_readers();
        let addresses: BTreeSet<_> = readers
            .iter()
            .flat_map(|reader| &reader.reader_proxy.unicast_locator_list)
            .filter_map(|locator| peers::discovery_address(domain_id, SocketAddr::from(*locator)))
            .collect();
        let departure = rtps::departure(self.participant.guid());
        self.laggards.send(&departure, addresses);
    }

    /// Where a remote participant's subscriptions are reached.
    fn addresses(&self, participant: GUID) -> Vec<IpAddr> {
        let readers = self.participant.discovered_readers();
        let own = readers.iter().map(|reader| &reader.reader_proxy);
        let own = own.filter(|proxy| proxy.remote_reader_guid.prefix == participant.prefix);
        let addresses: BTreeSet<_> = own
            .flat_map(|proxy| &proxy.unicast_locator_list)
            .map(|locator| SocketAddr::from(*locator).ip())
            .filter(|address| !address.is_unspecified())
            .collect();
        addresses.into_iter().collect()
    }

    /// What a remote endpoint is called: its node, or its identity.
    pub(super) fn describe(&self, remote: GUID) -> String {
        let name = self.names.node_of(remote);
        name.unwrap_or_else(|| format!("{remote:?}"))
    }

    fn graph(&self) -> MutexGuard<'_, Graph> {
        self.graph.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// RustDDS 0.15 holds the participant while it announces it. Were the last of our handles dropped then, RustDDS would
/// drop the participant on its own thread, which cannot wait for its own end: it panics, and the node does not say
/// goodbye. The announcements that can be foreseen are waited for; one in ten seconds, of a millisecond, cannot.
impl Drop for Inner {
    fn drop(&mut self) {
        let young = FIRST_ANNOUNCEMENT.saturating_sub(self.created.elapsed());
        let answering = self
            .matches
            .last_discovery()
            .map_or(Duration::ZERO, |discovery| {
                ANSWER.saturating_sub(discovery.elapsed())
            });
        thread::sleep(young.max(answering));
        self.depart();
    }
}

/// The addresses of the loopback interface and of the networks by which peers are reached.
fn networks(peers: &[Ipv4Addr]) -> Vec<IpAddr> {
    let mut networks = vec![IpAddr::V4(Ipv4Addr::LOCALHOST)];
    for peer in peers {
        match peers::own_address(*peer) {
            Ok(own) if own.is_loopback() => {}
            Ok(own) => networks.push(own.into()),
            Err(error) => warn!(%peer, %error, "no way to a static peer: it will not be found"),
        }
    }
    networks.sort_unstable();
    networks.dedup();
    // RustDDS 0.15 has no switch for multicast beside that for the networks.
    for network in networks.iter().filter(|network| !network.is_loopback()) {
        warn!(
            %network,
            "static peers beyond this host: nodes in their network are found by multicast too"
        );
    }
    networks
}

fn text(error: impl fmt::Display) -> String {
    error.to_string()
}
