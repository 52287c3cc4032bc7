//! What late joiners would have got at a time: the latched messages before it.

use std::collections::{BTreeMap, VecDeque};

use lgvi_bag::BagReader;
use lgvi_node::NodeError;

use crate::reel::{self, Shown};

/// When messages of a bag's latched topics were recorded.
///
/// Only their times are kept, of the part of the bag that has been read for it: what lies before a time is read once, when
/// it is first asked for.
pub(crate) struct Latched {
    /// For each of the bag's topics, how many messages late joiners get; 0 unless it is latched and played.
    depths: Vec<usize>,
    /// Time (ns) and topic of each, in their order.
    known: Vec<(u64, usize)>,
    /// All before this time (ns) are known.
    read: u64,
}

impl Latched {
    /// Of the topics that are played.
    pub(crate) fn new(bag: &BagReader, wanted: &[bool]) -> Self {
        let depths = bag.topics().iter().zip(wanted).map(|(topic, &wanted)| {
            if wanted && topic.is_latched() {
                topic.qos.assumed_depth() as usize
            } else {
                0
            }
        });
        Self {
            depths: depths.collect(),
            known: Vec::new(),
            read: 0,
        }
    }

    /// The latched messages before a time (ns), of each topic the last as many as its depth says, in their order.
    ///
    /// # Errors
    /// A message cannot be read, or `interrupted`.
    pub(crate) fn before<'a>(
        &mut self,
        bag: &'a BagReader,
        time: u64,
        interrupted: impl Fn() -> bool,
    ) -> Result<Vec<Shown<'a>>, NodeError> {
        self.learn(bag, time, interrupted)?;
        let mut wanted = BTreeMap::<u64, Vec<usize>>::new();
        let mut left = self.depths.clone();
        let end = self.known.partition_point(|&(known, _)| known < time);
        for &(time, topic) in self.known[..end].iter().rev() {
            if left[topic] > 0 {
                left[topic] -= 1;
                wanted.entry(time).or_default().push(topic);
            }
        }
        let mut found = Vec::new();
        for (time, mut topics) in wanted {
            let mut at_once = VecDeque::new();
            for message in bag.messages_from(time) {
                let message = message.map_err(NodeError::input)?;
                if message.log_time > time {
                    break;
                }
                let topic = reel::index(bag, &message);
                at_once.push_back(Shown { topic, message });
            }
            // Of several at one time the last ones are wanted.
            let mut kept = VecDeque::new();
            while let Some(shown) = at_once.pop_back() {
                if let Some(index) = topics.iter().position(|&topic| topic == shown.topic) {
                    topics.swap_remove(index);
                    kept.push_front(shown);
                }
            }
            found.extend(kept);
        }
        Ok(found)
    }

    /// Reads on until a time (ns).
    fn learn(
        &mut self,
        bag: &BagReader,
        time: u64,
        interrupted: impl Fn() -> bool,
    ) -> Result<(), NodeError> {
        if self.depths.iter().all(|&depth| depth == 0) {
            return Ok(());
        }
        if self.read < time {
            let known = self.known.len();
            for message in bag.messages_from(self.read) {
                let message = message.map_err(NodeError::input)?;
                if message.log_time >= time {
                    break;
                }
                if interrupted() {
                    self.known.truncate(known);
                    return Err(NodeError::Interrupted);
                }
                let topic = reel::index(bag, &message);
                if self.depths.get(topic).is_some_and(|&depth| depth > 0) {
                    self.known.push((message.log_time, topic));
                }
            }
            self.read = time;
        }
        Ok(())
    }
}
