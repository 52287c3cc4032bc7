//! Messages of latched topics that are repeated at the head of a further file, and the record that marks them.

use std::collections::BTreeMap;

use mcap::records::{MessageHeader, Metadata};

use super::LIMIT;
use crate::REPEATED;

/// A message that is held back.
pub(super) type Held = (MessageHeader, Vec<u8>);

/// The head of a file. It is held until it is known which of its messages the recovered bag has already: readers pass
/// over those that are marked, and the others are the only ones left of those that were lost.
pub(super) struct Repeated {
    /// Still to come, by topic.
    expected: BTreeMap<String, u64>,
    /// Messages that the bag has already, by topic.
    pub found: BTreeMap<String, u64>,
    /// All of them have one log time.
    log_time: Option<u64>,
    /// Messages that the bag has already. They come first, as the first ones of each topic are marked by their number.
    pub marked: Vec<Held>,
    pub others: Vec<Held>,
    bytes: usize,
}

impl Repeated {
    pub fn new(mut expected: BTreeMap<String, u64>) -> Self {
        expected.retain(|_, count| *count > 0);
        Self {
            expected,
            found: BTreeMap::new(),
            log_time: None,
            marked: Vec::new(),
            others: Vec::new(),
            bytes: 0,
        }
    }

    /// Holds a message of the head, which the bag may have already; no if the head is over.
    pub fn take(
        &mut self,
        topic: &str,
        header: MessageHeader,
        data: &[u8],
        is_known: bool,
    ) -> bool {
        let time = *self.log_time.get_or_insert(header.log_time);
        if self.expected.is_empty() || header.log_time != time || self.bytes + data.len() > LIMIT {
            return false;
        }
        let mut is_repeated = false;
        if let Some(count) = self.expected.get_mut(topic) {
            is_repeated = true;
            *count -= 1;
            if *count == 0 {
                self.expected.remove(topic);
            }
        }
        let held = if is_repeated && is_known {
            *self.found.entry(topic.to_owned()).or_default() += 1;
            &mut self.marked
        } else {
            &mut self.others
        };
        self.bytes += data.len() + size_of::<Held>();
        held.push((header, data.to_vec()));
        true
    }

    /// The record that marks those which the bag has already; none if there are none.
    pub fn record(&self) -> Option<Metadata> {
        let counts = self.found.iter();
        (!self.found.is_empty()).then(|| Metadata {
            name: REPEATED.to_owned(),
            metadata: counts
                .map(|(topic, count)| (topic.clone(), count.to_string()))
                .collect(),
        })
    }
}
