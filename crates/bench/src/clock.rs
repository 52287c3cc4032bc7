//! Time that this thread was running, which other programs on the machine take no part of.

use nix::time::{ClockId, clock_gettime};

/// A moment.
pub(crate) struct Moment(f64);

impl Moment {
    pub(crate) fn now() -> Self {
        Self(seconds())
    }

    /// Seconds since.
    pub(crate) fn elapsed(&self) -> f64 {
        seconds() - self.0
    }
}

/// Not a number where the system has no such clock.
fn seconds() -> f64 {
    clock_gettime(ClockId::CLOCK_THREAD_CPUTIME_ID).map_or(f64::NAN, |time| {
        time.tv_sec() as f64 + 1e-9 * time.tv_nsec() as f64
    })
}

/// The least time (ns) of `work` in several trials of some milliseconds, in which the clock is read twice.
pub(crate) fn nanoseconds(repeats: u32, mut work: impl FnMut()) -> f64 {
    const TRIAL: f64 = 1e-3;
    let mut trial = |count: u64| {
        let begun = Moment::now();
        (0..count).for_each(|_| work());
        begun.elapsed()
    };
    let mut count = 1;
    while trial(count) < TRIAL {
        count *= 2;
    }
    let least = (0..repeats)
        .map(|_| trial(count))
        .fold(f64::INFINITY, f64::min);
    1e9 * least / count as f64
}
