//! Subscriptions on DDS readers.

use std::sync::Arc;

use rustdds::{GUID, rpc::SampleIdentity};

use super::{graph::Side, inbox::Inbox, local::Local, participant::Participant, policies};
use crate::ros::{
    Qos, RosError, SampleId, WriterId,
    arrivals::Arrivals,
    wire::{WireEndpoint, WireSubscription},
};

/// A DDS reader and what has arrived at it.
pub(super) struct Reader {
    inbox: Arc<Inbox>,
    local: Local,
}

impl Reader {
    pub(super) fn new(
        node: &Arc<Participant>,
        topic: &str,
        dds_topic: String,
        type_name: &str,
        qos: &Qos,
    ) -> Result<Self, RosError> {
        let reader = node.endpoint(topic, dds_topic, type_name, |_, subscriber, topic| {
            subscriber.create_simple_datareader_no_key(topic, Some(policies::requested(qos)))
        })?;
        let local = Local::new(node, Side::Subscription, reader.guid(), topic, type_name);
        let inbox = Inbox::new(reader, topic.into(), qos.depth());
        local.node.background.add(Arc::clone(&inbox));
        Ok(Self { inbox, local })
    }

    pub(super) fn guid(&self) -> GUID {
        self.local.guid
    }
}

impl WireSubscription for Reader {
    fn endpoint(&self) -> &dyn WireEndpoint {
        &self.local
    }

    fn arrivals(&self) -> &Arrivals {
        self.inbox.arrivals()
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        self.local.node.background.remove(&self.inbox);
    }
}

impl From<SampleIdentity> for SampleId {
    fn from(identity: SampleIdentity) -> Self {
        Self {
            writer: WriterId(identity.writer_guid.to_bytes()),
            sequence: identity.sequence_number.into(),
        }
    }
}

impl From<SampleId> for SampleIdentity {
    fn from(id: SampleId) -> Self {
        Self {
            writer_guid: GUID::from_bytes(id.writer.0),
            sequence_number: id.sequence.into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{
        future::poll_fn,
        process, thread,
        time::{Duration, Instant},
    };

    use lgvi_msgs::std_msgs::String as Text;

    use super::*;
    use crate::{
        Environment, NodeArgs, ServiceMapping,
        block::block_on_for,
        ros::{RosNode, dds::Dds},
    };

    const PATIENCE: Duration = Duration::from_secs(20);

    #[test]
    fn what_is_remembered_of_a_publisher_goes_with_it() {
        let environment = Environment::localhost(1 + (process::id() % 101) as u16);
        let args = |name: &str| {
            let name = format!("{name}_{}", process::id());
            NodeArgs::parse(&name, []).unwrap().0
        };
        let hearer = Dds::new(&args("hearer"), &environment, ServiceMapping::FastDds).unwrap();
        let subscription = hearer.reader("/said", "std_msgs/msg/String", &Qos::reliable(1));
        let subscription = subscription.unwrap();
        let speaker = RosNode::new(&args("speaker"), &environment).unwrap();
        let publisher = speaker.publisher("/said", &Qos::reliable(1)).unwrap();
        assert!(subscription.local.wait_for_matches(1, PATIENCE));
        publisher.publish(&Text::default()).unwrap();
        let sample = block_on_for(
            poll_fn(|context| subscription.arrivals().poll_take(context)),
            PATIENCE,
        )
        .unwrap()
        .unwrap();
        let id = sample.info.writer;
        let writer = GUID::from_bytes(id.0);
        let laggards = &hearer.0.laggards;
        laggards.suspect(writer);
        assert!(subscription.arrivals().publishers().contains(&id));
        drop((publisher, speaker));
        let start = Instant::now();
        while subscription.arrivals().publishers().contains(&id) || laggards.suspects(writer) {
            assert!(start.elapsed() < PATIENCE, "it is still remembered");
            thread::yield_now();
        }
    }
}
