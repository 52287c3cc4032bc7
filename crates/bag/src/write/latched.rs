//! What late joiners of latched topics would get, kept to be repeated at the head of the next file.

use std::collections::VecDeque;

use mcap::records::MessageHeader;

use crate::Topic;

/// Messages of one topic that are kept at most, of all its publishers.
const MOST: usize = 1000;

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
    messages: VecDeque<Kept>,
}

struct Kept {
    publisher: u128,
    header: MessageHeader,
    data: Vec<u8>,
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
    pub fn push(&mut self, topic: usize, publisher: u128, header: &MessageHeader, data: &[u8]) {
        let Some(Some(Last { depth, messages })) = self.topics.get_mut(topic) else {
            return;
        };
        let of_publisher = |kept: &&Kept| kept.publisher == publisher;
        let superseded = if messages.iter().filter(of_publisher).count() >= *depth {
            let oldest = messages.iter().position(|kept| of_publisher(&kept));
            oldest.and_then(|oldest| messages.remove(oldest))
        } else if messages.len() >= MOST {
            messages.pop_front()
        } else {
            None
        };
        self.bytes -= superseded.map_or(0, |kept| kept.data.len());
        while self.bytes + data.len() > self.limit {
            let Some(older) = messages.pop_front() else {
                return;
            };
            self.bytes -= older.data.len();
        }
        self.bytes += data.len();
        messages.push_back(Kept {
            publisher,
            header: *header,
            data: data.to_vec(),
        });
    }

    /// Keeps these messages, with the indices of their topics, in place of all others.
    pub fn replace(&mut self, messages: Vec<(usize, MessageHeader, Vec<u8>)>) {
        self.bytes = 0;
        for last in self.topics.iter_mut().flatten() {
            last.messages.clear();
        }
        // None takes the place of another: each is of a publisher of its own.
        for (publisher, (topic, header, data)) in (0..).zip(messages) {
            self.push(topic, publisher, &header, &data);
        }
    }

    /// The topic's messages that are kept, oldest first.
    pub fn messages(&self, topic: usize) -> impl Iterator<Item = (&MessageHeader, &[u8])> {
        let last = self.topics.get(topic).and_then(Option::as_ref);
        let messages = last.into_iter().flat_map(|last| &last.messages);
        messages.map(|kept| (&kept.header, &*kept.data))
    }
}
