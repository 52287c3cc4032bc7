//! The samples of a subscription that have arrived and wait to be taken.

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    fmt,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError, Weak,
        atomic::{AtomicBool, Ordering},
    },
    task::{Context, Poll, Wake, Waker},
};

use rustdds::{
    GUID, Timestamp,
    no_key::{DeserializedCacheChange, SimpleDataReader},
};

use super::cdr::CdrBytes;
use crate::ros::{Sample, SampleId, SampleInfo, TakeError, WriterId};

type Taken = Result<Sample<Vec<u8>>, TakeError>;

/// A DDS reader and what has been taken from it.
///
/// RustDDS 0.15 acknowledges samples that nobody has taken, and forgets them when their writer leaves. So they are taken
/// on its own thread as they arrive, before they are acknowledged; those that arrive before the waker is set again, by
/// the background thread some microseconds later, are taken there.
pub(super) struct Inbox {
    reader: SimpleDataReader<Vec<u8>, CdrBytes>,
    topic: String,
    depth: usize,
    arrival: Arc<Arrival>,
    /// Held by the one thread that takes, so that samples stay in order.
    turn: Mutex<()>,
    contents: Mutex<Contents>,
}

#[derive(Default)]
struct Contents {
    waiting: VecDeque<Taken>,
    taker: Option<Waker>,
    latest: BTreeMap<GUID, Latest>,
    received: u64,
    lost: u64,
}

/// The last sample of a publisher.
#[derive(Clone, Copy)]
struct Latest {
    sequence: i64,
    received: Timestamp,
}

/// Called by RustDDS once something has arrived.
struct Arrival {
    inbox: Weak<Inbox>,
    /// Whether the waker is to be set again.
    noticed: AtomicBool,
    background: Mutex<Option<Waker>>,
}

impl Wake for Arrival {
    fn wake(self: Arc<Self>) {
        self.wake_by_ref();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        if let Some(inbox) = self.inbox.upgrade() {
            inbox.empty_reader();
        }
        self.noticed.store(true, Ordering::Release);
        if let Some(waker) = &*lock(&self.background) {
            waker.wake_by_ref();
        }
    }
}

impl Inbox {
    pub(super) fn new(
        reader: SimpleDataReader<Vec<u8>, CdrBytes>,
        topic: String,
        depth: usize,
    ) -> Arc<Self> {
        Arc::new_cyclic(|inbox| Self {
            reader,
            topic,
            depth,
            arrival: Arc::new(Arrival {
                inbox: Weak::clone(inbox),
                noticed: AtomicBool::new(true),
                background: Mutex::new(None),
            }),
            turn: Mutex::new(()),
            contents: Mutex::default(),
        })
    }

    pub(super) fn guid(&self) -> GUID {
        self.reader.guid()
    }

    pub(super) fn topic(&self) -> &str {
        &self.topic
    }

    /// Samples that have arrived.
    pub(super) fn received(&self) -> u64 {
        lock(&self.contents).received
    }

    /// Samples that were sent after the first one of their publisher and will never be taken.
    pub(super) fn lost(&self) -> u64 {
        lock(&self.contents).lost
    }

    /// The publishers of which the last sample is remembered.
    pub(super) fn publishers(&self) -> BTreeSet<GUID> {
        lock(&self.contents).latest.keys().copied().collect()
    }

    /// Forgets the last sample of a publisher that is gone.
    pub(super) fn forget(&self, publisher: GUID) {
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

    /// Takes what has arrived from DDS, and sets the waker again, which wakes `background` to do so the next time.
    pub(super) fn fill(&self, background: &Waker) {
        if !self.arrival.noticed.swap(false, Ordering::Acquire) {
            return;
        }
        *lock(&self.arrival.background) = Some(background.clone());
        self.reader
            .set_waker(Some(Waker::from(Arc::clone(&self.arrival))));
        self.empty_reader();
    }

    fn empty_reader(&self) {
        let _turn = lock(&self.turn);
        while let Some(taken) = self.reader.try_take_one().transpose() {
            self.put(taken.map_err(|error| TakeError::Wire {
                topic: self.topic.clone(),
                reason: error.to_string(),
            }));
        }
    }

    fn put(&self, arrived: Result<DeserializedCacheChange<Vec<u8>>, TakeError>) {
        let mut contents = lock(&self.contents);
        let arrived = arrived.map(|change| {
            contents.received += 1;
            let received = contents.follow(&change);
            sample(change, received)
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

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Contents {
    /// Counts the gap before a sample; when it was received.
    fn follow(&mut self, change: &DeserializedCacheChange<Vec<u8>>) -> Timestamp {
        let sequence = i64::from(change.sequence_number);
        let mut received = change.receive_instant;
        if let Some(previous) = self.latest.get(&change.writer_guid()) {
            let gap = sequence.saturating_sub(previous.sequence).saturating_sub(1);
            self.lost = self.lost.saturating_add(u64::try_from(gap).unwrap_or(0));
            // What follows a sample that is sent again has arrived before it, and waited for it.
            received = received.max(previous.received);
        }
        let latest = Latest { sequence, received };
        self.latest.insert(change.writer_guid(), latest);
        received
    }
}

fn sample(change: DeserializedCacheChange<Vec<u8>>, received: Timestamp) -> Sample<Vec<u8>> {
    Sample {
        info: SampleInfo {
            writer: WriterId(change.writer_guid().to_bytes()),
            sequence: i64::from(change.sequence_number).unsigned_abs(),
            source_time: change.source_timestamp().and_then(nanoseconds),
            received_time: nanoseconds(received).unwrap_or_default(),
            related: change.related_sample_identity().map(SampleId::from),
        },
        message: change.into_value(),
    }
}

/// RTPS time counts 2⁻³² s since the UNIX epoch.
pub(super) fn nanoseconds(time: Timestamp) -> Option<i64> {
    if time == Timestamp::INVALID || time == Timestamp::INFINITE {
        return None;
    }
    let nanoseconds = (u128::from(time.to_ticks()) * 1_000_000_000) >> 32;
    i64::try_from(nanoseconds).ok()
}

impl fmt::Debug for Inbox {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Inbox")
            .field("topic", &self.topic)
            .field("lost", &self.lost())
            .finish_non_exhaustive()
    }
}
