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
