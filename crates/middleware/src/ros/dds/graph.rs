//! The announcement of a node and its endpoints to other ROS nodes.

use std::collections::BTreeSet;

use ros2_client::builtin_topics::ros_discovery;
use ros2_client::{Gid, NodeName};
use rustdds::{
    DomainParticipant, GUID, Publisher, RTPSEntity, Timestamp, Topic, TopicKind,
    no_key::DataWriterCdr,
};
use tracing::warn;

use super::fence::{Fence, MakeError};
use super::names::{NodeEntities, ParticipantEntities};

/// Says on `ros_discovery_info` which endpoints belong to the node; takes it back when dropped.
pub(super) struct Graph {
    participant: Gid,
    node: NodeEntities,
    /// When the node was first announced, which is what all its announcements are stamped with: two nodes of one name
    /// see alike which of them is the older.
    born: Timestamp,
    gone: bool,
    /// Endpoints are being made that are announced together.
    held: bool,
    announcer: DataWriterCdr<ParticipantEntities>,
}

/// Which side of a topic an endpoint is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Publisher,
    Subscription,
}

impl Graph {
    /// Announces the node; returns also the topic, on which the others announce theirs.
    pub(super) fn new(
        participant: &DomainParticipant,
        publisher: &Publisher,
        node: NodeName,
        fence: &Fence,
    ) -> Result<(Self, Topic), MakeError> {
        let topic = participant.create_topic(
            ros_discovery::TOPIC_NAME.into(),
            ros_discovery::TYPE_NAME.into(),
            &ros_discovery::QOS_PUB,
            TopicKind::NoKey,
        )?;
        let graph = Self {
            participant: participant.guid().into(),
            node: NodeEntities {
                namespace: node.namespace().into(),
                name: node.base_name().into(),
                readers: BTreeSet::new(),
                writers: BTreeSet::new(),
            },
            born: Timestamp::now(),
            gone: false,
            held: false,
            announcer: fence.make(|| publisher.create_datawriter_no_key(&topic, None))?,
        };
        graph.announce();
        Ok((graph, topic))
    }

    /// When the node was first announced.
    pub(super) fn born(&self) -> Timestamp {
        self.born
    }

    /// Takes the node back, before its endpoints go one by one.
    pub(super) fn leave(&mut self) {
        if !self.gone {
            self.write(Vec::new());
            self.gone = true;
        }
    }

    pub(super) fn add(&mut self, side: Side, endpoint: GUID) {
        self.side(side).insert(endpoint.into());
        self.announce();
    }

    pub(super) fn remove(&mut self, side: Side, endpoint: GUID) {
        self.side(side).remove(&endpoint.into());
        self.announce();
    }

    /// Announces nothing until it is called again, without `held`, which announces all at once.
    pub(super) fn hold(&mut self, held: bool) {
        self.held = held;
        self.announce();
    }

    fn side(&mut self, side: Side) -> &mut BTreeSet<Gid> {
        match side {
            Side::Publisher => &mut self.node.writers,
            Side::Subscription => &mut self.node.readers,
        }
    }

    fn announce(&self) {
        if !self.gone && !self.held {
            self.write(vec![self.node.clone()]);
        }
    }

    fn write(&self, nodes: Vec<NodeEntities>) {
        let participant = self.participant;
        let entities = ParticipantEntities { participant, nodes };
        if let Err(error) = self.announcer.write(entities, Some(self.born)) {
            warn!(%error, "cannot announce the node in the ROS graph");
        }
    }
}

impl Drop for Graph {
    fn drop(&mut self) {
        self.leave();
    }
}
