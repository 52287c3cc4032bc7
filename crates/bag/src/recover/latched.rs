//! Messages of latched topics, which further files of a bag repeat at their heads.

use std::collections::{BTreeMap, BTreeSet};

use mcap::records::{MessageHeader, Metadata};

use super::LIMIT;
use crate::REPEATED;

/// Largest number of messages that are remembered.
const MOST: usize = 1 << 20;

/// A message and its header.
pub(super) type Held = (MessageHeader, Vec<u8>);

/// What identifies a message wherever it stands: publish time, sequence number, length and checksum.
type Identity = (u64, u32, usize, u32);

/// The messages of latched topics that the recovered bag holds.
#[derive(Default)]
pub(super) struct Latched {
    topics: BTreeMap<String, BTreeSet<Identity>>,
    count: usize,
}

impl Latched {
    pub fn add(&mut self, topic: &str, header: &MessageHeader, data: &[u8]) {
        if self.count < MOST {
            let known = self.topics.entry(topic.to_owned()).or_default();
            self.count += usize::from(known.insert(identity(header, data)));
        }
    }

    fn contains(&self, topic: &str, (header, data): &Held) -> bool {
        let known = self.topics.get(topic);
        known.is_some_and(|known| known.contains(&identity(header, data)))
    }
}

fn identity(header: &MessageHeader, data: &[u8]) -> Identity {
    let MessageHeader {
        publish_time,
        sequence,
        ..
    } = *header;
    (publish_time, sequence, data.len(), crc32fast::hash(data))
}

/// The repeated messages at the head of a file. They are held until it is known which of them the recovered bag has
/// already: these are marked and readers pass over them. The others are all that is left of messages that were lost.
#[derive(Default)]
pub(super) struct Head {
    /// Number of repeated messages still to come, by topic.
    expected: BTreeMap<String, u64>,
    log_time: Option<u64>,
    bytes: usize,
    /// Number of marked messages by topic.
    counts: BTreeMap<String, u64>,
    marked: Vec<Held>,
    others: Vec<Held>,
}

impl Head {
    pub fn new(mut expected: BTreeMap<String, u64>) -> Self {
        expected.retain(|_, count| *count > 0);
        Self {
            expected,
            ..Self::default()
        }
    }

    /// Holds a message of the head. Gives it back if the head is over.
    pub fn hold(&mut self, topic: &str, message: Held, latched: &Latched) -> Option<Held> {
        let time = *self.log_time.get_or_insert(message.0.log_time);
        let length = message.1.len() + size_of::<Held>();
        if self.expected.is_empty() || message.0.log_time != time || self.bytes + length > LIMIT {
            return Some(message);
        }
        self.bytes += length;
        let Some(left) = self.expected.get_mut(topic) else {
            self.others.push(message);
            return None;
        };
        *left -= 1;
        if *left == 0 {
            self.expected.remove(topic);
        }
        if latched.contains(topic, &message) {
            *self.counts.entry(topic.to_owned()).or_default() += 1;
            self.marked.push(message);
        } else {
            self.others.push(message);
        }
        None
    }

    /// The record that marks messages, if there are any, and all messages, the marked ones first.
    pub fn finish(self) -> (Option<Metadata>, impl Iterator<Item = Held>) {
        let counts = self.counts.iter();
        let record = (!self.counts.is_empty()).then(|| Metadata {
            name: REPEATED.to_owned(),
            metadata: counts
                .map(|(topic, count)| (topic.clone(), count.to_string()))
                .collect(),
        });
        (record, self.marked.into_iter().chain(self.others))
    }
}
