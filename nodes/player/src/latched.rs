//! What late joiners would have got at a time: the latched messages before it.

use std::collections::{BTreeMap, VecDeque};

use lgvi_bag::BagReader;
use lgvi_middleware::node::NodeError;

use crate::depths::BYTES;
use crate::reel::{self, Shown};

/// When messages of a bag's latched topics were recorded, and how long they are.
///
/// Only that is kept, of the part of the bag that has been read for it: what lies before a time is read once, when it is
/// first asked for.
pub(crate) struct Latched {
    /// For each of the bag's topics, how many messages late joiners get; 0 unless it is latched and played.
    depths: Vec<usize>,
    /// Which of them are not 0.
    latched: Vec<bool>,
    /// In their order.
    known: Vec<Known>,
    /// All before this time (ns) are known.
    read: u64,
}

struct Known {
    time: u64,
    topic: usize,
    length: usize,
}

impl Latched {
    /// Of the topics that are played, each of which keeps so many messages.
    pub(crate) fn new(bag: &BagReader, wanted: &[bool], depths: &[usize]) -> Self {
        let topics = bag.topics().iter().zip(wanted);
        let latched: Vec<bool> = topics
            .map(|(topic, &wanted)| wanted && topic.is_latched())
            .collect();
        let depths = depths.iter().zip(&latched);
        Self {
            depths: depths
                .map(|(&depth, &latched)| if latched { depth } else { 0 })
                .collect(),
            latched,
            known: Vec::new(),
            read: 0,
        }
    }

    /// The latched messages before a time (ns), of each topic the last as many as it keeps, in their order.
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
        let mut found = Vec::new();
        for (time, topics) in self.last(time) {
            let mut wanted = BTreeMap::<usize, usize>::new();
            for topic in topics {
                *wanted.entry(topic).or_default() += 1;
            }
            let mut at_once = VecDeque::new();
            for message in reel::chosen(bag, time, &self.latched) {
                let message = message.map_err(NodeError::input)?;
                if message.log_time > time {
                    break;
                }
                let topic = message.topic_index;
                at_once.push_back(Shown { topic, message });
            }
            // Of several at one time the last ones are wanted.
            let mut kept = VecDeque::new();
            while let Some(shown) = at_once.pop_back() {
                if let Some(left) = wanted.get_mut(&shown.topic).filter(|left| **left > 0) {
                    *left -= 1;
                    kept.push_front(shown);
                }
            }
            found.extend(kept);
        }
        Ok(found)
    }

    /// Of each topic the last messages before a time (ns), by their times.
    fn last(&self, time: u64) -> BTreeMap<u64, Vec<usize>> {
        let mut last = BTreeMap::<u64, Vec<usize>>::new();
        let mut left = self.depths.clone();
        let mut room = vec![BYTES; left.len()];
        let end = self.known.partition_point(|known| known.time < time);
        for known in self.known[..end].iter().rev() {
            let (left, room) = (&mut left[known.topic], &mut room[known.topic]);
            if *left == 0 {
                continue;
            }
            let is_last = *left == self.depths[known.topic];
            if known.length > *room && !is_last {
                *left = 0;
                continue;
            }
            *left -= 1;
            *room = room.saturating_sub(known.length);
            last.entry(known.time).or_default().push(known.topic);
        }
        last
    }

    /// Reads on until a time (ns).
    fn learn(
        &mut self,
        bag: &BagReader,
        time: u64,
        interrupted: impl Fn() -> bool,
    ) -> Result<(), NodeError> {
        if !self.latched.contains(&true) || self.read >= time {
            return Ok(());
        }
        let known = self.known.len();
        for message in reel::chosen(bag, self.read, &self.latched) {
            let message = message.map_err(NodeError::input)?;
            if message.log_time >= time {
                break;
            }
            if interrupted() {
                self.known.truncate(known);
                return Err(NodeError::Interrupted);
            }
            self.known.push(Known {
                time: message.log_time,
                topic: message.topic_index,
                length: message.data.len(),
            });
        }
        self.read = time;
        Ok(())
    }
}
