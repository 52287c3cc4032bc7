//! The time of a replay, and what is asked of the replay from outside: between the services' thread and the loop's.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use lgvi_middleware::sync::lock;

use crate::pace::Pace;

/// Orders that may wait.
const ORDERS: usize = 64;

/// What the loop is to do.
pub(crate) enum Order {
    /// Go on at this recorded time (ns); to be told whether that has been done.
    Seek(u64, Box<dyn FnOnce(bool) + Send>),
    /// Publish so many messages at once while paused, or all; to be told how many.
    Burst(Option<u64>, Box<dyn FnOnce(u64) + Send>),
}

impl Order {
    /// Says that it is not carried out.
    fn refuse(self) {
        match self {
            Self::Seek(_, answer) => answer(false),
            Self::Burst(_, answer) => answer(0),
        }
    }
}

/// What the loop's turn is.
pub(crate) enum Turn {
    /// To publish the message that it waits for.
    Due,
    /// To carry out an order.
    Order(Order),
    /// To end.
    Stop,
    /// To look around, and wait again.
    Later,
}

/// Clones are handles to the same.
#[derive(Clone)]
pub(crate) struct Remote(Arc<Shared>);

struct Shared {
    origin: Instant,
    state: Mutex<State>,
    changed: Condvar,
}

struct State {
    pace: Pace,
    orders: VecDeque<Order>,
    phase: Phase,
    stopped: bool,
}

/// What the loop does.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Nothing: the node is not active.
    Rests,
    /// It is about to begin: subscribers are awaited.
    Waits,
    Runs,
}

impl Remote {
    pub(crate) fn new(rate: f64, paused: bool) -> Self {
        Self(Arc::new(Shared {
            origin: Instant::now(),
            state: Mutex::new(State {
                pace: Pace::new(rate, paused, Duration::ZERO),
                orders: VecDeque::new(),
                phase: Phase::Rests,
                stopped: false,
            }),
            changed: Condvar::new(),
        }))
    }

    /// The loop is about to begin.
    pub(crate) fn wait(&self) {
        let mut state = lock(&self.0.state);
        state.phase = Phase::Waits;
        state.stopped = false;
    }

    /// The loop runs from now on, and the recorded time (ns) from here.
    pub(crate) fn begin(&self, time: u64) {
        let mut state = lock(&self.0.state);
        state.phase = Phase::Runs;
        let now = self.now();
        state.pace.jump(time, now);
    }

    /// The loop runs no more: what is asked for is refused.
    pub(crate) fn end(&self) {
        let mut state = lock(&self.0.state);
        state.phase = Phase::Rests;
        let refused = std::mem::take(&mut state.orders);
        drop(state);
        refused.into_iter().for_each(Order::refuse);
    }

    /// Gives the loop something to do, or refuses it.
    pub(crate) fn give(&self, order: Order) {
        let mut state = lock(&self.0.state);
        let possible = match order {
            Order::Seek(..) => true,
            Order::Burst(..) => state.pace.is_paused(),
        };
        if state.phase == Phase::Runs && possible && state.orders.len() < ORDERS {
            state.orders.push_back(order);
            self.0.changed.notify_one();
        } else {
            drop(state);
            order.refuse();
        }
    }

    /// Has the loop end, or not begin; whether there is anything to end.
    pub(crate) fn stop(&self) -> bool {
        let mut state = lock(&self.0.state);
        state.stopped = state.phase != Phase::Rests;
        self.0.changed.notify_one();
        state.stopped
    }

    pub(crate) fn is_stopped(&self) -> bool {
        lock(&self.0.state).stopped
    }

    /// The turn of the loop, which waits for the time of a message (ns) if there is one, and for `limit` at most.
    pub(crate) fn turn(&self, message: Option<u64>, limit: Duration) -> Turn {
        let mut state = lock(&self.0.state);
        let mut waited = false;
        loop {
            if state.stopped {
                return Turn::Stop;
            }
            if let Some(order) = state.orders.pop_front() {
                return Turn::Order(order);
            }
            let now = self.now();
            let wait = message.and_then(|time| state.pace.wait(time, now));
            if let (Some(time), Some(Duration::ZERO)) = (message, wait) {
                state.pace.pass(time, now);
                return Turn::Due;
            }
            if waited {
                return Turn::Later;
            }
            let wait = wait.unwrap_or(limit).min(limit);
            let changed = self.0.changed.wait_timeout(state, wait);
            state = changed.unwrap_or_else(PoisonError::into_inner).0;
            waited = true;
        }
    }

    /// The loop publishes a message of this time (ns) in a pause, if it may.
    pub(crate) fn step(&self, time: u64) -> bool {
        let mut state = lock(&self.0.state);
        let may = state.pace.is_paused() && !state.stopped;
        if may {
            let now = self.now();
            state.pace.jump(time, now);
        }
        may
    }

    /// Sets the recorded time (ns).
    pub(crate) fn jump(&self, time: u64) {
        self.change(|pace, now| pace.jump(time, now));
    }

    pub(crate) fn pause(&self) {
        self.change(Pace::pause);
    }

    pub(crate) fn resume(&self) {
        self.change(Pace::resume);
    }

    pub(crate) fn toggle_paused(&self) {
        self.change(|pace, now| {
            if pace.is_paused() {
                pace.resume(now);
            } else {
                pace.pause(now);
            }
        });
    }

    /// Sets the rate, if it is another one, for what is left to play from the time of the next message (ns) on.
    pub(crate) fn set_rate(&self, rate: f64, next: Option<u64>) {
        self.change(|pace, now| {
            if pace.rate() != rate {
                pace.set_rate(rate, next, now);
            }
        });
    }

    pub(crate) fn is_paused(&self) -> bool {
        lock(&self.0.state).pace.is_paused()
    }

    /// The recorded time (ns).
    pub(crate) fn recorded(&self) -> u64 {
        lock(&self.0.state).pace.recorded(self.now())
    }

    /// How long it is until a recorded time (ns); `None` while it stands.
    pub(crate) fn until(&self, time: u64) -> Option<Duration> {
        lock(&self.0.state).pace.wait(time, self.now())
    }

    fn change(&self, change: impl FnOnce(&mut Pace, Duration)) {
        let mut state = lock(&self.0.state);
        // The lock may have been waited for.
        let now = self.now();
        change(&mut state.pace, now);
        self.0.changed.notify_one();
    }

    fn now(&self) -> Duration {
        self.0.origin.elapsed()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;

    const LIMIT: Duration = Duration::from_millis(1);
    const HOUR: u64 = 3_600_000_000_000;

    fn burst(remote: &Remote) -> mpsc::Receiver<u64> {
        let (answer, answered) = mpsc::channel();
        let answer = Box::new(move |count| answer.send(count).unwrap());
        remote.give(Order::Burst(Some(3), answer));
        answered
    }

    #[test]
    fn the_loop_has_its_turn_when_a_message_is_due_and_none_in_a_pause() {
        let remote = Remote::new(1.0, true);
        remote.begin(5 * HOUR);
        assert!(matches!(remote.turn(Some(5 * HOUR), LIMIT), Turn::Later));
        remote.resume();
        assert!(matches!(remote.turn(Some(5 * HOUR), LIMIT), Turn::Due));
        assert!(matches!(remote.turn(Some(6 * HOUR), LIMIT), Turn::Later));
        remote.set_rate(0.0, Some(6 * HOUR));
        assert!(matches!(remote.turn(Some(6 * HOUR), LIMIT), Turn::Due));
        assert_eq!(remote.recorded(), 6 * HOUR);
        assert!(matches!(remote.turn(None, LIMIT), Turn::Later));
    }

    #[test]
    fn orders_are_carried_out_by_a_running_loop_only_and_bursts_in_a_pause_only() {
        let remote = Remote::new(1.0, true);
        assert_eq!(burst(&remote).recv(), Ok(0), "it does not run");
        remote.wait();
        assert_eq!(burst(&remote).recv(), Ok(0), "it does not run yet");
        remote.begin(0);
        let waiting = burst(&remote);
        match remote.turn(None, LIMIT) {
            Turn::Order(Order::Burst(Some(3), answer)) => answer(3),
            _ => panic!("no burst"),
        }
        assert_eq!(waiting.recv(), Ok(3));
        remote.toggle_paused();
        assert_eq!(burst(&remote).recv(), Ok(0), "it is not paused");
        remote.toggle_paused();
        let waiting = burst(&remote);
        remote.end();
        assert_eq!(waiting.recv(), Ok(0), "it runs no more");
    }

    #[test]
    fn a_stop_comes_first_and_is_forgotten_when_the_loop_begins() {
        let remote = Remote::new(1.0, true);
        remote.wait();
        remote.begin(0);
        let waiting = burst(&remote);
        assert!(remote.stop());
        assert!(matches!(remote.turn(Some(0), LIMIT), Turn::Stop));
        assert!(!remote.step(0), "a burst under way ends");
        remote.end();
        assert_eq!(waiting.recv(), Ok(0));
        assert!(!remote.stop(), "there is nothing to end");
        remote.wait();
        remote.begin(0);
        assert!(matches!(remote.turn(None, LIMIT), Turn::Later));
        assert!(remote.step(HOUR) && remote.recorded() == HOUR);
    }

    #[test]
    fn a_loop_that_is_about_to_begin_can_be_stopped() {
        let remote = Remote::new(1.0, false);
        remote.wait();
        assert!(!remote.is_stopped());
        assert!(remote.stop() && remote.is_stopped());
        remote.begin(0);
        assert!(matches!(remote.turn(Some(0), LIMIT), Turn::Stop));
        remote.end();
        remote.wait();
        assert!(!remote.is_stopped());
    }
}
