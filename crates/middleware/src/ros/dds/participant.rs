//! A node as a DDS participant.

use std::{
    collections::BTreeSet,
    fmt,
    net::{IpAddr, Ipv4Addr, SocketAddr},
    sync::{Arc, Mutex, MutexGuard},
    thread,
    time::{Duration, Instant},
};

use ros2_client::NodeName;
use rustdds::policy::{Durability, Reliability};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, GUID, QosPolicies, RTPSEntity, Topic,
    TopicDescription, TopicKind, dds::result::CreateResult,
};
use tracing::warn;

use super::{
    background::Background,
    farewell::Farewell,
    faults::Faults,
    fence::{Fence, MakeError},
    first_samples::FirstSamples,
    graph::Graph,
    inbox::{Inbox, nanoseconds},
    keeps::Keeps,
    laggards::{Laggards, RemoteReader},
    matches::Matches,
    names::Names,
    naming,
    peers::{self, StaticPeers},
    policies, rtps, security,
};
use crate::ros::{
    Namesake, Qos, RosError, TopicInfo,
    namesakes::{self, is_elder},
    topics, type_names,
};
use crate::{Environment, NodeArgs, Reach, ServiceMapping, security::Enclave, sync::lock};

/// When RustDDS first announces a participant, and how soon it answers one that it discovers, with a margin.
const FIRST_ANNOUNCEMENT: Duration = Duration::from_millis(100 + 20);
const ANSWER: Duration = Duration::from_millis(10 + 20);

/// Announcements of other participants that may wait for the background thread.
const MAX_ANNOUNCEMENTS: usize = 1024;

/// A node and what its endpoints share. Fields are dropped in this order: the participant goes last.
pub(super) struct Participant {
    name: String,
    pub(super) service_mapping: ServiceMapping,
    graph: Mutex<Graph>,
    pub(super) background: Background,
    pub(super) matches: Arc<Matches>,
    pub(super) laggards: Arc<Laggards>,
    pub(super) faults: Arc<Faults>,
    pub(super) names: Arc<Names>,
    fence: Arc<Fence>,
    pub(super) first_samples: Arc<FirstSamples>,
    pub(super) farewell: Farewell,
    publisher: rustdds::Publisher,
    subscriber: rustdds::Subscriber,
    created: Instant,
    _static_peers: Option<StaticPeers>,
    participant: DomainParticipant,
}

impl Participant {
    /// Joins the domain and announces the node.
    pub(super) fn new(
        args: &NodeArgs,
        environment: &Environment,
        service_mapping: ServiceMapping,
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
        let laggards = Laggards::new(&participant, loopback_only, enclave.is_some());
        let laggards = Arc::new(laggards.map_err(text)?);
        let names = Arc::new(Names::new(participant.guid()));
        let faults = Arc::new(Faults::default());
        let fence = Arc::new(Fence::new(participant.guid(), Arc::clone(&laggards)));
        let first_samples = Arc::new(FirstSamples::default());
        let keeps = Keeps {
            matches: Arc::clone(&matches),
            laggards: Arc::clone(&laggards),
            names: Arc::clone(&names),
            faults: Arc::clone(&faults),
            fence: Arc::clone(&fence),
            first_samples: Arc::clone(&first_samples),
        };
        let background = Background::start(&participant, keeps).map_err(text)?;
        // RustDDS has begun with its own endpoints.
        fence.settle().map_err(text)?;
        let (graph, announcements) =
            Graph::new(&participant, &publisher, name, &fence).map_err(text)?;
        let qos = Some(policies::requested(&Qos::latched(1)));
        let others = fence
            .make(|| subscriber.create_simple_datareader_no_key(&announcements, qos))
            .map_err(text)?;
        let others = Inbox::new(others, announcements.name(), MAX_ANNOUNCEMENTS);
        names.listen(Arc::clone(&others));
        background.add(others);
        Ok(Self {
            name: args.fully_qualified_name(),
            service_mapping,
            background,
            matches,
            laggards,
            faults,
            names,
            fence,
            first_samples,
            farewell: Farewell::default(),
            graph: Mutex::new(graph),
            publisher,
            subscriber,
            created: Instant::now(),
            _static_peers: static_peers,
            participant,
        })
    }

    /// The topics of other participants that have been discovered so far, ordered by name and type.
    pub(super) fn topics(&self) -> Vec<TopicInfo> {
        let writers = self
            .participant
            .discovered_writers()
            .into_iter()
            .map(|writer| {
                let data = writer.publication_topic_data;
                let reliable = matches!(data.reliability, Some(Reliability::Reliable { .. }));
                let durable = !matches!(data.durability, None | Some(Durability::Volatile));
                (data.topic_name, data.type_name, Some((reliable, durable)))
            });
        let readers = self
            .participant
            .discovered_readers()
            .into_iter()
            .map(|reader| {
                let data = reader.subscription_topic_data;
                (data.topic_name().clone(), data.type_name().clone(), None)
            });
        topics::collect(
            writers
                .chain(readers)
                .filter_map(|(topic, dds_type, offer)| {
                    let name = naming::ros_topic(&topic)?.into();
                    Some((name, type_names::ros_type(&dds_type)?, offer))
                }),
        )
    }

    /// The nodes of other participants that have this one's name, as discovered so far.
    pub(super) fn namesakes(&self) -> Vec<Namesake> {
        let born = nanoseconds(self.graph().born()).unwrap_or_default();
        let own = (born, self.participant.guid().to_bytes());
        let others = self.names.namesakes(&self.name);
        let namesakes = others.into_iter().map(|other| {
            let participant = GUID::from_bytes(other.1);
            Namesake {
                participant: namesakes::identity(participant.to_bytes()),
                addresses: self.addresses(participant),
                elder: is_elder(own, self.created.elapsed(), other),
            }
        });
        namesakes.collect()
    }

    /// Makes an endpoint on a topic, which has the name `dds_topic` on DDS.
    pub(super) fn endpoint<E>(
        &self,
        topic: &str,
        dds_topic: String,
        type_name: &str,
        create: impl FnOnce(&rustdds::Publisher, &rustdds::Subscriber, &Topic) -> CreateResult<E>,
    ) -> Result<E, RosError> {
        let dds_type = type_names::dds_type(type_name)?;
        let none = QosPolicies::qos_none();
        let participant = &self.participant;
        participant
            .create_topic(dds_topic, dds_type, &none, TopicKind::NoKey)
            .map_err(MakeError::from)
            .and_then(|topic| {
                self.fence
                    .make(|| create(&self.publisher, &self.subscriber, &topic))
            })
            .map_err(|error| RosError::Endpoint {
                topic: topic.into(),
                type_name: type_name.into(),
                reason: error.to_string(),
            })
    }

    /// Has a reader of requests ask for the first one of each client, of those too that it has been matched with meanwhile.
    pub(super) fn serve(&self, requests: GUID) {
        self.first_samples.serve(requests);
        for client in self.matches.of(requests) {
            self.first_samples.expect(requests, client);
        }
        self.background.unpark();
    }

    /// The readers of other participants, and whether they are reliable.
    fn readers(&self) -> impl Iterator<Item = (RemoteReader, bool)> {
        let readers = self.participant.discovered_readers().into_iter();
        readers.map(|reader| {
            let reliable = reader.subscription_topic_data.qos().is_reliable();
            let proxy = reader.reader_proxy;
            let locators = proxy.unicast_locator_list.into_iter();
            let reader = RemoteReader {
                guid: proxy.remote_reader_guid,
                locators: locators.map(SocketAddr::from).collect(),
            };
            (reader, reliable)
        })
    }

    /// Whether a writer's matched readers say of themselves that they are on the loopback interface, and nowhere else.
    pub(super) fn reaches_loopback_only(&self, writer: GUID) -> bool {
        let mut matched = self.matches.of(writer);
        for (RemoteReader { guid, locators }, _) in self.readers() {
            let loopback = |locator: &SocketAddr| locator.ip().is_loopback();
            if !locators.is_empty() && locators.iter().all(loopback) {
                matched.remove(&guid);
            }
        }
        matched.is_empty()
    }

    /// The reliable readers that a writer is matched with.
    pub(super) fn reliable_readers(&self, writer: GUID) -> Vec<RemoteReader> {
        let matched = self.matches.of(writer);
        let readers = self.readers();
        readers
            .filter(|(reader, reliable)| *reliable && matched.contains(&reader.guid))
            .map(|(reader, _)| reader)
            .collect()
    }

    /// Tells the other participants that this one leaves, in the way that Fast DDS understands too: it would list the
    /// endpoints until the lease has run out, 50 s later.
    fn depart(&self) {
        let domain_id = self.participant.domain_id();
        let addresses: BTreeSet<_> = self
            .readers()
            .flat_map(|(reader, _)| reader.locators)
            .filter_map(|locator| peers::discovery_address(domain_id, locator))
            .collect();
        let departure = rtps::departure(self.participant.guid());
        self.laggards.send(&departure, addresses);
    }

    /// Where a remote participant's subscriptions are reached.
    fn addresses(&self, participant: GUID) -> Vec<IpAddr> {
        let own = self.readers().map(|(reader, _)| reader);
        let own = own.filter(|reader| reader.guid.prefix == participant.prefix);
        let addresses: BTreeSet<_> = own
            .flat_map(|reader| reader.locators)
            .map(|locator| locator.ip())
            .filter(|address| !address.is_unspecified())
            .collect();
        addresses.into_iter().collect()
    }

    /// What a remote endpoint is called: its node, or its identity.
    pub(super) fn describe(&self, remote: GUID) -> String {
        let name = self.names.node_of(remote);
        name.unwrap_or_else(|| format!("{remote:?}"))
    }

    pub(super) fn graph(&self) -> MutexGuard<'_, Graph> {
        lock(&self.graph)
    }
}

/// RustDDS 0.15 holds the participant while it announces it. Were the last of our handles dropped then, RustDDS would
/// drop the participant on its own thread, which cannot wait for its own end: it panics, and the node does not say
/// goodbye. The announcements that can be foreseen are waited for; one in ten seconds, of a millisecond, cannot.
impl Drop for Participant {
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
