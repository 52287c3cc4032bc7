//! Where a bag's topics go.

use std::time::Duration;

use lgvi_bag::{BagReader, Durability, Topic};
use lgvi_middleware::shm::{Delivery, ShmNode};
use lgvi_node::{Node, NodeError};
use tracing::warn;

use crate::channel::Channel;
use crate::clock::CLOCK;
use crate::config::Config;
use crate::reel::Shown;
use crate::states;

/// How long subscribers that do not keep up are waited for.
pub(crate) const PATIENCE: Duration = Duration::from_secs(5);

/// The outlets of a bag's topics, in the order of the bag; none for those that are not played.
pub(crate) struct Channels(Vec<Option<Channel>>);

impl Channels {
    /// Opens what is to be played.
    ///
    /// A topic that cannot be published is left out, with a warning.
    ///
    /// # Errors
    /// Nothing is left to play.
    pub(crate) fn open(
        bag: &BagReader,
        node: &Node,
        config: &Config,
        lossless: bool,
    ) -> Result<Self, NodeError> {
        let (topics, selection) = (bag.topics(), &config.selection);
        let unreadable = bag.left_out().iter();
        for topic in unreadable.filter(|topic| selection.takes(&topic.name)) {
            warn!("{} is left out: {}", topic.name, topic.reason);
        }
        for warning in bag.warnings() {
            warn!("{warning}");
        }
        for missing in bag.missing() {
            warn!("{missing}");
        }
        for asked in selection.asked_for() {
            if !names(bag).any(|name| name == asked) {
                warn!("{asked}: not in the bag");
            }
        }
        let wanted: Vec<bool> = topics
            .iter()
            .map(|topic| {
                let own = config.clock.is_some() && topic.name == CLOCK;
                if own {
                    warn!("{CLOCK} of the bag is not played: it is published as parameter \"clock\" asks for");
                }
                selection.takes(&topic.name) && !own
            })
            .collect();
        let is_empty = names(bag).next().is_none();
        let nothing = |is: &str| {
            let names: Vec<&str> = names(bag).collect();
            NodeError::Input(format!(
                "none of the bag's topics {is} played: {}",
                names.join(", ")
            ))
        };
        if !is_empty && !wanted.contains(&true) {
            return Err(nothing("is to be"));
        }
        let bodies = states::bodies(bag, &wanted, &node.shutdown)?;
        let shm = node.shm()?;
        let delivery = if lossless {
            Delivery::Lossless { patience: PATIENCE }
        } else {
            Delivery::DropNewest
        };
        let channels = topics.iter().zip(wanted).zip(bodies);
        let channels = channels.map(|((topic, wanted), bodies)| {
            if wanted {
                open(topic, node, bodies.map(|bodies| (&shm, bodies)), delivery)
            } else {
                Ok(None)
            }
        });
        let channels = Self(channels.collect::<Result<_, _>>()?);
        if !is_empty && !channels.opened().contains(&true) {
            return Err(nothing("can be"));
        }
        Ok(channels)
    }

    /// Which of the bag's topics are played.
    pub(crate) fn opened(&self) -> Vec<bool> {
        self.0.iter().map(Option::is_some).collect()
    }

    /// Whether every topic has so many subscribers, over DDS or shared memory.
    pub(crate) fn have_subscribers(&mut self, count: usize) -> Result<bool, NodeError> {
        for channel in self.0.iter_mut().flatten() {
            if !channel.has_subscribers(count)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Publishes a message to those who have subscribed to its topic.
    pub(crate) fn publish(&mut self, shown: Shown<'_>) -> Result<(), NodeError> {
        match self.0.get_mut(shown.topic) {
            Some(Some(channel)) => channel.publish(shown.message),
            _ => Ok(()),
        }
    }

    /// Waits for the acknowledgements.
    pub(crate) fn settle(&self) {
        self.0.iter().flatten().for_each(Channel::settle);
    }
}

fn open(
    topic: &Topic,
    node: &Node,
    states: Option<(&ShmNode, usize)>,
    delivery: Delivery,
) -> Result<Option<Channel>, NodeError> {
    let name = &topic.name;
    let durable = topic.qos.durability == Durability::TransientLocal;
    let opened = node
        .ros
        .raw_publisher(name, &topic.type_name, &Channel::qos(topic));
    let dds = match opened {
        Ok(dds) => dds,
        Err(error) => {
            warn!("{name} is left out: {error}");
            return Ok(None);
        }
    };
    Channel::new(dds, durable, states, delivery).map(Some)
}

/// Names of the bag's topics, also of those that cannot be read.
fn names(bag: &BagReader) -> impl Iterator<Item = &str> {
    let topics = bag.topics().iter().map(|topic| &*topic.name);
    topics.chain(bag.left_out().iter().map(|topic| &*topic.name))
}
