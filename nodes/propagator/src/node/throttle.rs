//! Warnings that come once a second at most.

use std::time::{Duration, Instant};

/// How often a warning comes at most.
const PATIENCE: Duration = Duration::from_secs(1);

/// When a warning last came.
#[derive(Debug, Default)]
pub(crate) struct Throttle {
    told: Option<Instant>,
}

impl Throttle {
    /// Whether a warning may come `now`. If so, it counts as told.
    pub(crate) fn lets(&mut self, now: Instant) -> bool {
        let quiet = |told: Instant| now.duration_since(told) < PATIENCE;
        let lets = !self.told.is_some_and(quiet);
        if lets {
            self.told = Some(now);
        }
        lets
    }
}
