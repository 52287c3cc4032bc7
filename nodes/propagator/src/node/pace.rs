use std::time::{Duration, Instant};

use lgvi_middleware::ros::Clock;

/// Keeps simulated time in step with the clock on the wall, or with that of `/clock`.
pub(crate) struct Pace {
    source: Source,
    /// Steps that came later than their time.
    pub(crate) overruns: u64,
    /// The next step has been waited for already.
    waiting: bool,
}

enum Source {
    /// Nothing has to be on time.
    Free,
    /// So many seconds of the wall a simulated second, since an instant at which simulated time was so many seconds.
    Wall {
        seconds: f64,
        since: Instant,
        from: f64,
    },
    /// Stamps are those of `/clock`.
    Clock(Clock),
}

impl Pace {
    /// As fast as possible.
    pub(crate) fn free() -> Self {
        Self {
            source: Source::Free,
            overruns: 0,
            waiting: false,
        }
    }

    /// Whether nothing has to be on time.
    pub(crate) fn is_free(&self) -> bool {
        matches!(self.source, Source::Free)
    }

    /// From now on, when simulated time is `from` (s), at `factor` simulated seconds a second; 0 means as fast as
    /// possible. Where the node's time is that of `/clock`, the factor means nothing.
    pub(crate) fn set(&mut self, clock: &Clock, from: f64, factor: f64) {
        self.source = if clock.is_simulated() {
            Source::Clock(clock.clone())
        } else if factor > 0.0 {
            Source::Wall {
                seconds: factor.recip(),
                since: Instant::now(),
                from,
            }
        } else {
            Source::Free
        };
    }

    /// Waits for the time of a step, `simulated` seconds after the scene's epoch, which is `stamp` (ns), for `slice` at
    /// most; whether it has come.
    pub(crate) fn wait(&mut self, simulated: f64, stamp: i64, slice: Duration) -> bool {
        let left = match &self.source {
            Source::Free => return true,
            Source::Clock(clock) => return clock.wait_until(stamp, slice),
            Source::Wall {
                seconds,
                since,
                from,
            } => Duration::try_from_secs_f64((simulated - from).max(0.0) * seconds)
                .unwrap_or(Duration::MAX)
                .saturating_sub(since.elapsed()),
        };
        std::thread::sleep(left.min(slice));
        self.overruns += u64::from(left.is_zero() && !self.waiting);
        self.waiting = left > slice;
        !self.waiting
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SLICE: Duration = Duration::from_millis(5);

    #[test]
    fn steps_come_at_their_time_from_where_the_pace_was_set() {
        let mut pace = Pace::free();
        assert!(pace.wait(1e9, 0, SLICE));
        pace.set(&Clock::wall(), 100.0, 10.0);
        let start = Instant::now();
        assert!(pace.wait(100.0, 0, SLICE));
        assert_eq!(pace.overruns, 1, "the first step is due at once");
        while !pace.wait(100.5, 0, SLICE) {}
        assert!(start.elapsed() >= Duration::from_millis(50));
        assert_eq!(pace.overruns, 1);
        assert!(!pace.wait(1e300, 0, SLICE), "no step is due so soon");
    }
}
