//! Which messages of latched topics the recovered bag has: further files repeat them.

use std::collections::{BTreeMap, VecDeque};

use mcap::records::MessageHeader;

use super::LIMIT;
use crate::{Durability, Qos, channel_key, records::Channel};

/// Most identities of all topics together, and of one: topics that are streams may be kept for late joiners too.
const MOST: usize = LIMIT / (2 * size_of::<Identity>());
const MOST_OF_TOPIC: usize = MOST / 16;

/// What is the same wherever a message stands.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Identity {
    publish_time: u64,
    sequence: u32,
    length: usize,
    checksum: u32,
}

impl Identity {
    pub fn new(header: &MessageHeader, data: &[u8]) -> Self {
        Self {
            publish_time: header.publish_time,
            sequence: header.sequence,
            length: data.len(),
            checksum: crc32fast::hash(data),
        }
    }
}

/// The last messages of each latched topic.
pub(super) struct Identities {
    topics: BTreeMap<String, Last>,
    count: usize,
    /// Most of all topics.
    most: usize,
}

impl Default for Identities {
    fn default() -> Self {
        Self {
            topics: BTreeMap::new(),
            count: 0,
            most: MOST,
        }
    }
}

#[derive(Default)]
struct Last {
    order: VecDeque<Identity>,
    /// How often each stands in `order`.
    known: BTreeMap<Identity, u32>,
}

impl Identities {
    /// Adds the topic of a channel; whether it is a latched one.
    pub fn add_topic(&mut self, channel: &Channel) -> bool {
        let offered = channel.metadata.get(channel_key::QOS);
        let qos = offered.and_then(|text| Qos::from_yaml(text).ok());
        let latched = qos.is_some_and(|qos| qos.durability == Durability::TransientLocal);
        if latched {
            self.topics.entry(channel.topic.clone()).or_default();
        }
        latched
    }

    /// Takes note of a message, in place of the oldest of its topic where there are too many. One that stands in the bag
    /// again, as a repeated one, becomes the newest.
    pub fn add(&mut self, topic: &str, identity: Identity) {
        let Some(last) = self.topics.get_mut(topic) else {
            return;
        };
        *last.known.entry(identity).or_default() += 1;
        last.order.push_back(identity);
        self.count += 1;
        if (self.count > self.most || last.order.len() > MOST_OF_TOPIC)
            && let Some(oldest) = last.order.pop_front()
        {
            self.count -= 1;
            if let Some(times) = last.known.get_mut(&oldest) {
                *times -= 1;
                if *times == 0 {
                    last.known.remove(&oldest);
                }
            }
        }
    }

    pub fn contain(&self, topic: &str, identity: Identity) -> bool {
        let last = self.topics.get(topic);
        last.is_some_and(|last| last.known.contains_key(&identity))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_messages_of_latched_topics_are_known() {
        let mut identities = Identities {
            most: 6,
            ..Identities::default()
        };
        let mut add_topic = |topic: &str, durability| {
            let qos = Qos {
                durability,
                ..Qos::default()
            };
            identities.add_topic(&Channel {
                id: 0,
                schema: 0,
                topic: topic.to_owned(),
                encoding: String::new(),
                metadata: BTreeMap::from([(channel_key::QOS.to_owned(), qos.to_yaml().unwrap())]),
            })
        };
        assert!(add_topic("/latched", Durability::TransientLocal));
        assert!(add_topic("/other", Durability::TransientLocal));
        assert!(!add_topic("/volatile", Durability::Volatile));
        let identity = |sequence| Identity {
            publish_time: 0,
            sequence,
            length: 1,
            checksum: 0,
        };
        identities.add("/other", identity(0));
        for sequence in [0, 1, 2, 3, 4, 1, 5, 6, 7] {
            for topic in ["/latched", "/volatile"] {
                identities.add(topic, identity(sequence));
            }
        }
        let known = |topic| {
            let all = 0..9;
            let known = all.filter(|&sequence| identities.contain(topic, identity(sequence)));
            known.collect::<Vec<_>>()
        };
        assert_eq!(known("/latched"), [1, 4, 5, 6, 7]);
        assert_eq!(known("/other"), [0]);
        assert!(known("/volatile").is_empty());
        assert_eq!(identities.count, 6);
    }
}
