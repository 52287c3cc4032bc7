//! How a task ends.

use std::sync::Arc;

use lgvi_control::{Plan, PlanError};
use lgvi_scene::Maneuver;
use tracing::info;

use super::Iteration;
use super::violated::Violated;

/// What is said of a plan whose certificate is not sufficient.
pub(crate) const NOT_MINIMUM: &str = "the plan is stationary, but not known to be a local minimum: a cheaper one may be \
                                      near, and `maneuver.search` may find it";

/// The same of plans that are made in flight.
pub(crate) const NOT_MINIMUM_IN_FLIGHT: &str =
    "a plan made in flight is stationary, but not known to be a local minimum";

/// Why there is no plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// No plan meets the inequalities, as far as is known.
    Infeasible,
    /// The iterations are used up, or none makes progress.
    NotConverged,
    /// The time is used up.
    Deadline,
    /// Somebody asked for its end.
    Cancelled,
    /// The task makes no sense.
    Refused,
}

/// How a task ended with a plan.
#[derive(Clone, Debug)]
pub(crate) struct Solved {
    pub(crate) plan: Plan,
    /// Those of the companions, in their order.
    pub(crate) companions: Vec<Plan>,
    /// The maneuver as it was seen in flight, if other bodies have a part in it.
    pub(crate) seen: Option<Arc<Maneuver>>,
    /// Which of several plans it is, how its commands switch, which soft constraints it violates, and whether it may be no minimum;
    /// empty where none is to be said.
    pub(crate) remark: String,
    /// The duration of the run whose steps fit the shortest time, where they do not yet.
    pub(crate) fitting_duration: Option<f64>,
    /// Its phases.
    pub(crate) phased: Phased,
}

/// When the phases of a plan begin, and what it took to find that; empty without phases.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Phased {
    /// The steps of the run at which the phases after the first begin.
    pub(crate) switches: Vec<u64>,
    /// Number of schedules that were planned.
    pub(crate) schedules: u32,
    /// Number of times that a transfer was solved.
    pub(crate) solves: u32,
}

impl Solved {
    /// A plan of one body in a single leg.
    pub(super) fn new(plan: Plan, remark: String) -> Self {
        Self {
            plan,
            companions: Vec::new(),
            seen: None,
            remark,
            fitting_duration: None,
            phased: Phased::default(),
        }
    }

    /// Says how the plans' commands switch, which soft constraints they violate, and whether they may be no minimum.
    pub(super) fn describe(&mut self) {
        let mut all = Iteration::NONE;
        all.settle(&self.plan);
        self.companions.iter().for_each(|plan| all.join(plan));
        if let Some(switching) = self.plan.certificate.switching {
            info!("{switching}");
            self.add(&switching.to_string());
        }
        let Iteration { priced, paid, .. } = all;
        if priced > 0.0 {
            self.add(&format!(
                "soft constraints are violated by up to {priced:.3e}, which costs {paid:.6e}"
            ));
        }
        if !all.sufficient {
            self.add(NOT_MINIMUM);
        }
    }

    pub(super) fn add(&mut self, remark: &str) {
        if !self.remark.is_empty() {
            self.remark += "; ";
        }
        self.remark += remark;
    }
}

/// How a task ended without a plan.
#[derive(Clone, Debug)]
pub(crate) struct Unsolved {
    pub(crate) reason: Reason,
    pub(crate) message: String,
    /// The best iterate, where there is one.
    pub(crate) best: Option<Box<Plan>>,
    /// The constraint that stands in the way, if one does.
    pub(crate) violated: Option<Violated>,
}

impl Unsolved {
    pub(crate) fn new(reason: Reason, message: impl ToString) -> Self {
        Self {
            reason,
            message: message.to_string(),
            best: None,
            violated: None,
        }
    }

    /// Whether no plan was found, though the task makes sense and nobody ended the search.
    pub(super) fn is_missing(&self) -> bool {
        matches!(self.reason, Reason::Infeasible | Reason::NotConverged)
    }
}

impl From<PlanError> for Unsolved {
    fn from(error: PlanError) -> Self {
        let message = error.to_string();
        let violated = Violated::of(&error);
        let (reason, best) = match error {
            PlanError::Infeasible { .. }
            | PlanError::NotFound { .. }
            | PlanError::Propellant { .. }
            | PlanError::WheelSpeed { .. } => (Reason::Infeasible, None),
            PlanError::Between { best, .. } | PlanError::Chance { best, .. } => {
                (Reason::Infeasible, best)
            }
            PlanError::NotConverged { best, .. } => (Reason::NotConverged, best),
            PlanError::Stopped { best } => (Reason::Cancelled, best),
            PlanError::Dynamics { .. } => (Reason::NotConverged, None),
            _ => (Reason::Refused, None),
        };
        Self {
            reason,
            message,
            best,
            violated,
        }
    }
}
