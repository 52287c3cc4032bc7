//! Where one topic goes.

use std::time::{Duration, Instant};

use lgvi_bag::{Message, Topic};
use lgvi_middleware::node::NodeError;
use lgvi_middleware::ros::{Qos, RawPublisher};
use lgvi_middleware::shm::{Delivery, ShmNode, StatePublisher};
use lgvi_msgs::cdr;
use tracing::warn;

use crate::states;

/// How long subscribers that do not keep up are waited for.
pub(crate) const PATIENCE: Duration = Duration::from_secs(5);

/// How often somebody is told that messages of a topic are not published.
const COMPLAINT: Duration = Duration::from_secs(1);

/// How long subscribers have to connect to a publisher that takes another's place; they do so when they receive.
const CONNECT: Duration = Duration::from_millis(100);

/// The outlets of a topic.
pub(crate) struct Channel {
    dds: RawPublisher,
    states: Option<States>,
    /// Whether messages are for those who come later, too.
    durable: bool,
    /// What is done about those who do not keep up.
    delivery: Delivery,
    complained: Option<Instant>,
}

/// The way of states over shared memory.
struct States {
    shm: ShmNode,
    delivery: Delivery,
    /// How many bodies the publisher has room for.
    bodies: usize,
    publisher: Option<StatePublisher>,
    /// Whether it takes another's place.
    anew: bool,
}

impl Channel {
    /// States go over shared memory too, which has room for so many bodies.
    pub(crate) fn new(
        dds: RawPublisher,
        durable: bool,
        states: Option<(&ShmNode, usize)>,
        delivery: Delivery,
    ) -> Result<Self, NodeError> {
        let mut states = states.map(|(shm, bodies)| States {
            shm: shm.clone(),
            delivery,
            bodies,
            publisher: None,
            anew: false,
        });
        if let Some(states) = &mut states {
            states.publisher(dds.topic(), 0)?;
        }
        Ok(Self {
            dds,
            states,
            durable,
            delivery,
            complained: None,
        })
    }

    /// How a topic is offered, which keeps so many messages: as it was recorded.
    pub(crate) fn qos(topic: &Topic, depth: usize) -> Qos {
        match (topic.qos.reliable, topic.qos.durable) {
            (false, _) => Qos::sensor(depth),
            (true, true) => Qos::latched(depth),
            (true, false) => Qos::volatile(depth),
        }
    }

    /// Changes what is done about those who do not keep up.
    pub(crate) fn deliver(&mut self, delivery: Delivery) {
        self.delivery = delivery;
        if let Some(states) = &mut self.states {
            states.deliver(delivery);
        }
    }

    /// Whether the topic has so many subscribers, over DDS or shared memory.
    pub(crate) fn has_subscribers(&mut self, count: usize) -> Result<bool, NodeError> {
        let over_shm = match &mut self.states {
            Some(states) => states
                .publisher(self.dds.topic(), 0)?
                .wait_for_subscribers(count, Duration::ZERO)?,
            None => false,
        };
        Ok(over_shm || self.dds.matched_subscriptions() >= count)
    }

    /// Publishes a message to those who have subscribed.
    pub(crate) fn publish(&mut self, message: Message<'_>) -> Result<(), NodeError> {
        if let Some(states) = &mut self.states {
            let (header, bodies) = states::state(&message)?;
            states
                .publisher(self.dds.topic(), bodies.len())?
                .send(header, &bodies)?;
        }
        if !self.durable && self.dds.matched_subscriptions() == 0 {
            return Ok(());
        }
        let data = cdr::completed(&message.topic.type_hash, message.data);
        let sent = match self.delivery {
            Delivery::Lossless { patience } => self.dds.publish_lossless(data, patience),
            Delivery::DropNewest => self.dds.publish(data),
        };
        if let Err(error) = sent
            && self
                .complained
                .is_none_or(|when| when.elapsed() >= COMPLAINT)
        {
            self.complained = Some(Instant::now());
            warn!("{error}");
        }
        Ok(())
    }

    /// Waits for the acknowledgments.
    pub(crate) fn settle(&self) {
        if let Err(error) = self.dds.flush(PATIENCE) {
            warn!("{error}");
        }
    }
}

impl States {
    /// The publisher, with room for so many bodies at least. Where it was made for fewer it is made anew, and subscribers
    /// are given the time to connect to it; they get what the old one has sent.
    fn publisher(&mut self, topic: &str, bodies: usize) -> Result<&mut StatePublisher, NodeError> {
        if bodies > self.bodies {
            self.bodies = bodies;
            self.retire();
        }
        let anew = std::mem::take(&mut self.anew);
        let publisher = match &mut self.publisher {
            Some(publisher) => publisher,
            none => none.insert(
                self.shm
                    .state_publisher(topic, self.bodies, self.delivery)?,
            ),
        };
        if anew && publisher.subscribers() > 0 {
            publisher.wait_for_subscribers(1, Duration::ZERO)?;
            std::thread::sleep(CONNECT);
        }
        Ok(publisher)
    }

    fn deliver(&mut self, delivery: Delivery) {
        self.delivery = delivery;
        if let Some(publisher) = &self.publisher {
            publisher.deliver(delivery);
        }
    }

    /// Makes room for another publisher: a topic has one of states at a time.
    fn retire(&mut self) {
        self.anew |= self.publisher.take().is_some();
    }
}
