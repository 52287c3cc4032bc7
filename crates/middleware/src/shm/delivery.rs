//! What is done about a subscriber whose buffer is full.

use std::{
    sync::{
        Mutex,
        atomic::{AtomicU64, AtomicUsize, Ordering},
    },
    time::Duration,
};

use iceoryx2::port::{BackpressureAction, BackpressureInfo};
use tracing::warn;

use crate::{Shutdown, sync::lock};

/// How long a subscriber is still waited for after the shutdown.
const FAREWELL: Duration = Duration::from_millis(100);

/// What a publisher does about a subscriber whose buffer is full.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delivery {
    /// Goes on without it: nothing ever waits.
    DropNewest,
    /// Waits for it, up to `patience`. If that was in vain, the subscriber is not waited for again until it has taken
    /// a sample, so that one that is stopped or was killed costs one wait.
    Lossless {
        /// The longest wait for one sample. Once the process is to end, it ends within 0.1 s; see
        /// [`ShmNode::leave_on`](super::ShmNode::leave_on).
        patience: Duration,
    },
}

impl Delivery {
    /// How long a subscriber is waited for (ns).
    fn patience(self) -> u64 {
        match self {
            Self::DropNewest => 0,
            Self::Lossless { patience } => u64::try_from(patience.as_nanos()).unwrap_or(u64::MAX),
        }
    }
}

/// How far a sample has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Delivered {
    /// Subscribers that have it.
    pub receivers: usize,
    /// Subscribers that had no room for it.
    pub refused: usize,
}

/// Decides for one publisher.
#[derive(Debug)]
pub(super) struct Backpressure {
    /// In nanoseconds; 0: nobody is waited for.
    patience: AtomicU64,
    shutdown: Shutdown,
    /// Which sample is being sent, and how many subscribers have refused it.
    sample: AtomicU64,
    refused: AtomicUsize,
    /// Subscribers that were waited for in vain, and the last sample each has refused.
    stalled: Mutex<Vec<(u128, u64)>>,
}

impl Backpressure {
    pub(super) fn new(delivery: Delivery, shutdown: Shutdown) -> Self {
        Self {
            shutdown,
            patience: AtomicU64::new(delivery.patience()),
            sample: AtomicU64::new(0),
            refused: AtomicUsize::new(0),
            stalled: Mutex::default(),
        }
    }

    /// Delivers otherwise from here on.
    pub(super) fn deliver(&self, delivery: Delivery) {
        self.patience.store(delivery.patience(), Ordering::Relaxed);
    }

    /// Begins a sample.
    pub(super) fn begin(&self) {
        self.sample.fetch_add(1, Ordering::Relaxed);
        self.refused.store(0, Ordering::Relaxed);
    }

    /// How many subscribers have refused the sample.
    pub(super) fn refused(&self) -> usize {
        self.refused.load(Ordering::Relaxed)
    }

    /// Called, again and again, while the buffer of one subscriber is full.
    pub(super) fn decide(&self, info: &BackpressureInfo) -> BackpressureAction {
        if self.must_wait(info.receiver_port_id, info.elapsed_time) {
            BackpressureAction::Retry
        } else {
            self.refused.fetch_add(1, Ordering::Relaxed);
            BackpressureAction::DiscardData
        }
    }

    /// Whether to wait for a subscriber that has been waited for this long.
    pub(super) fn must_wait(&self, receiver: u128, elapsed: Duration) -> bool {
        let patience = Duration::from_nanos(self.patience.load(Ordering::Relaxed));
        if patience.is_zero() {
            return false;
        }
        let sample = self.sample.load(Ordering::Relaxed);
        let mut stalled = lock(&self.stalled);
        if let Some(index) = stalled.iter().position(|(id, _)| *id == receiver) {
            let (_, last_refused) = &mut stalled[index];
            if *last_refused + 1 >= sample {
                *last_refused = sample;
                return false;
            }
            stalled.swap_remove(index);
        }
        let farewell = self.shutdown.elapsed();
        if elapsed < patience && farewell.is_none_or(|since| since < FAREWELL) {
            return true;
        }
        warn!(
            waited = ?elapsed,
            "a shared-memory subscriber takes no samples; going on without it"
        );
        stalled.push((receiver, sample));
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATIENCE: Duration = Duration::from_millis(10);

    fn backpressure(delivery: Delivery) -> Backpressure {
        Backpressure::new(delivery, Shutdown::new())
    }

    #[test]
    fn a_stalled_subscriber_is_waited_for_once_until_it_moves() {
        let backpressure = backpressure(Delivery::Lossless { patience: PATIENCE });
        backpressure.begin();
        assert!(backpressure.must_wait(1, Duration::ZERO));
        assert!(!backpressure.must_wait(1, PATIENCE));
        for _ in 0..3 {
            backpressure.begin();
            assert!(!backpressure.must_wait(1, Duration::ZERO));
            assert!(
                backpressure.must_wait(2, Duration::ZERO),
                "the other is waited for"
            );
        }
        backpressure.begin();
        backpressure.begin();
        assert!(
            backpressure.must_wait(1, Duration::ZERO),
            "it had room for the sample between: it is waited for again"
        );
    }

    #[test]
    fn after_the_shutdown_nobody_is_waited_for_much_longer() {
        let shutdown = Shutdown::new();
        let patience = Duration::from_secs(60);
        let backpressure = Backpressure::new(Delivery::Lossless { patience }, shutdown.clone());
        backpressure.begin();
        assert!(backpressure.must_wait(1, 2 * FAREWELL));
        shutdown.request();
        std::thread::sleep(FAREWELL);
        assert!(!backpressure.must_wait(1, 2 * FAREWELL));
    }

    #[test]
    fn what_is_delivered_otherwise_waits_otherwise() {
        let backpressure = backpressure(Delivery::Lossless { patience: PATIENCE });
        backpressure.begin();
        assert!(backpressure.must_wait(1, Duration::ZERO));
        backpressure.deliver(Delivery::DropNewest);
        assert!(!backpressure.must_wait(1, Duration::ZERO));
        backpressure.deliver(Delivery::Lossless { patience: PATIENCE });
        assert!(backpressure.must_wait(1, Duration::ZERO));
    }

    #[test]
    fn without_patience_nothing_waits() {
        let backpressure = backpressure(Delivery::DropNewest);
        backpressure.begin();
        assert!(!backpressure.must_wait(1, Duration::ZERO));
    }
}
