//! How long a node may keep its process from ending.

use std::{
    sync::{Mutex, OnceLock},
    thread,
    time::{Duration, Instant},
};

use crate::{Shutdown, sync::lock};

/// What all waits of a node may take together once its process is to end.
pub(super) const BUDGET: Duration = Duration::from_millis(300);

/// What one of them may take, so that one subscription that hangs leaves time for the others.
const SHARE: Duration = Duration::from_millis(100);

/// How often a wait looks whether the process is to end.
const LOOK: Duration = Duration::from_millis(10);

/// Bounds the waits of a node's endpoints for others, from the shutdown on.
#[derive(Debug, Default)]
pub(super) struct Farewell {
    shutdown: OnceLock<Shutdown>,
    /// What the waits of all endpoints have taken since.
    spent: Mutex<Duration>,
}

impl Farewell {
    /// Begins with `shutdown`; the first call counts.
    pub(super) fn on(&self, shutdown: &Shutdown) {
        let _ = self.shutdown.set(shutdown.clone());
    }

    /// Whether the process is to end.
    pub(super) fn begun(&self) -> bool {
        self.shutdown.get().is_some_and(Shutdown::requested)
    }

    /// Tries, at least once, for `patience` or what is left of it once the process is to end; `attempt` is told how long
    /// it may wait itself.
    pub(super) fn wait<T>(
        &self,
        patience: Duration,
        mut attempt: impl FnMut(Duration) -> Option<T>,
    ) -> Option<T> {
        let start = Instant::now();
        let mut spent = Duration::ZERO;
        loop {
            let mut left = patience.saturating_sub(start.elapsed());
            let begun = self.begun();
            if begun {
                let budget = BUDGET.saturating_sub(*lock(&self.spent));
                left = left.min(SHARE.saturating_sub(spent)).min(budget);
            }
            let began = Instant::now();
            let outcome = attempt(left.min(LOOK));
            if begun && !left.is_zero() {
                let took = began.elapsed();
                spent += took;
                *lock(&self.spent) += took;
            }
            if outcome.is_some() || left.is_zero() {
                return outcome;
            }
        }
    }

    /// Sleeps, by the same rules.
    pub(super) fn pause(&self, duration: Duration) {
        self.wait(duration, |slice| {
            thread::sleep(slice);
            None::<()>
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a machine under load may add.
    const SLACK: Duration = Duration::from_secs(2);

    fn took(act: impl FnOnce()) -> Duration {
        let start = Instant::now();
        act();
        start.elapsed()
    }

    #[test]
    fn without_a_shutdown_waits_last_as_long_as_they_are_meant_to() {
        let farewell = Farewell::default();
        farewell.on(&Shutdown::new());
        assert!(took(|| farewell.pause(2 * BUDGET)) >= 2 * BUDGET);
        assert_eq!(farewell.wait(Duration::ZERO, Some), Some(Duration::ZERO));
    }

    #[test]
    fn after_the_shutdown_all_waits_together_take_no_more_than_the_budget() {
        let (farewell, shutdown) = (Farewell::default(), Shutdown::new());
        farewell.on(&shutdown);
        shutdown.request();
        let first = took(|| farewell.pause(Duration::from_secs(60)));
        assert!((SHARE..SHARE + SLACK).contains(&first), "{first:?}");
        let all = took(|| (0..1000).for_each(|_| farewell.pause(Duration::from_secs(60))));
        assert!(all < BUDGET + SLACK, "{all:?}");
        assert_eq!(farewell.wait(BUDGET, Some), Some(Duration::ZERO));
    }

    #[test]
    fn a_wait_under_way_ends_soon_after_the_shutdown() {
        let (farewell, shutdown) = (Farewell::default(), Shutdown::new());
        farewell.on(&shutdown);
        let requester = thread::spawn(move || {
            thread::sleep(Duration::from_millis(50));
            shutdown.request();
        });
        assert!(took(|| farewell.pause(Duration::from_secs(60))) < SHARE + SLACK);
        requester.join().unwrap();
    }
}
