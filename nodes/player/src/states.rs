//! States of the suite's own type, which go over shared memory too.

use std::collections::BTreeMap;

use lgvi_bag::{BagReader, Message, Topic};
use lgvi_middleware::Shutdown;
use lgvi_middleware::node::NodeError;
use lgvi_msgs::msg::SystemState;
use lgvi_msgs::shm::{BodySample, StateHeader};
use lgvi_msgs::{RosMessage, cdr};
use tracing::warn;

/// For each of a bag's topics that go over shared memory, how many bodies its first state has.
///
/// Reads the bag until each of them has had one.
pub(crate) fn bodies(
    bag: &BagReader,
    wanted: &[bool],
    shutdown: &Shutdown,
) -> Result<Vec<Option<usize>>, NodeError> {
    let counts = bag.topic_counts();
    let topics = bag.topics().iter().zip(wanted).enumerate();
    let mut sought: BTreeMap<usize, &Topic> = topics
        .filter(|&(index, (topic, &wanted))| wanted && is_state(topic) && counts[index] > 0)
        .map(|(index, (topic, _))| (index, topic))
        .collect();
    let mut bodies = vec![None; bag.topics().len()];
    for message in bag.messages() {
        // Where a topic begins late in a long bag this takes seconds.
        if shutdown.requested() {
            return Err(NodeError::Interrupted);
        }
        if sought.is_empty() {
            break;
        }
        let message = message.map_err(NodeError::input)?;
        let topic = message.topic_index;
        if sought.remove(&topic).is_some() {
            bodies[topic] = Some(state(&message)?.1.len());
        }
    }
    Ok(bodies)
}

/// Whether a topic's messages are states as this version of the suite has them. What a bag calls so and defines otherwise
/// goes over DDS alone.
fn is_state(topic: &Topic) -> bool {
    if topic.type_name != SystemState::TYPE_NAME {
        return false;
    }
    let ours = match &*topic.type_hash {
        "" => topic.definition.is_empty() || topic.definition == SystemState::DEFINITION,
        hash => hash == SystemState::TYPE_HASH,
    };
    if !ours {
        let (name, hash) = (&topic.name, &topic.type_hash);
        warn!(
            "{name} does not go over shared memory: the bag defines {} otherwise: {hash}, expected {}",
            SystemState::TYPE_NAME,
            SystemState::TYPE_HASH
        );
    }
    ours
}

/// The state of a message.
pub(crate) fn state(message: &Message<'_>) -> Result<(StateHeader, Vec<BodySample>), NodeError> {
    let refuse = |error: &dyn std::fmt::Display| {
        NodeError::Input(format!(
            "{} at {} ns: {error}",
            message.topic.name, message.log_time
        ))
    };
    let state: SystemState = cdr::decode(&message.data).map_err(|error| refuse(&error))?;
    StateHeader::from_message(&state).map_err(|error| refuse(&error))
}
