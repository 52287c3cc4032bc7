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

/// The least time (ns) of `work` in several trials of some milliseconds.
pub(crate) fn nanoseconds(repeats: u32, mut work: impl FnMut()) -> f64 {
    const TRIAL: f64 = 2e-3;
    let trial = |_| {
        let (begun, mut count) = (Moment::now(), 0);
        loop {
            (0..16).for_each(|_| work());
            count += 16;
            let elapsed = begun.elapsed();
            // not `<`, for an unknown time must end it too
            if !(elapsed <= TRIAL) {
                return 1e9 * elapsed / f64::from(count);
            }
        }
    };
    (0..repeats).map(trial).fold(f64::INFINITY, f64::min)
}
