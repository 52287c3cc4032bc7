//! When messages are logged.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::{Duration, Instant};

use lgvi_middleware::ros::Clock;

use crate::batch::Head;

/// Messages that are held until the first stamp is known.
const HELD: usize = 1000;

/// The most memory that they take (bytes).
const HELD_SIZE: usize = 16 << 20;

/// How long each of them is held, unless without limit: together with the time between two flushes less than the second
/// that a kill may lose.
const HOLD: Duration = Duration::from_millis(250);

/// The stamp of the last state from shared memory.
#[derive(Debug)]
pub(crate) struct StateTime(AtomicI64);

impl Default for StateTime {
    fn default() -> Self {
        Self(AtomicI64::new(i64::MIN))
    }
}

impl StateTime {
    pub(crate) fn set(&self, stamp: i64) {
        self.0.store(stamp, Ordering::Relaxed);
    }

    fn get(&self) -> Option<i64> {
        Some(self.0.load(Ordering::Relaxed)).filter(|stamp| *stamp != i64::MIN)
    }
}

/// What messages are logged at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LogTime {
    /// The node's time when they are received.
    Received,
    /// Their stamps.
    Stamp,
}

/// A message whose log time is still that of its reception.
pub(crate) struct Message {
    pub(crate) head: Head,
    pub(crate) cdr: Vec<u8>,
}

/// Log times. What has no stamp is logged at the last one of others; and what comes before the first one, or before the
/// first time on `/clock`, waits for it, but not for long unless it is told to.
pub(crate) struct LogTimes {
    by: LogTime,
    clock: Clock,
    latest: Option<i64>,
    states: Arc<StateTime>,
    /// How long a message waits; none: without limit.
    hold: Option<Duration>,
    /// Each with when it came.
    held: VecDeque<(Instant, Message)>,
    /// Bytes of what waits.
    size: usize,
}

impl LogTimes {
    pub(crate) fn new(
        by: LogTime,
        await_stamp: bool,
        clock: Clock,
        states: Arc<StateTime>,
    ) -> Self {
        Self {
            by,
            clock,
            latest: None,
            states,
            hold: (!await_stamp).then_some(HOLD),
            held: VecDeque::new(),
            size: 0,
        }
    }

    /// Passes on a message, and those that have waited for its stamp.
    pub(crate) fn log(
        &mut self,
        mut message: Message,
        stamp: Option<i64>,
        mut pass_on: impl FnMut(Message),
    ) {
        let own = match self.by {
            LogTime::Received if !self.clock.is_simulated() => return pass_on(message),
            LogTime::Received => None,
            // A stamp of 0 is one that nobody has set.
            LogTime::Stamp => stamp.filter(|stamp| *stamp != 0),
        };
        self.latest = own.or(self.latest);
        self.release(&mut pass_on);
        match own.or_else(|| self.time()) {
            Some(time) => {
                message.head.log_time = time;
                pass_on(message);
            }
            None => {
                self.size += message.cdr.len();
                self.held.push_back((Instant::now(), message));
                self.give_up(pass_on);
            }
        }
    }

    /// Passes on those that have waited, if a time is known by now, or for long enough.
    pub(crate) fn release(&mut self, mut pass_on: impl FnMut(Message)) {
        if self.held.is_empty() {
            return;
        }
        let Some(time) = self.time() else {
            return self.give_up(pass_on);
        };
        for (_, mut message) in self.held.drain(..) {
            message.head.log_time = time;
            pass_on(message);
        }
        self.size = 0;
    }

    /// Passes on those that have waited in vain, at the times of their reception.
    pub(crate) fn finish(&mut self, mut pass_on: impl FnMut(Message)) {
        self.release(&mut pass_on);
        self.held
            .drain(..)
            .for_each(|(_, message)| pass_on(message));
    }

    /// Whether messages wait.
    pub(crate) fn holds(&self) -> bool {
        !self.held.is_empty()
    }

    /// Passes on those that are too many, and those that have waited for too long.
    fn give_up(&mut self, mut pass_on: impl FnMut(Message)) {
        while let Some((since, _)) = self.held.front() {
            let late = self.hold.is_some_and(|most| since.elapsed() >= most);
            if !late && self.held.len() <= HELD && self.size <= HELD_SIZE {
                break;
            }
            if let Some((_, oldest)) = self.held.pop_front() {
                self.size -= oldest.cdr.len();
                pass_on(oldest);
            }
        }
    }

    fn time(&self) -> Option<i64> {
        match self.by {
            LogTime::Received => Some(self.clock.now()).filter(|time| *time != 0),
            LogTime::Stamp => self.latest.max(self.states.get()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Log times as they come out, of messages received at 1000, 1001 and so on.
    struct Bench {
        times: LogTimes,
        states: Arc<StateTime>,
        logged: Vec<(u64, i64)>,
        received: u64,
    }

    impl Bench {
        fn new(by: LogTime) -> Self {
            Self::awaiting(by, true)
        }

        fn awaiting(by: LogTime, await_stamp: bool) -> Self {
            let states = Arc::<StateTime>::default();
            Self {
                times: LogTimes::new(by, await_stamp, Clock::wall(), Arc::clone(&states)),
                states,
                logged: Vec::new(),
                received: 0,
            }
        }

        fn receive(&mut self, stamp: Option<i64>) {
            let message = Message {
                head: Head {
                    publisher: 0,
                    track: 0,
                    log_time: 1000 + self.received.cast_signed(),
                    publish_time: 0,
                    sequence: self.received,
                },
                cdr: Vec::new(),
            };
            self.received += 1;
            self.times.log(message, stamp, |Message { head, .. }| {
                self.logged.push((head.sequence, head.log_time));
            });
        }

        fn release(&mut self) {
            self.times.release(|Message { head, .. }| {
                self.logged.push((head.sequence, head.log_time));
            });
        }

        fn finish(&mut self) {
            self.times.finish(|Message { head, .. }| {
                self.logged.push((head.sequence, head.log_time));
            });
        }
    }

    #[test]
    fn what_comes_before_the_first_stamp_waits_for_it() {
        let mut bench = Bench::new(LogTime::Stamp);
        bench.receive(None);
        bench.receive(None);
        assert_eq!(bench.logged, []);
        bench.receive(Some(5));
        bench.receive(None);
        bench.receive(Some(7));
        bench.finish();
        assert_eq!(bench.logged, [(0, 5), (1, 5), (2, 5), (3, 5), (4, 7)]);
    }

    #[test]
    fn a_stamp_of_zero_is_none() {
        let mut bench = Bench::new(LogTime::Stamp);
        bench.receive(Some(0));
        bench.receive(Some(5));
        bench.receive(Some(0));
        assert_eq!(bench.logged, [(0, 5), (1, 5), (2, 5)]);
    }

    #[test]
    fn states_from_shared_memory_tell_the_time_too() {
        let mut bench = Bench::new(LogTime::Stamp);
        bench.receive(None);
        bench.states.set(3);
        bench.receive(None);
        bench.states.set(4);
        bench.receive(None);
        bench.receive(Some(2));
        assert_eq!(bench.logged, [(0, 3), (1, 3), (2, 4), (3, 2)]);
    }

    #[test]
    fn what_waits_in_vain_is_logged_at_its_reception() {
        let mut bench = Bench::new(LogTime::Stamp);
        for _ in 0..=HELD {
            bench.receive(None);
        }
        assert_eq!(bench.logged, [(0, 1000)], "only so many wait");
        bench.finish();
        let expected: Vec<_> = (0..=HELD as u64)
            .map(|n| (n, 1000 + n.cast_signed()))
            .collect();
        assert_eq!(bench.logged, expected);
    }

    #[test]
    fn what_waits_for_long_is_logged_at_its_reception_unless_it_is_to_wait() {
        for (await_stamp, expected) in [(false, vec![(0, 1000)]), (true, vec![])] {
            let mut bench = Bench::awaiting(LogTime::Stamp, await_stamp);
            bench.receive(None);
            bench.release();
            assert_eq!((&*bench.logged, bench.times.holds()), (&[][..], true));
            std::thread::sleep(HOLD);
            bench.release();
            assert_eq!(bench.logged, expected);
            assert_eq!(bench.times.holds(), await_stamp);
            bench.receive(None);
            bench.receive(Some(5));
            let first = if await_stamp { 5 } else { 1000 };
            assert_eq!(bench.logged, [(0, first), (1, 5), (2, 5)]);
        }
    }

    #[test]
    fn what_is_logged_at_its_reception_waits_for_no_stamp() {
        let mut bench = Bench::new(LogTime::Received);
        bench.receive(None);
        bench.receive(Some(5));
        assert_eq!(bench.logged, [(0, 1000), (1, 1001)]);
    }
}
