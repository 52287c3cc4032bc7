//! When recorded messages are due.

use std::time::Duration;

/// The recorded time: it runs at a rate, stands while it is paused, and can be set.
///
/// The time on the wall is that of whoever asks, a duration since one fixed moment, which never goes back. While
/// nothing changes the recorded time is computed from one moment, so that no error accumulates; a pause moves that moment
/// by as long as it has lasted, and a setting puts a new one, both exactly; a change of rate does so to the nanosecond.
#[derive(Debug)]
pub(crate) struct Pace {
    /// Recorded seconds a second; 0: as fast as possible.
    rate: f64,
    /// At this time on the wall …
    wall: Duration,
    /// … it was this recorded time (ns).
    recorded: u64,
    /// Since when it stands.
    paused: Option<Duration>,
}

impl Pace {
    /// The recorded time begins at 0.
    pub(crate) fn new(rate: f64, paused: bool, now: Duration) -> Self {
        Self {
            rate,
            wall: now,
            recorded: 0,
            paused: paused.then_some(now),
        }
    }

    /// The recorded time (ns).
    pub(crate) fn recorded(&self, now: Duration) -> u64 {
        let elapsed = self.paused.unwrap_or(now).saturating_sub(self.wall);
        let passed = (elapsed.as_nanos() as f64 * self.rate) as u64;
        self.recorded.saturating_add(passed)
    }

    /// How long it is until a recorded time (ns); `None` while it stands.
    pub(crate) fn wait(&self, time: u64, now: Duration) -> Option<Duration> {
        if self.paused.is_some() {
            return None;
        }
        if self.rate == 0.0 || time <= self.recorded {
            return Some(Duration::ZERO);
        }
        let left = Duration::from_nanos(time - self.recorded).as_secs_f64();
        let due = Duration::try_from_secs_f64(left / self.rate).unwrap_or(Duration::MAX);
        Some(self.wall.saturating_add(due).saturating_sub(now))
    }

    /// Notes that a message of this time (ns) goes out, which as fast as possible is all that makes time pass.
    pub(crate) fn pass(&mut self, time: u64, now: Duration) {
        if self.rate == 0.0 {
            self.jump(time, now);
        }
    }

    /// Sets the recorded time (ns).
    pub(crate) fn jump(&mut self, time: u64, now: Duration) {
        self.recorded = time;
        self.wall = now;
        self.paused = self.paused.map(|_| now);
    }

    pub(crate) fn pause(&mut self, now: Duration) {
        self.paused.get_or_insert(now);
    }

    pub(crate) fn resume(&mut self, now: Duration) {
        if let Some(paused) = self.paused.take() {
            self.wall += now.saturating_sub(paused);
        }
    }

    pub(crate) fn is_paused(&self) -> bool {
        self.paused.is_some()
    }

    pub(crate) fn rate(&self) -> f64 {
        self.rate
    }

    /// Changes the rate. A recorded time that is ahead of what was played goes back to that of the next message (ns).
    pub(crate) fn set_rate(&mut self, rate: f64, next: Option<u64>, now: Duration) {
        let recorded = self.recorded(now);
        self.jump(next.map_or(recorded, |next| recorded.min(next)), now);
        self.rate = rate;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: u64 = 1_000_000_000;

    fn seconds(seconds: f64) -> Duration {
        Duration::from_secs_f64(seconds)
    }

    fn running(rate: f64) -> Pace {
        let mut pace = Pace::new(rate, false, seconds(10.0));
        pace.jump(100 * SECOND, seconds(10.0));
        pace
    }

    #[test]
    fn messages_are_due_by_the_rate() {
        for (rate, wait) in [(1.0, 3.0), (2.0, 1.5), (0.25, 12.0), (1e-300, f64::MAX)] {
            let pace = running(rate);
            let wait = Duration::try_from_secs_f64(wait).unwrap_or(Duration::MAX - seconds(10.0));
            assert_eq!(
                pace.wait(103 * SECOND, seconds(10.0)),
                Some(wait),
                "at {rate}"
            );
        }
        let pace = running(2.0);
        assert_eq!(pace.wait(103 * SECOND, seconds(11.0)), Some(seconds(0.5)));
        assert_eq!(pace.wait(103 * SECOND, seconds(12.0)), Some(Duration::ZERO));
        assert_eq!(pace.wait(99 * SECOND, seconds(10.0)), Some(Duration::ZERO));
        assert_eq!(pace.recorded(seconds(11.25)), 102 * SECOND + SECOND / 2);
    }

    #[test]
    fn a_pause_lasts_as_long_as_it_lasts_however_often() {
        let mut pace = running(1.0);
        let mut wall = seconds(10.0);
        for _ in 0..1000 {
            wall += Duration::from_nanos(7);
            pace.pause(wall);
            pace.pause(wall + Duration::from_nanos(1));
            wall += Duration::from_nanos(333);
            assert_eq!(pace.wait(103 * SECOND, wall), None);
            pace.resume(wall);
            pace.resume(wall);
        }
        assert_eq!(pace.recorded(wall), 100 * SECOND + 7000);
        let left = Duration::from_nanos(3 * SECOND - 7000);
        assert_eq!(pace.wait(103 * SECOND, wall), Some(left));
    }

    #[test]
    fn a_rate_counts_from_its_change_on() {
        let mut pace = running(1.0);
        pace.set_rate(4.0, None, seconds(11.0));
        assert_eq!(pace.recorded(seconds(11.5)), 103 * SECOND);
        assert_eq!(pace.wait(105 * SECOND, seconds(11.0)), Some(seconds(1.0)));
        pace.pause(seconds(12.0));
        pace.set_rate(0.5, None, seconds(20.0));
        assert_eq!(pace.recorded(seconds(30.0)), 105 * SECOND);
        pace.resume(seconds(30.0));
        assert_eq!(pace.recorded(seconds(32.0)), 106 * SECOND);
    }

    #[test]
    fn a_rate_is_that_of_what_is_left_to_play() {
        let mut pace = running(1e9);
        // What was recorded at 101 s has not been played yet.
        pace.set_rate(1.0, Some(101 * SECOND), seconds(12.0));
        assert_eq!(pace.recorded(seconds(12.0)), 101 * SECOND);
        assert_eq!(pace.wait(103 * SECOND, seconds(12.0)), Some(seconds(2.0)));
        // Time does not leap to a message that is not due.
        pace.set_rate(2.0, Some(103 * SECOND), seconds(13.0));
        assert_eq!(pace.recorded(seconds(13.0)), 102 * SECOND);
        pace.set_rate(1e9, Some(103 * SECOND), seconds(13.0));
        pace.pause(seconds(14.0));
        pace.set_rate(1.0, Some(103 * SECOND), seconds(15.0));
        pace.resume(seconds(16.0));
        assert_eq!(pace.wait(104 * SECOND, seconds(16.0)), Some(seconds(1.0)));
    }

    #[test]
    fn a_set_time_stands_while_paused_and_runs_on_otherwise() {
        let mut pace = running(2.0);
        pace.jump(50 * SECOND, seconds(14.0));
        assert_eq!(pace.recorded(seconds(15.0)), 52 * SECOND);
        pace.pause(seconds(15.0));
        pace.jump(200 * SECOND, seconds(16.0));
        assert_eq!(pace.recorded(seconds(99.0)), 200 * SECOND);
        pace.resume(seconds(100.0));
        assert_eq!(pace.recorded(seconds(101.0)), 202 * SECOND);
        assert_eq!(pace.wait(204 * SECOND, seconds(101.0)), Some(seconds(1.0)));
    }

    #[test]
    fn as_fast_as_possible_the_messages_make_the_time_pass() {
        let mut pace = running(0.0);
        assert_eq!(pace.wait(u64::MAX, seconds(10.0)), Some(Duration::ZERO));
        pace.pass(107 * SECOND, seconds(10.0));
        assert_eq!(pace.recorded(seconds(99.0)), 107 * SECOND);
        pace.set_rate(1.0, None, seconds(99.0));
        pace.pass(500 * SECOND, seconds(99.0));
        assert_eq!(pace.recorded(seconds(100.0)), 108 * SECOND);
        pace.pause(seconds(100.0));
        pace.set_rate(0.0, None, seconds(100.0));
        assert_eq!(pace.wait(108 * SECOND, seconds(101.0)), None);
    }
}
