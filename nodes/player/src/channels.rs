//! Where a bag's topics go.

use std::mem;

use lgvi_bag::{BagReader, Topic};
use lgvi_common::Choice;
use lgvi_middleware::node::{Node, NodeError};
use lgvi_middleware::ros::{Qos, RosNode};
use lgvi_middleware::shm::{Delivery, ShmNode};
use tracing::warn;

use crate::channel::{Channel, PATIENCE};
use crate::clock::CLOCK;
use crate::config::Config;
use crate::depths;
use crate::reel::Shown;
use crate::states;

/// The outlets of a bag's topics.
pub(crate) struct Channels {
    /// In the order of the bag; none for those that are not played.
    channels: Vec<Option<Channel>>,
    depths: Vec<usize>,
    ros: RosNode,
}

impl Drop for Channels {
    fn drop(&mut self) {
        let channels = mem::take(&mut self.channels);
        self.ros.announce_together(|| drop(channels));
    }
}

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
        rate: f64,
    ) -> Result<Self, NodeError> {
        let (topics, selection) = (bag.topics(), &config.selection);
        let takes = |topic: &str| selection.choice(topic) != Choice::No;
        let unreadable = bag.left_out().iter();
        for topic in unreadable.filter(|topic| takes(&topic.name)) {
            warn!("{} is left out: {}", topic.name, topic.reason);
        }
        for warning in bag.warnings() {
            warn!("{warning}");
        }
        for missing in bag.missing() {
            warn!("{missing}");
        }
        for asked in selection.names.iter().flatten() {
            if !names(bag).any(|name| name == asked) {
                warn!("{asked}: not in the bag");
            }
        }
        let wanted: Vec<bool> = topics
            .iter()
            .map(|topic| {
                let own = config.clock.is_some() && topic.name == CLOCK;
                if own {
                    warn!("{CLOCK} of the bag is not played: the parameter \"clock\" makes this node publish it");
                }
                takes(&topic.name) && !own
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
        let delivery = delivery(rate);
        let depths = depths::depths(bag, &wanted, &node.shutdown)?;
        let channels = topics.iter().zip(wanted).zip(bodies).zip(&depths);
        let channels = channels.map(|(((topic, wanted), bodies), &depth)| {
            if wanted {
                let qos = Channel::qos(topic, depth);
                let states = bodies.map(|bodies| (&shm, bodies));
                open(topic, node, &qos, states, delivery)
            } else {
                Ok(None)
            }
        });
        let channels = Self {
            channels: node
                .ros
                .announce_together(|| channels.collect::<Result<_, _>>())?,
            depths,
            ros: node.ros.clone(),
        };
        if !is_empty && !channels.opened().contains(&true) {
            return Err(nothing("can be"));
        }
        Ok(channels)
    }

    /// How many messages each of the bag's topics keeps.
    pub(crate) fn depths(&self) -> &[usize] {
        &self.depths
    }

    /// Waits for those who do not keep up, or not, as the rate asks for.
    pub(crate) fn set_rate(&mut self, rate: f64) {
        let delivery = delivery(rate);
        let channels = self.channels.iter_mut().flatten();
        channels.for_each(|channel| channel.deliver(delivery));
    }

    /// Which of the bag's topics are played.
    pub(crate) fn opened(&self) -> Vec<bool> {
        self.channels.iter().map(Option::is_some).collect()
    }

    /// Whether every topic has so many subscribers, over DDS or shared memory.
    pub(crate) fn have_subscribers(&mut self, count: usize) -> Result<bool, NodeError> {
        for channel in self.channels.iter_mut().flatten() {
            if !channel.has_subscribers(count)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Publishes a message to those who have subscribed to its topic.
    pub(crate) fn publish(&mut self, shown: Shown<'_>) -> Result<(), NodeError> {
        match self.channels.get_mut(shown.topic) {
            Some(Some(channel)) => channel.publish(shown.message),
            _ => Ok(()),
        }
    }

    /// Waits for the acknowledgments.
    pub(crate) fn settle(&self) {
        self.channels.iter().flatten().for_each(Channel::settle);
    }
}

/// As fast as possible all is waited for.
fn delivery(rate: f64) -> Delivery {
    if rate == 0.0 {
        Delivery::Lossless { patience: PATIENCE }
    } else {
        Delivery::DropNewest
    }
}

fn open(
    topic: &Topic,
    node: &Node,
    qos: &Qos,
    states: Option<(&ShmNode, usize)>,
    delivery: Delivery,
) -> Result<Option<Channel>, NodeError> {
    let name = &topic.name;
    let durable = topic.qos.durable;
    let opened = node.ros.raw_publisher(name, &topic.type_name, qos);
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
