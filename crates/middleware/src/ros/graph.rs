//! The announcement of a node and its endpoints to other ROS nodes.

use std::collections::BTreeSet;

use ros2_client::builtin_topics::ros_discovery;
use ros2_client::{
    Gid, NodeName,
    entities_info::{NodeEntitiesInfo, ParticipantEntitiesInfo},
};
use rustdds::{
    DomainParticipant, GUID, Publisher, RTPSEntity, Timestamp, Topic, TopicKind,
    no_key::DataWriterCdr,
};
use tracing::warn;

use super::fence::{Fence, MakeError};

/// Says on `ros_discovery_info` which endpoints belong to the node; takes it back when dropped.
pub(super) struct Graph {
    participant: Gid,
    node: NodeName,
    readers: BTreeSet<Gid>,
    writers: BTreeSet<Gid>,
    /// When the node was first announced, which is what all its announcements are stamped with: two nodes of one name
    /// see alike which of them is the older.
    born: Timestamp,
    gone: bool,
    announcer: DataWriterCdr<ParticipantEntitiesInfo>,
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
            node,
            readers: BTreeSet::new(),
            writers: BTreeSet::new(),
            born: Timestamp::now(),
            gone: false,
            announcer: fence.make(|| publisher.create_datawriter_no_key(&topic, None))?,
        };
        graph.announce(vec![graph.node_info()]);
        Ok((graph, topic))
    }

    /// When the node was first announced.
    pub(super) fn born(&self) -> Timestamp {
        self.born
    }

    /// Takes the node back, before its endpoints go one by one.
    pub(super) fn leave(&mut self) {
        if !self.gone {
            self.announce(Vec::new());
            self.gone = true;
        }
    }

    pub(super) fn add(&mut self, side: Side, endpoint: GUID) {
        self.side(side).insert(endpoint.into());
        self.announce(vec![self.node_info()]);
    }

    pub(super) fn remove(&mut self, side: Side, endpoint: GUID) {
        self.side(side).remove(&endpoint.into());
        self.announce(vec![self.node_info()]);
    }

    fn side(&mut self, side: Side) -> &mut BTreeSet<Gid> {
        match side {
            Side::Publisher => &mut self.writers,
            Side::Subscription => &mut self.readers,
        }
    }

    fn node_info(&self) -> NodeEntitiesInfo {
        let mut info = NodeEntitiesInfo::new(self.node.clone());
        self.readers.iter().for_each(|gid| info.add_reader(*gid));
        self.writers.iter().for_each(|gid| info.add_writer(*gid));
        info
    }

    fn announce(&self, nodes: Vec<NodeEntitiesInfo>) {
        if self.gone {
            return;
        }
        let info = ParticipantEntitiesInfo::new(self.participant, nodes);
        if let Err(error) = self.announcer.write(info, Some(self.born)) {
            warn!(%error, "cannot announce the node in the ROS graph");
        }
    }
}

impl Drop for Graph {
    fn drop(&mut self) {
        self.leave();
    }
}
