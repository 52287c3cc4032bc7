//! How many messages of each topic are kept for those who come later.

use lgvi_bag::{BagReader, History, Topic};
use lgvi_middleware::Shutdown;
use lgvi_middleware::node::NodeError;

use crate::reel;

/// The most messages of a topic.
const MOST: usize = 1000;

/// The most bytes of a topic.
pub(crate) const BYTES: usize = 64 << 20;

/// The depth of ROS 2's default, for which no topic's messages are too long.
const USUAL: usize = 10;

/// For each of a bag's topics, how many messages its publishers kept together: all where nobody tells, but no more than it
/// has, and than find room if they are as long as the first.
///
/// Reads the bag until each topic that keeps many has had one.
pub(crate) fn depths(
    bag: &BagReader,
    wanted: &[bool],
    shutdown: &Shutdown,
) -> Result<Vec<usize>, NodeError> {
    let counts = bag.topic_counts();
    let topics = bag.topics().iter().enumerate();
    let depths = topics.map(|(index, topic)| {
        kept(topic).min(usize::try_from(counts[index]).unwrap_or(usize::MAX))
    });
    let mut depths: Vec<usize> = depths.map(|depth| depth.max(1)).collect();
    let mut sought: Vec<bool> = bag
        .topics()
        .iter()
        .zip(wanted)
        .zip(&depths)
        .map(|((topic, &wanted), &depth)| wanted && topic.is_latched() && depth > USUAL)
        .collect();
    let mut messages = reel::chosen(bag, 0, &sought);
    let mut left = sought.iter().filter(|sought| **sought).count();
    while left > 0 {
        if shutdown.requested() {
            return Err(NodeError::Interrupted);
        }
        let Some(message) = messages.next() else {
            break;
        };
        let message = message.map_err(NodeError::input)?;
        let topic = message.topic_index;
        if std::mem::take(&mut sought[topic]) {
            left -= 1;
            let room = BYTES / message.data.len().max(1);
            depths[topic] = depths[topic].min(room.max(USUAL));
        }
    }
    Ok(depths)
}

/// How many messages a topic's publishers kept together.
fn kept(topic: &Topic) -> usize {
    let depth = match topic.qos.history {
        History::Unknown if topic.is_latched() => u32::MAX,
        _ => topic.qos.assumed_depth(),
    };
    (depth as usize).min(MOST)
}
