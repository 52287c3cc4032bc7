//! What a node says of itself on `/diagnostics`, once a second.

use std::{
    sync::{Arc, Mutex},
    time::Duration,
};

use lgvi_msgs::{
    diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue},
    stamp,
    std_msgs::Header,
};
use tracing::warn;

use super::{Clock, Executor, Qos, RosError, RosNode};
use crate::sync::lock;

/// How often they are published.
const PERIOD: Duration = Duration::from_secs(1);

/// Messages that are kept for those who do not keep up.
const DEPTH: usize = 10;

/// How well something is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Level {
    /// As it should be.
    Ok = DiagnosticStatus::OK,
    /// Worth a look.
    Warn = DiagnosticStatus::WARN,
    /// Not as it should be.
    Error = DiagnosticStatus::ERROR,
}

/// How one part of a node is.
#[derive(Debug, Clone, PartialEq)]
pub struct Status {
    level: Level,
    message: String,
    values: Vec<KeyValue>,
}

impl Status {
    /// All is well.
    pub fn ok(message: impl Into<String>) -> Self {
        Self {
            level: Level::Ok,
            message: message.into(),
            values: Vec::new(),
        }
    }

    /// Raises the level, and says why, where `condition` holds and nothing worse has been said.
    #[must_use]
    pub fn when(mut self, condition: bool, level: Level, message: impl Into<String>) -> Self {
        if condition && level > self.level {
            self.level = level;
            self.message = message.into();
        }
        self
    }

    /// Adds a value.
    #[must_use]
    pub fn value(mut self, key: impl Into<String>, value: impl ToString) -> Self {
        self.values.push(KeyValue {
            key: key.into(),
            value: value.to_string(),
        });
        self
    }

    /// Adds the values of another status.
    #[must_use]
    pub fn values_of(mut self, mut other: Self) -> Self {
        self.values.append(&mut other.values);
        self
    }
}

type Ask = Box<dyn FnMut() -> Status + Send>;

/// The parts of a node that say how they are. Clones are handles to the same.
#[derive(Clone, Default)]
pub struct Diagnostics(Arc<Mutex<Vec<Part>>>);

struct Part {
    name: String,
    ask: Ask,
}

/// Keeps a part on `/diagnostics` until it is dropped.
pub struct Diagnosed {
    diagnostics: Diagnostics,
    name: String,
}

impl Diagnostics {
    /// Publishes on `/diagnostics`, once a second of the wall, whatever the clock does. Nobody is asked while nobody
    /// listens. A clock that follows `/clock` is a part.
    pub fn serve(node: &RosNode, executor: &mut Executor, clock: Clock) -> Result<Self, RosError> {
        let diagnostics = Self::default();
        if clock.is_simulated() {
            let clock = clock.clone();
            lock(&diagnostics.0).push(Part {
                name: "clock".into(),
                ask: Box::new(move || clock.status().unwrap_or_else(|| Status::ok(""))),
            });
        }
        let this = diagnostics.clone();
        let publisher = node.publisher("/diagnostics", &Qos::reliable(DEPTH))?;
        let prefix = node.fully_qualified_name();
        let prefix = prefix.trim_start_matches('/').to_owned();
        executor.every(PERIOD, move || {
            if publisher.matched_subscriptions() == 0 {
                return;
            }
            let stamp = stamp::to_message(clock.now()).unwrap_or_default();
            let message = DiagnosticArray {
                header: Header {
                    stamp,
                    frame_id: String::new(),
                },
                status: this.ask(&prefix),
            };
            if let Err(error) = publisher.publish(&message) {
                warn!("{error}");
            }
        });
        Ok(diagnostics)
    }

    /// Has a part asked for its status until the returned guard is dropped.
    #[must_use]
    pub fn add(&self, name: &str, ask: impl FnMut() -> Status + Send + 'static) -> Diagnosed {
        lock(&self.0).push(Part {
            name: name.into(),
            ask: Box::new(ask),
        });
        Diagnosed {
            diagnostics: self.clone(),
            name: name.into(),
        }
    }

    fn ask(&self, prefix: &str) -> Vec<DiagnosticStatus> {
        let mut parts = lock(&self.0);
        let statuses = parts.iter_mut().map(|part| {
            let Status {
                level,
                message,
                values,
            } = (part.ask)();
            DiagnosticStatus {
                level: level as u8,
                name: format!("{prefix}: {}", part.name),
                message,
                hardware_id: String::new(),
                values,
            }
        });
        statuses.collect()
    }
}

impl Drop for Diagnosed {
    fn drop(&mut self) {
        lock(&self.diagnostics.0).retain(|part| part.name != self.name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_is_what_is_said() {
        let status = Status::ok("flying")
            .when(true, Level::Warn, "2 overruns")
            .when(false, Level::Error, "no plan")
            .when(true, Level::Warn, "1 lost")
            .value("overruns", 2);
        assert_eq!(status.level, Level::Warn);
        assert_eq!(status.message, "2 overruns");
        assert_eq!(status.values[0].value, "2");
    }

    #[test]
    fn a_part_is_asked_until_its_guard_is_dropped() {
        let diagnostics = Diagnostics::default();
        let mut asked = 0;
        let part = diagnostics.add("flight", move || {
            asked += 1;
            Status::ok(format!("{asked}"))
        });
        assert_eq!(diagnostics.ask("n")[0].name, "n: flight");
        assert_eq!(diagnostics.ask("n")[0].message, "2");
        drop(part);
        assert!(diagnostics.ask("n").is_empty());
    }
}
