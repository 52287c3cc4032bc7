//! When messages from DDS are logged.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use crate::sink::Record;

/// Messages that are held until the first stamp is known.
const HELD: usize = 1000;

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

/// Log times: those of reception, or stamps. What has no stamp is logged at the last one of others, and what comes
/// before the first one waits for it.
pub(crate) struct LogTimes {
    use_sim_time: bool,
    latest: Option<i64>,
    states: Arc<StateTime>,
    held: VecDeque<Record>,
}

impl LogTimes {
    pub(crate) fn new(use_sim_time: bool, states: Arc<StateTime>) -> Self {
        Self {
            use_sim_time,
            latest: None,
            states,
            held: VecDeque::new(),
        }
    }

    /// Passes on a message whose log time is that of its reception, and those that have waited for its stamp.
    pub(crate) fn log(
        &mut self,
        mut record: Record,
        stamp: Option<i64>,
        mut pass_on: impl FnMut(Record),
    ) {
        if !self.use_sim_time {
            return pass_on(record);
        }
        self.latest = stamp.or(self.latest);
        self.release(&mut pass_on);
        match stamp.or_else(|| self.time()) {
            Some(time) => {
                record.log_time = time;
                pass_on(record);
            }
            None => {
                self.held.push_back(record);
                if self.held.len() > HELD {
                    self.held.pop_front().into_iter().for_each(pass_on);
                }
            }
        }
    }

    /// Passes on those that have waited, if a stamp is known by now.
    pub(crate) fn release(&mut self, pass_on: impl FnMut(Record)) {
        if self.held.is_empty() {
            return;
        }
        if let Some(time) = self.time() {
            let timed = |mut record: Record| {
                record.log_time = time;
                record
            };
            self.held.drain(..).map(timed).for_each(pass_on);
        }
    }

    /// Passes on those that have waited in vain, at the times of their reception.
    pub(crate) fn finish(&mut self, mut pass_on: impl FnMut(Record)) {
        self.release(&mut pass_on);
        self.held.drain(..).for_each(pass_on);
    }

    fn time(&self) -> Option<i64> {
        self.latest.max(self.states.get())
    }
}

#[cfg(test)]
mod tests {
    use lgvi_msgs::MessageType;
    use lgvi_msgs::rosgraph_msgs::Clock;

    use super::*;

    /// Log times as they come out, of messages received at 1000, 1001 and so on.
    struct Bench {
        times: LogTimes,
        states: Arc<StateTime>,
        logged: Vec<(u64, i64)>,
        received: u64,
    }

    impl Bench {
        fn new(use_sim_time: bool) -> Self {
            let states = Arc::<StateTime>::default();
            Self {
                times: LogTimes::new(use_sim_time, Arc::clone(&states)),
                states,
                logged: Vec::new(),
                received: 0,
            }
        }

        fn receive(&mut self, stamp: Option<i64>) {
            let record = Record {
                topic: Arc::from("/topic"),
                message_type: MessageType::of::<Clock>(),
                depth: 1,
                log_time: 1000 + self.received.cast_signed(),
                publish_time: 0,
                sequence: self.received,
                cdr: Vec::new(),
            };
            self.received += 1;
            self.times.log(record, stamp, |record| {
                self.logged.push((record.sequence, record.log_time));
            });
        }

        fn finish(&mut self) {
            self.times.finish(|record| {
                self.logged.push((record.sequence, record.log_time));
            });
        }
    }

    #[test]
    fn what_comes_before_the_first_stamp_waits_for_it() {
        let mut bench = Bench::new(true);
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
    fn states_from_shared_memory_tell_the_time_too() {
        let mut bench = Bench::new(true);
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
        let mut bench = Bench::new(true);
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
    fn without_simulated_time_nothing_waits() {
        let mut bench = Bench::new(false);
        bench.receive(None);
        bench.receive(Some(5));
        assert_eq!(bench.logged, [(0, 1000), (1, 1001)]);
    }
}
