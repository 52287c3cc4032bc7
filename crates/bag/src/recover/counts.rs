//! Messages of a file, counted.

use std::collections::BTreeMap;

/// What a file adds to a bag.
#[derive(Default)]
pub(super) struct Counts {
    /// Messages of each channel.
    pub messages: BTreeMap<u16, u64>,
    total: u64,
    /// First and last log time (ns).
    pub times: Option<(u64, u64)>,
}

impl Counts {
    pub fn add(&mut self, channel: u16, log_time: u64) {
        *self.messages.entry(channel).or_default() += 1;
        self.total += 1;
        let (first, last) = self.times.unwrap_or((log_time, log_time));
        self.times = Some((first.min(log_time), last.max(log_time)));
    }

    pub fn total(&self) -> u64 {
        self.total
    }
}
