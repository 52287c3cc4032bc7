//! The nodes of other participants, as these announce them.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Arc, Mutex, OnceLock},
};

use lgvi_msgs::{RosMessage, cdr};
use ros2_client::Gid;
use rustdds::GUID;
use serde::{Deserialize, Serialize};

use super::inbox::Inbox;
use crate::{names, ros::namesakes::Birth, sync::lock};

/// Keeps what arrives on `ros_discovery_info`.
pub(super) struct Names {
    inbox: OnceLock<Arc<Inbox>>,
    own: Gid,
    of: Mutex<BTreeMap<[u8; 16], Announced>>,
}

/// What is known of one participant.
struct Announced {
    nodes: Vec<NodeEntities>,
    /// The earliest time at which it says to have announced something (ns since the UNIX epoch, by its host's clock).
    since: i64,
}

/// What one participant announces. That of ros2-client looks for each endpoint among all others.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct ParticipantEntities {
    pub(super) participant: Gid,
    pub(super) nodes: Vec<NodeEntities>,
}

/// rmw_dds_common/msg/NodeEntitiesInfo.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct NodeEntities {
    pub(super) namespace: String,
    pub(super) name: String,
    pub(super) readers: BTreeSet<Gid>,
    pub(super) writers: BTreeSet<Gid>,
}

impl RosMessage for ParticipantEntities {
    const TYPE_NAME: &'static str = "rmw_dds_common/msg/ParticipantEntitiesInfo";
    const TYPE_HASH: &'static str = "";
    const DEFINITION: &'static str = "";
}

impl Names {
    pub(super) fn new(participant: GUID) -> Self {
        Self {
            inbox: OnceLock::new(),
            own: participant.into(),
            of: Mutex::default(),
        }
    }

    /// Begins to take note of what arrives in an inbox; the first call counts.
    pub(super) fn listen(&self, inbox: Arc<Inbox>) {
        let _ = self.inbox.set(inbox);
    }

    /// Takes note of what has arrived.
    pub(super) fn refresh(&self) {
        let Some(inbox) = self.inbox.get() else {
            return;
        };
        while let Some(taken) = inbox.arrivals().take() {
            // What cannot be read is another version's, of which no names are known.
            if let Ok(sample) = taken
                && let Ok(entities) = cdr::decode::<ParticipantEntities>(&sample.message)
                && entities.participant != self.own
            {
                let stamp = sample.info.source_time;
                let stamp = stamp.unwrap_or(sample.info.received_time);
                self.note(entities, stamp);
            }
        }
    }

    fn note(&self, entities: ParticipantEntities, stamp: i64) {
        let mut of = lock(&self.of);
        let participant = entities.participant.to_bytes16();
        let known = of.get(&participant);
        let since = known.map_or(stamp, |known| known.since.min(stamp));
        let nodes = entities.nodes;
        of.insert(participant, Announced { nodes, since });
    }

    /// The participants that have a node of this name, and since when they say to be there.
    pub(super) fn namesakes(&self, name: &str) -> Vec<Birth> {
        let of = lock(&self.of);
        let named = of.iter().filter(|(_, announced)| {
            let mut nodes = announced.nodes.iter();
            nodes.any(|node| node.fully_qualified_name() == name)
        });
        named
            .map(|(participant, announced)| (announced.since, *participant))
            .collect()
    }

    /// Forgets the participants for which this is not so.
    pub(super) fn retain(&self, stays: impl Fn(GUID) -> bool) {
        lock(&self.of).retain(|participant, _| stays(GUID::from_bytes(*participant)));
    }

    /// The fully qualified names of the nodes announced so far, sorted; one that is there twice is named twice.
    pub(super) fn all(&self) -> Vec<String> {
        let mut names: Vec<_> = lock(&self.of)
            .values()
            .flat_map(|announced| &announced.nodes)
            .map(NodeEntities::fully_qualified_name)
            .collect();
        names.sort();
        names
    }

    /// The node that an endpoint belongs to.
    pub(super) fn node_of(&self, endpoint: GUID) -> Option<String> {
        let gid = endpoint.to_bytes();
        let of = lock(&self.of);
        let nodes = of
            .iter()
            .filter(|(participant, _)| participant[..12] == gid[..12])
            .flat_map(|(_, announced)| &announced.nodes);
        let has = |node: &&NodeEntities| {
            let gid = Gid::from(endpoint);
            node.readers.contains(&gid) || node.writers.contains(&gid)
        };
        let mut names = nodes.clone().filter(has).chain(nodes);
        names.next().map(NodeEntities::fully_qualified_name)
    }
}

impl NodeEntities {
    fn fully_qualified_name(&self) -> String {
        names::join(&self.namespace, &self.name)
    }
}
