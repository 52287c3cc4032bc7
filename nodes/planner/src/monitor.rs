//! How planning goes, as `/diagnostics` has it.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use lgvi_middleware::ros::{Diagnosed, Diagnostics, Level, Status};
use lgvi_middleware::sync::lock;

use crate::solver::Iteration;

/// What the planner notes in passing; others read it.
#[derive(Default)]
pub(crate) struct Monitor {
    /// Times when the old plan was kept.
    pub(crate) kept: AtomicU64,
    solved: AtomicU64,
    failed: AtomicU64,
    last: Mutex<Option<Last>>,
}

struct Last {
    iteration: Iteration,
    took: Duration,
    solved: bool,
}

impl Monitor {
    /// The solver has ended so, after so long.
    pub(crate) fn note(&self, iteration: &Iteration, took: Duration, solved: bool) {
        let count = if solved { &self.solved } else { &self.failed };
        count.fetch_add(1, Ordering::Relaxed);
        *lock(&self.last) = Some(Last {
            iteration: *iteration,
            took,
            solved,
        });
    }

    /// Has the planning on `/diagnostics`.
    pub(crate) fn diagnose(this: &Arc<Self>, diagnostics: &Diagnostics) -> Diagnosed {
        let this = Arc::clone(this);
        diagnostics.add("planning", move || this.status())
    }

    fn status(&self) -> Status {
        let [solved, failed, kept] =
            [&self.solved, &self.failed, &self.kept].map(|count| count.load(Ordering::Relaxed));
        let last = lock(&self.last);
        let status = Status::ok("no plan yet")
            .value("plans", solved)
            .value("failures", failed)
            .value("old plans kept", kept);
        let Some(Last {
            iteration,
            took,
            solved,
        }) = &*last
        else {
            return status;
        };
        Status::ok(format!("planned in {} iterations", iteration.iteration))
            .when(!solved, Level::Error, "the last plan has failed")
            .when(kept > 0, Level::Warn, "old plans were kept")
            .values_of(status)
            .value("Newton iterations", iteration.iteration)
            .value("trials", iteration.trials)
            .value("time (ms)", format!("{:.3}", took.as_secs_f64() * 1e3))
            .value("violation", format!("{:e}", iteration.violation))
            .value("stationarity", format!("{:e}", iteration.stationarity))
            .value("condition", format!("{:e}", iteration.condition))
    }
}
