//! Where a bag's topics go.

use std::collections::BTreeMap;
use std::time::Duration;

use lgvi_bag::{BagReader, Durability, Message, Reliability, Topic};
use lgvi_middleware::Shutdown;
use lgvi_middleware::ros::{Qos, RawPublisher};
use lgvi_middleware::shm::{Delivery, StatePublisher};
use lgvi_msgs::msg::SystemState;
use lgvi_msgs::shm::StateHeader;
use lgvi_msgs::{RosMessage, cdr};
use lgvi_node::{Node, NodeError};
use tracing::warn;

/// How long subscribers that do not keep up are waited for.
const PATIENCE: Duration = Duration::from_secs(5);

/// The outlets of a bag's topics, by name.
pub(crate) struct Channels {
    by_topic: BTreeMap<String, Channel>,
    lossless: bool,
}

struct Channel {
    dds: RawPublisher,
    shm: Option<StatePublisher>,
}

impl Channels {
    pub(crate) fn open(bag: &BagReader, node: &Node, lossless: bool) -> Result<Self, NodeError> {
        let (ros, shm) = (&node.ros, node.shm()?);
        let bodies = bodies(bag, &node.shutdown)?;
        let mut by_topic = BTreeMap::new();
        for topic in bag.topics() {
            let dds = ros
                .raw_publisher(&topic.name, &topic.type_name, &qos(topic))
                .map_err(NodeError::runtime)?;
            let delivery = if lossless {
                Delivery::Lossless { patience: PATIENCE }
            } else {
                Delivery::DropNewest
            };
            let shm = bodies
                .get(&topic.name)
                .map(|&bodies| shm.state_publisher(dds.topic(), bodies, delivery))
                .transpose()
                .map_err(NodeError::runtime)?;
            by_topic.insert(topic.name.clone(), Channel { dds, shm });
        }
        Ok(Self { by_topic, lossless })
    }

    /// Whether every topic has so many subscribers, over DDS or shared memory.
    pub(crate) fn have_subscribers(&mut self, count: usize) -> Result<bool, NodeError> {
        for channel in self.by_topic.values_mut() {
            let over_shm = match &mut channel.shm {
                Some(shm) => shm
                    .wait_for_subscribers(count, Duration::ZERO)
                    .map_err(NodeError::runtime)?,
                None => false,
            };
            if !over_shm && channel.dds.matched_subscriptions() < count {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Publishes a message to those who have subscribed to its topic.
    pub(crate) fn publish(&mut self, message: Message<'_>) -> Result<(), NodeError> {
        let Some(channel) = self.by_topic.get_mut(&message.topic.name) else {
            return Ok(());
        };
        if let Some(shm) = &mut channel.shm {
            let (header, bodies) = state(&message)?;
            shm.send(header, &bodies).map_err(NodeError::runtime)?;
        }
        // A durable topic is published for those who come later, too.
        if message.topic.qos.durability == Durability::Volatile
            && channel.dds.matched_subscriptions() == 0
        {
            return Ok(());
        }
        let sent = if self.lossless {
            channel.dds.publish_lossless(message.data, PATIENCE)
        } else {
            channel.dds.publish(message.data)
        };
        if let Err(error) = sent {
            warn!("{error}");
        }
        Ok(())
    }

    /// Waits for the acknowledgements.
    pub(crate) fn settle(&self) {
        for channel in self.by_topic.values() {
            if let Err(error) = channel.dds.flush(PATIENCE) {
                warn!("{error}");
            }
        }
    }
}

/// How many bodies the states of each topic of states have, the most of any message.
fn bodies(bag: &BagReader, shutdown: &Shutdown) -> Result<BTreeMap<String, usize>, NodeError> {
    let mut bodies = BTreeMap::new();
    if bag
        .topics()
        .iter()
        .any(|topic| topic.type_name == SystemState::TYPE_NAME)
    {
        for message in bag.messages() {
            // Of a long bag this takes seconds.
            if shutdown.requested() {
                return Err(NodeError::Interrupted);
            }
            let message = message.map_err(NodeError::input)?;
            if message.topic.type_name == SystemState::TYPE_NAME {
                let (_, states) = state(&message)?;
                let most: &mut usize = bodies.entry(message.topic.name.clone()).or_default();
                *most = states.len().max(*most);
            }
        }
    }
    Ok(bodies)
}

fn state(
    message: &Message<'_>,
) -> Result<(StateHeader, Vec<lgvi_msgs::shm::BodySample>), NodeError> {
    let refuse = |error: &dyn std::fmt::Display| {
        NodeError::Input(format!(
            "{} at {} ns: {error}",
            message.topic.name, message.log_time
        ))
    };
    let state: SystemState = cdr::decode(&message.data).map_err(|error| refuse(&error))?;
    StateHeader::from_message(&state).map_err(|error| refuse(&error))
}

fn qos(topic: &Topic) -> Qos {
    let depth = (topic.qos.depth as usize).max(1);
    match (topic.qos.reliability, topic.qos.durability) {
        (Reliability::BestEffort, _) => Qos::sensor(depth),
        (Reliability::Reliable, Durability::TransientLocal) => Qos::latched(depth),
        (Reliability::Reliable, Durability::Volatile) => Qos::reliable(depth),
    }
}
