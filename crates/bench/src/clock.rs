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

fn seconds() -> f64 {
    read(ClockId::CLOCK_THREAD_CPUTIME_ID)
}

/// Seconds that this process has been on the processor, with all its threads.
pub(crate) fn process_seconds() -> f64 {
    read(ClockId::CLOCK_PROCESS_CPUTIME_ID)
}

/// Not a number where the system has no such clock.
fn read(clock: ClockId) -> f64 {
    clock_gettime(clock).map_or(f64::NAN, |time| {
        time.tv_sec() as f64 + 1e-9 * time.tv_nsec() as f64
    })
}

/// A moment that processes of one machine agree on (ns).
pub(crate) fn monotonic_nanoseconds() -> u64 {
    clock_gettime(ClockId::CLOCK_MONOTONIC).map_or(0, |time| {
        let [seconds, nanoseconds] = [time.tv_sec(), time.tv_nsec()].map(i64::cast_unsigned);
        1_000_000_000 * seconds + nanoseconds
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
