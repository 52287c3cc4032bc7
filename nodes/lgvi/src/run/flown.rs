use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;

use lgvi_common::{FlightReport, PlanReport, ReplanReport, Warning};
use serde::Serialize;

use crate::strictness::Strictness;

/// How a flight went.
#[derive(Debug, Default, Serialize)]
pub(crate) struct Flown {
    pub(crate) scene: String,
    pub(crate) plan: Option<PlanReport>,
    /// Wall-clock time of the plan (s).
    pub(crate) planning_seconds: Option<f64>,
    /// Plans made in flight; none where there are no such.
    pub(crate) replanned: Option<Replanned>,
    pub(crate) flight: Option<FlightReport>,
    /// Messages that planner and propagator have published, as far as they have said so, by topic.
    pub(crate) published: BTreeMap<String, u64>,
    /// Messages recorded, by topic.
    pub(crate) recorded: BTreeMap<String, u64>,
    /// Messages that were published and are not in the bag; none where the two cannot be compared.
    pub(crate) lost: Option<u64>,
    /// Why they cannot.
    pub(crate) lost_unknown: Option<String>,
    /// The bag, once it is closed.
    pub(crate) bag: Option<PathBuf>,
    /// The picture of the flight, once it is drawn.
    pub(crate) picture: Option<PathBuf>,
    /// What the nodes have warned of, each once.
    pub(crate) warnings: Vec<Warning>,
    /// What went wrong, and the exit code that it calls for.
    pub(crate) failure: Option<Failure>,
}

/// What has become of the plans made in flight.
#[derive(Debug, Default, Serialize)]
pub(crate) struct Replanned {
    /// Plans published.
    pub(crate) published: u64,
    /// Times when there was none in time, and the old one was kept.
    pub(crate) kept: u64,
    /// Each of both, in their order.
    pub(crate) replans: Vec<ReplanReport>,
}

/// The first thing that went wrong.
#[derive(Debug, Serialize)]
pub(crate) struct Failure {
    pub(crate) message: String,
    pub(crate) exit_code: u8,
}

impl Flown {
    /// Takes note of a warning, unless it is known.
    pub(crate) fn warn(&mut self, warning: Warning) {
        if !self.warnings.contains(&warning) {
            self.warnings.push(warning);
        }
    }

    pub(crate) fn exit_code(&self, strictness: &Strictness) -> ExitCode {
        match &self.failure {
            Some(failure) => ExitCode::from(failure.exit_code),
            None if self.lost != Some(0) => ExitCode::from(1),
            None => strictness.exit_code(&self.warnings),
        }
    }
}
