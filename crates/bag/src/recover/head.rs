//! Messages of latched topics, which further files of a bag repeat at their heads.

use std::collections::{BTreeMap, BTreeSet};

use mcap::records::MessageHeader;

use crate::read::MAX_RECORD_LENGTH;

/// Largest number of messages that are remembered.
const MOST: usize = 1 << 20;

/// The messages of latched topics that the recovered bag holds, by what identifies them wherever they stand: topic,
/// publish time, sequence number, length and checksum.
#[derive(Default)]
pub(super) struct Known(BTreeSet<(String, u64, u32, usize, u32)>);

impl Known {
    pub fn add(&mut self, topic: &str, header: &MessageHeader, data: &[u8]) {
        if self.0.len() < MOST {
            self.0.insert(identity(topic, header, data));
        }
    }

    pub fn contains(&self, topic: &str, header: &MessageHeader, data: &[u8]) -> bool {
        self.0.contains(&identity(topic, header, data))
    }
}

fn identity(topic: &str, header: &MessageHeader, data: &[u8]) -> (String, u64, u32, usize, u32) {
    let MessageHeader {
        publish_time,
        sequence,
        ..
    } = *header;
    let checksum = crc32fast::hash(data);
    (
        topic.to_owned(),
        publish_time,
        sequence,
        data.len(),
        checksum,
    )
}

/// The repeated messages at the head of a file. They are held until all are there: those that the recovered bag has
/// already are repeated in its file too; the others are all that is left of messages that were lost.
pub(super) struct Head {
    /// Number of repeated messages still to come, by topic.
    expected: BTreeMap<String, u64>,
    log_time: Option<u64>,
    bytes: usize,
    pub messages: Vec<(MessageHeader, Vec<u8>)>,
}

impl Head {
    pub fn new(mut expected: BTreeMap<String, u64>) -> Self {
        expected.retain(|_, count| *count > 0);
        Self {
            expected,
            log_time: None,
            bytes: 0,
            messages: Vec::new(),
        }
    }

    /// Holds a message of the head. False if the head is over.
    pub fn hold(&mut self, topic: &str, header: &MessageHeader, data: &[u8]) -> bool {
        let time = *self.log_time.get_or_insert(header.log_time);
        self.bytes += data.len() + size_of::<MessageHeader>();
        let is_over = self.expected.is_empty() || self.bytes > MAX_RECORD_LENGTH;
        if is_over || header.log_time != time {
            return false;
        }
        if let Some(left) = self.expected.get_mut(topic) {
            *left -= 1;
            if *left == 0 {
                self.expected.remove(topic);
            }
        }
        self.messages.push((*header, data.to_vec()));
        true
    }
}
