//! What late joiners of latched topics would get, kept to be repeated at the head of the next file.

use std::collections::VecDeque;

use crate::Topic;

/// Messages of one topic that are kept at most, of all its publishers.
const MOST: usize = 1000;

/// A message without topic, publisher and log time.
pub(crate) struct Kept {
    pub publish_time: u64,
    pub sequence: u32,
    pub data: Vec<u8>,
}

/// The last messages of each latched topic, by the order in which topics were added.
pub(crate) struct Latched {
    topics: Vec<Option<Last>>,
    bytes: usize,
    /// Most `bytes` of all topics together.
    limit: usize,
}

struct Last {
    /// Of each publisher.
    depth: usize,
    /// With their publishers.
    messages: VecDeque<(u128, Kept)>,
}

impl Latched {
    pub fn new(limit: usize) -> Self {
        Self {
            topics: Vec::new(),
            bytes: 0,
            limit,
        }
    }

    pub fn add_topic(&mut self, topic: &Topic) {
        self.topics.push(topic.is_latched().then(|| Last {
            depth: topic.qos.assumed_depth() as usize,
            messages: VecDeque::new(),
        }));
    }

    /// Keeps a message if its topic is latched, in place of the publisher's oldest where it has as many as it keeps. Where
    /// there is no room, older messages of the topic give way, and one that is too long by itself is not kept.
    pub fn push(&mut self, topic: usize, publisher: u128, kept: Kept) {
        let Some(Some(last)) = self.topics.get_mut(topic) else {
            return;
        };
        let messages = &mut last.messages;
        let of_publisher = |(other, _): &(u128, Kept)| *other == publisher;
        let known = messages.iter().filter(|other| of_publisher(other)).count();
        let superseded = if known >= last.depth {
            let oldest = messages.iter().position(of_publisher);
            oldest.and_then(|oldest| messages.remove(oldest))
        } else if messages.len() >= MOST {
            messages.pop_front()
        } else {
            None
        };
        self.bytes -= superseded.map_or(0, |(_, kept)| kept.data.len());
        let length = kept.data.len();
        while self.bytes + length > self.limit {
            let Some((_, older)) = messages.pop_front() else {
                return;
            };
            self.bytes -= older.data.len();
        }
        self.bytes += length;
        messages.push_back((publisher, kept));
    }

    /// Forgets all messages.
    pub fn clear(&mut self) {
        self.bytes = 0;
        for last in self.topics.iter_mut().flatten() {
            last.messages.clear();
        }
    }

    /// Whether messages of the topic are kept.
    pub fn keeps(&self, topic: usize) -> bool {
        self.last(topic).is_some()
    }

    /// The topic's messages that are kept, oldest first.
    pub fn messages(&self, topic: usize) -> impl Iterator<Item = &Kept> {
        let messages = self.last(topic).into_iter().flat_map(|last| &last.messages);
        messages.map(|(_, kept)| kept)
    }

    fn last(&self, topic: usize) -> Option<&Last> {
        self.topics.get(topic)?.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Durability, Qos};

    fn latched(limit: usize, depths: &[u32]) -> Latched {
        let mut latched = Latched::new(limit);
        let topic = |qos| Topic {
            name: "/topic".to_owned(),
            type_name: "std_msgs/msg/String".to_owned(),
            type_hash: String::new(),
            definition: String::new(),
            definition_encoding: crate::ROS2MSG.to_owned(),
            qos,
        };
        for &depth in depths {
            latched.add_topic(&topic(Qos {
                durability: Durability::TransientLocal,
                depth,
                ..Qos::default()
            }));
        }
        latched.add_topic(&topic(Qos::default()));
        latched
    }

    fn message(sequence: u32, length: usize) -> Kept {
        Kept {
            publish_time: 0,
            sequence,
            data: vec![0; length],
        }
    }

    /// Topics of which messages are kept, with those.
    fn kept(latched: &Latched) -> Vec<(usize, Vec<u32>)> {
        let sequences = |topic| latched.messages(topic).map(|kept| kept.sequence).collect();
        let topics = (0..latched.topics.len()).map(|topic| (topic, sequences(topic)));
        topics
            .filter(|(_, sequences): &(_, Vec<_>)| !sequences.is_empty())
            .collect()
    }

    #[test]
    fn depth_is_respected_and_at_least_one() {
        let mut latched = latched(usize::MAX, &[0, 1, 3]);
        for sequence in 0..5 {
            for topic in 0..4 {
                latched.push(topic, 0, message(sequence, 10));
            }
        }
        assert_eq!(
            kept(&latched),
            [(0, vec![4]), (1, vec![4]), (2, vec![2, 3, 4])]
        );
        assert_eq!(latched.bytes, 50);
    }

    #[test]
    fn each_publisher_has_its_depth() {
        let mut latched = latched(usize::MAX, &[2]);
        for (publisher, sequence) in [(1, 0), (2, 1), (1, 2), (3, 3), (1, 4), (1, 5)] {
            latched.push(0, publisher, message(sequence, 10));
        }
        assert_eq!(kept(&latched), [(0, vec![1, 3, 4, 5])]);
        assert_eq!(latched.bytes, 40);
        for publisher in 10..2000 {
            latched.push(0, publisher, message(7, 10));
        }
        assert_eq!(kept(&latched)[0].1.len(), MOST);
    }

    #[test]
    fn bytes_are_bounded() {
        let mut latched = latched(100, &[10, 10]);
        latched.push(0, 0, message(0, 40));
        for sequence in 1..4 {
            latched.push(1, 0, message(sequence, 30));
        }
        assert_eq!(kept(&latched), [(0, vec![0]), (1, vec![2, 3])]);
        // An old message is not repeated in place of a new one that is too long.
        latched.push(1, 0, message(4, 61));
        assert_eq!(kept(&latched), [(0, vec![0])]);
        assert_eq!(latched.bytes, 40);
        latched.push(1, 0, message(5, 60));
        assert_eq!(kept(&latched), [(0, vec![0]), (1, vec![5])]);
        assert_eq!(latched.bytes, 100);
    }
}
