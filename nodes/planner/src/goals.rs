//! What the action `plan_maneuver` says.

use std::time::{Duration, Instant};

use lgvi_control::Plan;
use lgvi_middleware::ros::{Decision, GoalHandle, StopReason};
use lgvi_msgs::action::{PlanManeuver, PlanManeuverFeedback, PlanManeuverGoal, PlanManeuverResult};
use lgvi_msgs::msg::ControlSequence;
use lgvi_scene::Scene;
use tracing::warn;

use crate::sequence::Sequence;
use crate::solver::{Iteration, Reason, violation};

/// A goal in the node's hands.
pub(crate) struct Goal {
    /// To its client.
    pub(crate) handle: GoalHandle<PlanManeuver>,
    /// When its time is used up.
    pub(crate) deadline: Option<Instant>,
}

/// A newer goal takes the place of those that are `waiting`; while the node is not active, none is accepted.
pub(crate) fn decide(goal: &PlanManeuverGoal, waiting: usize, active: bool) -> Decision {
    if !(active && goal.deadline.is_finite() && goal.deadline >= 0.0) {
        Decision::Refuse
    } else if waiting > 0 {
        Decision::Preempt
    } else {
        Decision::Accept
    }
}

/// What is said of a plan where its controls are too long to be sent: they are on `~/control_sequence`.
pub(crate) fn without_controls(result: PlanManeuverResult) -> PlanManeuverResult {
    PlanManeuverResult {
        controls: ControlSequence::default(),
        ..result
    }
}

impl Goal {
    pub(crate) fn new(handle: GoalHandle<PlanManeuver>) -> Self {
        let seconds = handle.goal().deadline;
        let limit = (seconds > 0.0)
            .then(|| Duration::try_from_secs_f64(seconds).ok())
            .flatten();
        Self {
            deadline: limit.and_then(|limit| Instant::now().checked_add(limit)),
            handle,
        }
    }

    /// Why it is to end, if it is, in the action's terms.
    pub(crate) fn over(&self, grace: Duration) -> Option<(Reason, &'static str)> {
        let late = self
            .deadline
            .is_some_and(|deadline| Instant::now() >= deadline + grace);
        match self.handle.stop_reason() {
            Some(StopReason::Cancelled) => Some((Reason::Cancelled, "cancelled")),
            Some(StopReason::Preempted) => {
                Some((Reason::Cancelled, "a newer goal has taken its place"))
            }
            Some(StopReason::Closed) => Some((Reason::Cancelled, "the planner ends")),
            None if late => Some((Reason::Deadline, "the time is used up")),
            None => None,
        }
    }

    /// Tells its client where the solver is.
    pub(crate) fn tell(&self, now: &Iteration) {
        self.handle.feedback(PlanManeuverFeedback {
            iteration: now.iteration,
            trials: now.trials,
            step_length: now.step_length,
            violation: now.violation,
            stationarity: now.stationarity,
            cost: now.cost,
            phase: now.phase.into(),
        });
    }

    /// Ends it with a plan that is flown from now on, and what is to be said of it.
    pub(crate) fn succeed(self, scene: &Scene, body: usize, sequence: &Sequence, remark: String) {
        let result = PlanManeuverResult {
            success: true,
            message: remark,
            ..with(scene, body, sequence)
        };
        self.handle.succeed(result);
    }

    /// Ends it without one; what has been found so far goes along.
    pub(crate) fn fail(
        self,
        scene: &Scene,
        body: usize,
        (reason, message): (Reason, &str),
        best: Option<&Sequence>,
    ) {
        let found = best.map_or_else(PlanManeuverResult::default, |best| with(scene, body, best));
        let result = PlanManeuverResult {
            success: false,
            reason: match reason {
                Reason::Infeasible => PlanManeuverResult::INFEASIBLE,
                Reason::NotConverged => PlanManeuverResult::NOT_CONVERGED,
                Reason::Deadline => PlanManeuverResult::DEADLINE,
                Reason::Cancelled => PlanManeuverResult::CANCELLED,
                Reason::Refused => PlanManeuverResult::REFUSED,
            },
            message: message.into(),
            ..found
        };
        match reason {
            Reason::Cancelled => self.handle.canceled(result),
            _ => self.handle.abort(result),
        }
    }
}

/// A plan, or what has become of one so far.
fn with(scene: &Scene, body: usize, sequence: &Sequence) -> PlanManeuverResult {
    let Plan {
        certificate,
        controls,
        cost,
        ..
    } = &*sequence.plan;
    let message = sequence.message(scene, body, 0);
    PlanManeuverResult {
        cost: *cost,
        violation: violation(certificate),
        stationarity: certificate.stationarity,
        condition: certificate.condition,
        sufficient: certificate.sufficient,
        duration: scene.seconds(controls.len() as u64),
        controls: message
            .inspect_err(|error| warn!("{error}"))
            .unwrap_or_default(),
        ..PlanManeuverResult::default()
    }
}
