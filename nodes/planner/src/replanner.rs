use std::time::Duration;

use lgvi_scene::Replan;
use tracing::{info, warn};

use crate::follower::Observed;

/// What a sequence needs from the planner to the propagator's loop, and states on their way here.
const TRANSPORT: Duration = Duration::from_millis(10);

/// Decides when the maneuver is planned anew in flight, and from which step on.
pub(crate) struct Replanner {
    options: Replan,
    /// The step size (s) of a flight that waits for the plans made on its way; `None` where it does not.
    lockstep: Option<f64>,
    /// The last multiple of [`Replan::every`] that has had its plan.
    last: u64,
    /// No plan is made any more.
    over: bool,
    /// Plans that have been published in flight.
    pub(crate) published: u64,
    /// Times when the old plan was kept because there was no new one.
    pub(crate) kept: u64,
}

impl Replanner {
    pub(crate) fn new(options: Replan, lockstep: Option<f64>) -> Self {
        Self {
            options,
            lockstep,
            last: 0,
            over: false,
            published: 0,
            kept: 0,
        }
    }

    /// The flight begins anew, at step 0.
    pub(crate) fn begin_anew(&mut self) {
        self.last = 0;
        self.over = false;
    }

    /// Whether the flight waits for the plans made on its way.
    pub(crate) fn in_lockstep(&self) -> bool {
        self.lockstep.is_some()
    }

    /// Whether the flight waits at `step` for the plan made there, in lockstep.
    pub(crate) fn stops_at(&self, step: u64) -> bool {
        self.in_lockstep() && step.is_multiple_of(self.options.every)
    }

    /// Wall-clock time from the state that is planned from to the plan.
    pub(crate) fn deadline(&self) -> Duration {
        Duration::from_secs_f64(self.options.deadline.min(1e9))
    }

    /// The step that a plan made now begins at: the one that the flight will have reached by the deadline at `pace` (steps
    /// a second). `None` where none is due, and once fewer than [`Replan::every`] steps, or two, would be left to it.
    pub(crate) fn due(&mut self, now: &Observed, pace: Option<f64>, arrival: u64) -> Option<u64> {
        let turn = now.step / self.options.every;
        if self.over || turn <= self.last {
            return None;
        }
        if let Some(step_size) = self.lockstep {
            let first_step = self.options.in_lockstep(now.step, step_size, arrival)?;
            self.last = turn;
            return Some(first_step);
        }
        let pace = pace?;
        let lead = self.deadline() + TRANSPORT + now.at.elapsed();
        let ahead = (pace * lead.as_secs_f64()).ceil() as u64;
        let first_step = now.step.saturating_add(ahead).saturating_add(1);
        if first_step.saturating_add(self.options.every.max(2)) > arrival {
            self.over = true;
            let step = now.step;
            if self.published + self.kept == 0 {
                let deadline = self.options.deadline;
                warn!(
                    "no plan is made in flight: at {pace:.0} steps/s it arrives before one made at step {step} within \
                     {deadline:?} s could act"
                );
            } else {
                info!(
                    "the last plan is flown to the end: at step {step} too little is left for another"
                );
            }
            return None;
        }
        self.last = turn;
        Some(first_step)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;

    fn at(step: u64) -> Observed {
        Observed {
            step,
            states: Vec::new(),
            at: Instant::now(),
        }
    }

    fn replanner(deadline: f64) -> Replanner {
        let options = Replan {
            every: 10,
            deadline,
        };
        Replanner::new(options, None)
    }

    #[test]
    fn in_lockstep_a_plan_is_due_once_at_each_turn_whatever_the_pace() {
        let replan = Replan {
            every: 10,
            deadline: 0.5,
        };
        let mut replanner = Replanner::new(replan, Some(0.1));
        let mut due = |step| replanner.due(&at(step), None, 40);
        let expected = [
            (9, None),
            (10, Some(15)),
            (10, None),
            (11, None),
            (20, Some(25)),
        ];
        for (step, first_step) in expected.into_iter().chain([(29, None), (30, None)]) {
            assert_eq!(due(step), first_step, "step {step}");
        }
    }

    #[test]
    fn a_plan_is_due_once_every_so_many_steps_and_begins_after_the_deadline() {
        let mut replanner = replanner(0.5);
        assert_eq!(replanner.due(&at(9), Some(100.0), 200), None);
        assert_eq!(
            replanner.due(&at(12), None, 200),
            None,
            "no pace is known yet"
        );
        let first = replanner.due(&at(12), Some(100.0), 200).unwrap();
        // 50 steps until the deadline, 1 for the transport, and what this test takes.
        assert!((12 + 51..12 + 151).contains(&first), "{first}");
        assert_eq!(replanner.due(&at(19), Some(100.0), 200), None);
        assert!(replanner.due(&at(20), Some(100.0), 200).is_some());
        assert!(
            replanner.due(&at(50), Some(100.0), 200).is_some(),
            "turns that were missed are not made up"
        );
        assert_eq!(replanner.due(&at(59), Some(100.0), 200), None);
    }

    #[test]
    fn near_the_arrival_no_plan_is_made_any_more() {
        let mut replanner = replanner(0.5);
        assert!(replanner.due(&at(100), Some(100.0), 200).is_some());
        assert_eq!(replanner.due(&at(150), Some(100.0), 200), None);
        assert_eq!(
            replanner.due(&at(160), Some(1.0), 200),
            None,
            "not even if the flight slows down"
        );
    }

    #[test]
    fn a_flight_that_begins_anew_is_planned_anew_from_its_first_turn_on() {
        let mut replanner = replanner(0.5);
        assert!(replanner.due(&at(100), Some(100.0), 200).is_some());
        assert_eq!(replanner.due(&at(150), Some(100.0), 200), None);
        replanner.begin_anew();
        assert_eq!(replanner.due(&at(9), Some(100.0), 200), None);
        assert!(replanner.due(&at(10), Some(100.0), 200).is_some());
    }

    #[test]
    fn a_flight_that_is_too_fast_is_not_planned_anew() {
        let mut replanner = replanner(0.5);
        assert_eq!(replanner.due(&at(10), Some(1e6), 1000), None);
        assert!(replanner.over);
    }

    #[test]
    fn a_step_that_no_flight_has_is_planned_nothing_for() {
        let mut replanner = replanner(0.5);
        assert_eq!(
            replanner.due(&at(u64::MAX), Some(1e300), u64::MAX - 1),
            None
        );
        assert!(replanner.over);
    }
}
