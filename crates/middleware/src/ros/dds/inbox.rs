//! The samples of a subscription that have arrived and wait to be taken.

use std::{
    sync::{
        Arc, Mutex, Weak,
        atomic::{AtomicBool, Ordering},
    },
    task::{Wake, Waker},
};

use rustdds::{
    Timestamp,
    no_key::{DeserializedCacheChange, SimpleDataReader},
};

use super::cdr::CdrBytes;
use crate::{
    ros::{Sample, SampleId, SampleInfo, TakeError, WriterId, arrivals::Arrivals},
    sync::lock,
};

/// A DDS reader and what has been taken from it.
///
/// RustDDS 0.15 acknowledges samples that nobody has taken, and forgets them when their writer leaves. So they are taken
/// on its own thread as they arrive, before they are acknowledged; those that arrive before the waker is set again, by
/// the background thread some microseconds later, are taken there.
pub(super) struct Inbox {
    reader: SimpleDataReader<Vec<u8>, CdrBytes>,
    topic: String,
    arrivals: Arrivals,
    arrival: Arc<Arrival>,
    /// Held by the one thread that takes, so that samples stay in order.
    turn: Mutex<()>,
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
            arrivals: Arrivals::new(depth),
            arrival: Arc::new(Arrival {
                inbox: Weak::clone(inbox),
                noticed: AtomicBool::new(true),
                background: Mutex::new(None),
            }),
            turn: Mutex::new(()),
        })
    }

    pub(super) fn arrivals(&self) -> &Arrivals {
        &self.arrivals
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
            self.arrivals
                .put(taken.map(sample).map_err(|error| TakeError::Wire {
                    topic: self.topic.clone(),
                    reason: error.to_string(),
                }));
        }
    }
}

fn sample(change: DeserializedCacheChange<Vec<u8>>) -> Sample<Vec<u8>> {
    Sample {
        info: SampleInfo {
            writer: WriterId(change.writer_guid().to_bytes()),
            sequence: i64::from(change.sequence_number).unsigned_abs(),
            source_time: change.source_timestamp().and_then(nanoseconds),
            received_time: nanoseconds(change.receive_instant).unwrap_or_default(),
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
