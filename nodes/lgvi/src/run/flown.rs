use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;

use lgvi_node::{FlightReport, PlanReport};
use serde::Serialize;

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
    /// What went wrong, and the exit code that it calls for.
    pub(crate) failure: Option<Failure>,
}

/// What has become of the plans made in flight.
#[derive(Debug, Serialize)]
pub(crate) struct Replanned {
    /// Plans published.
    pub(crate) published: u64,
    /// Times when there was none in time, and the old one was kept.
    pub(crate) kept: u64,
}

/// The first thing that went wrong.
#[derive(Debug, Serialize)]
pub(crate) struct Failure {
    pub(crate) message: String,
    pub(crate) exit_code: u8,
}

impl Flown {
    pub(crate) fn exit_code(&self) -> ExitCode {
        let lost = u8::from(self.lost != Some(0));
        ExitCode::from(
            self.failure
                .as_ref()
                .map_or(lost, |failure| failure.exit_code),
        )
    }
}
