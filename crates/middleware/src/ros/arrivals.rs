//! Samples that have arrived and wait to be taken, and the account of those that are lost.

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    sync::Mutex,
    task::{Context, Poll, Waker},
};

use super::{Sample, TakeError, WriterId};
use crate::sync::lock;

type Taken = Result<Sample<Vec<u8>>, TakeError>;

/// The number of a sample that its publisher did not number; it gets the number after the previous one.
pub(super) const UNNUMBERED: u64 = 0;

/// A queue of samples: the oldest make room for the newest.
pub(super) struct Arrivals {
    depth: usize,
    contents: Mutex<Contents>,
}

#[derive(Default)]
struct Contents {
    waiting: VecDeque<Taken>,
    taker: Option<Waker>,
    latest: BTreeMap<WriterId, Latest>,
    received: u64,
    lost: u64,
}

/// The last sample of a publisher.
#[derive(Clone, Copy)]
struct Latest {
    sequence: u64,
    received: i64,
}

impl Arrivals {
    pub(super) fn new(depth: usize) -> Self {
        Self {
            depth,
            contents: Mutex::default(),
        }
    }

    /// Samples that have arrived.
    pub(super) fn received(&self) -> u64 {
        lock(&self.contents).received
    }

    /// Samples that were sent after the first one of their publisher and will never be taken.
    pub(super) fn lost(&self) -> u64 {
        lock(&self.contents).lost
    }

    /// The number of a publisher's last sample, 0 before its first.
    #[cfg(feature = "zenoh")]
    pub(super) fn latest(&self, publisher: WriterId) -> u64 {
        let contents = lock(&self.contents);
        let latest = contents.latest.get(&publisher);
        latest.map_or(0, |latest| latest.sequence)
    }

    /// The publishers of which the last sample is remembered.
    pub(super) fn publishers(&self) -> BTreeSet<WriterId> {
        lock(&self.contents).latest.keys().copied().collect()
    }

    /// Forgets the last sample of a publisher that is gone.
    pub(super) fn forget(&self, publisher: WriterId) {
        lock(&self.contents).latest.remove(&publisher);
    }

    pub(super) fn take(&self) -> Option<Taken> {
        lock(&self.contents).waiting.pop_front()
    }

    pub(super) fn poll_take(&self, context: &Context<'_>) -> Poll<Taken> {
        let mut contents = lock(&self.contents);
        match contents.waiting.pop_front() {
            Some(taken) => Poll::Ready(taken),
            None => {
                contents.taker = Some(context.waker().clone());
                Poll::Pending
            }
        }
    }

    /// Adds what has arrived, and wakes who waits for it.
    pub(super) fn put(&self, arrived: Taken) {
        let mut contents = lock(&self.contents);
        let arrived = arrived.map(|mut sample| {
            contents.received += 1;
            contents.follow(&mut sample);
            sample
        });
        if contents.waiting.len() >= self.depth {
            contents.waiting.pop_front();
            contents.lost += 1;
        }
        contents.waiting.push_back(arrived);
        if let Some(taker) = contents.taker.take() {
            drop(contents);
            taker.wake();
        }
    }
}

impl Contents {
    /// Counts the gap before a sample.
    fn follow(&mut self, sample: &mut Sample<Vec<u8>>) {
        let info = &mut sample.info;
        if info.sequence == UNNUMBERED {
            let previous = self.latest.get(&info.writer);
            info.sequence = previous.map_or(1, |previous| previous.sequence + 1);
        }
        if let Some(previous) = self.latest.get(&info.writer) {
            let gap = info.sequence.saturating_sub(previous.sequence);
            self.lost = self.lost.saturating_add(gap.saturating_sub(1));
            // What follows a sample that is sent again has arrived before it, and waited for it.
            info.received_time = info.received_time.max(previous.received);
        }
        let latest = Latest {
            sequence: info.sequence,
            received: info.received_time,
        };
        self.latest.insert(info.writer, latest);
    }
}
