//! The time of a node: the wall's, or that of `/clock`.

use std::{
    sync::{Arc, Condvar, Mutex},
    time::{Duration, Instant},
};

use lgvi_msgs::{rosgraph_msgs, stamp};
use tracing::{info, warn};

use crate::{
    sync::{lock, wait_while},
    wall,
};

use super::{Executor, Level, Qos, RosError, RosNode, Status};

/// How often it is said at most that `/clock` has gone back: two that publish it at once make it do so all the time.
const COMPLAINT: Duration = Duration::from_secs(1);

/// In nanoseconds.
const SECOND: i64 = 1_000_000_000;

/// Tells a node's time, in nanoseconds since the UNIX epoch (or since whatever `/clock` counts from). Clones share it.
#[derive(Clone)]
pub struct Clock(Option<Arc<Heard>>);

#[derive(Default)]
struct Heard {
    times: Mutex<Times>,
    changed: Condvar,
}

#[derive(Default)]
struct Times {
    latest: Option<i64>,
    /// How often it has gone back, and when that was last complained of.
    set_back: u64,
    complained: Option<Instant>,
    /// It has been waited for while nothing had come.
    missed: bool,
}

impl Clock {
    /// The clock on the wall.
    pub fn wall() -> Self {
        Self(None)
    }

    /// The time that is published on `/clock`, as `use_sim_time` asks for.
    pub fn simulated(node: &RosNode, executor: &mut Executor) -> Result<Self, RosError> {
        let heard = Arc::<Heard>::default();
        let hear = Arc::clone(&heard);
        let clock = node.subscription::<rosgraph_msgs::Clock>("/clock", &Qos::sensor(1))?;
        executor.listen(clock, move |message| {
            let time = match stamp::from_message(&message.clock) {
                Ok(time) => time,
                Err(error) => return warn!("/clock ignored: {error}"),
            };
            lock(&hear.times).hear(time);
            hear.changed.notify_all();
        });
        Ok(Self(Some(heard)))
    }

    /// Whether it is that of `/clock`.
    pub fn is_simulated(&self) -> bool {
        self.0.is_some()
    }

    /// The time; 0 as long as nothing has come on `/clock`.
    pub fn now(&self) -> i64 {
        match &self.0 {
            None => wall::now(),
            Some(heard) => lock(&heard.times).latest.unwrap_or_default(),
        }
    }

    /// Blocks until `/clock` has reached `time`, or `patience` has passed; returns whether it has. That of the wall is
    /// not waited for.
    pub fn wait_until(&self, time: i64, patience: Duration) -> bool {
        let Some(heard) = &self.0 else {
            return self.now() >= time;
        };
        let Heard { times, changed } = &**heard;
        let mut times = wait_while(changed, times, patience, |times| !times.reached(time));
        if times.latest.is_none() && !times.missed {
            times.missed = true;
            info!("waiting for /clock");
        }
        times.reached(time)
    }

    /// How the time on `/clock` is; `None` for that of the wall.
    pub(super) fn status(&self) -> Option<Status> {
        let times = lock(&self.0.as_ref()?.times);
        let (latest, set_back) = (times.latest.unwrap_or_default(), times.set_back);
        let time = format!(
            "{}.{:09}",
            latest.div_euclid(SECOND),
            latest.rem_euclid(SECOND)
        );
        let said = if times.latest.is_some() {
            "follows /clock"
        } else {
            "nothing has come on /clock"
        };
        let missing = times.latest.is_none() && times.missed;
        Some(
            Status::ok(said)
                .when(missing, Level::Warn, "waits for /clock")
                .when(set_back > 0, Level::Warn, "/clock has gone back")
                .value("time (s)", time)
                .value("times gone back", set_back),
        )
    }
}

impl Times {
    fn reached(&self, time: i64) -> bool {
        self.latest.is_some_and(|latest| latest >= time)
    }

    fn hear(&mut self, time: i64) {
        if let Some(back) = self.latest.and_then(|latest| latest.checked_sub(time))
            && back > 0
        {
            self.set_back += 1;
            if self
                .complained
                .is_none_or(|when| when.elapsed() >= COMPLAINT)
            {
                self.complained = Some(Instant::now());
                let (by, to, times) = (seconds(back), seconds(time), self.set_back);
                warn!("/clock jumped back by {by} s to {to} s ({times} jumps so far)");
            }
        }
        self.latest = Some(time);
    }
}

fn seconds(time: i64) -> f64 {
    time as f64 / SECOND as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_heard_is_the_time_and_going_back_is_counted() {
        let heard = Arc::<Heard>::default();
        let clock = Clock(Some(Arc::clone(&heard)));
        assert_eq!(clock.now(), 0);
        assert!(!clock.wait_until(0, Duration::ZERO), "nothing was heard");
        assert_eq!(
            clock.status(),
            Some(
                Status::ok("")
                    .when(true, Level::Warn, "waits for /clock")
                    .value("time (s)", "0.000000000")
                    .value("times gone back", 0)
            )
        );
        lock(&heard.times).hear(5_000_000_001);
        assert!(clock.wait_until(5_000_000_001, Duration::ZERO));
        assert!(!clock.wait_until(5_000_000_002, Duration::ZERO));
        assert_eq!(
            clock.status(),
            Some(
                Status::ok("follows /clock")
                    .value("time (s)", "5.000000001")
                    .value("times gone back", 0)
            )
        );
        lock(&heard.times).hear(2_000_000_000);
        assert_eq!(clock.now(), 2_000_000_000);
        assert!(!clock.wait_until(5_000_000_001, Duration::ZERO));
        assert_eq!(
            clock.status(),
            Some(
                Status::ok("")
                    .when(true, Level::Warn, "/clock has gone back")
                    .value("time (s)", "2.000000000")
                    .value("times gone back", 1)
            )
        );
        assert_eq!(Clock::wall().status(), None);
    }

    #[test]
    fn who_waits_is_woken_when_the_time_has_come() {
        let heard = Arc::<Heard>::default();
        let clock = Clock(Some(Arc::clone(&heard)));
        let waiting = std::thread::spawn(move || clock.wait_until(7, Duration::from_secs(60)));
        for time in [3, 7] {
            lock(&heard.times).hear(time);
            heard.changed.notify_all();
        }
        assert!(waiting.join().unwrap());
    }
}
