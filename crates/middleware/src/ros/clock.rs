//! The time of a node: the wall's, or that of `/clock`.

use std::{
    fmt,
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use lgvi_msgs::{rosgraph_msgs, stamp};
use tracing::warn;

use super::{Executor, Qos, RosError, RosNode};

/// Tells a node's time, in nanoseconds since the UNIX epoch (or since whatever `/clock` counts from). Clones share it.
#[derive(Clone)]
pub struct Clock(Option<Arc<Heard>>);

#[derive(Default)]
struct Heard {
    latest: Mutex<Option<i64>>,
    changed: Condvar,
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
            let mut latest = hear.lock();
            if latest.is_some_and(|latest| time < latest) {
                warn!("/clock has gone back to {time} ns");
            }
            *latest = Some(time);
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
            None => SystemTime::now()
                .duration_since(UNIX_EPOCH)
                .ok()
                .and_then(|elapsed| elapsed.as_nanos().try_into().ok())
                .unwrap_or_default(),
            Some(heard) => heard.lock().unwrap_or_default(),
        }
    }

    /// Blocks until `/clock` has reached `time`, or `patience` has passed; returns whether it has. That of the wall is
    /// not waited for.
    pub fn wait_until(&self, time: i64, patience: Duration) -> bool {
        let Some(heard) = &self.0 else {
            return self.now() >= time;
        };
        let (latest, _) = heard
            .changed
            .wait_timeout_while(heard.lock(), patience, |latest| {
                latest.is_none_or(|latest| latest < time)
            })
            .unwrap_or_else(PoisonError::into_inner);
        latest.is_some_and(|latest| latest >= time)
    }
}

impl Heard {
    fn lock(&self) -> MutexGuard<'_, Option<i64>> {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for Clock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Clock")
            .field("simulated", &self.is_simulated())
            .field("now", &self.now())
            .finish()
    }
}
