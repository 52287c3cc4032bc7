//! The node's own endpoints.

use std::{sync::Arc, time::Duration};

use rustdds::GUID;

use super::{graph::Side, participant::Participant};
use crate::ros::{type_names, wire::WireEndpoint};

/// An endpoint that is announced, and whose matches and faults are followed, as long as this lives.
pub(super) struct Local {
    pub(super) guid: GUID,
    pub(super) topic: String,
    pub(super) node: Arc<Participant>,
    side: Side,
}

impl Local {
    pub(super) fn new(
        node: &Arc<Participant>,
        side: Side,
        guid: GUID,
        topic: &str,
        type_name: &str,
    ) -> Self {
        if let Ok(dds_type) = type_names::dds_type(type_name) {
            node.faults.add(guid, side, topic, &dds_type);
        }
        node.graph().add(side, guid);
        Self {
            guid,
            topic: topic.into(),
            node: Arc::clone(node),
            side,
        }
    }
}

impl WireEndpoint for Local {
    fn matched(&self) -> usize {
        self.node.matches.count(self.guid)
    }

    fn wait_for_matches(&self, count: usize, timeout: Duration) -> bool {
        self.node.matches.wait(self.guid, count, timeout)
    }

    fn incompatible(&self) -> usize {
        self.node.faults.count(self.guid)
    }

    fn topic(&self) -> &str {
        &self.topic
    }
}

impl Drop for Local {
    fn drop(&mut self) {
        if self.node.farewell.begun() {
            // One announcement for all.
            self.node.graph().leave();
        }
        self.node.graph().remove(self.side, self.guid);
        self.node.matches.forget(self.guid);
        self.node.faults.remove(self.guid);
        self.node.first_samples.forget(self.guid);
    }
}
