//! The plans that are made in flight.

use std::sync::atomic::Ordering;

use lgvi_common::{Event, ReplanReport, Warning, WarningCode};
use lgvi_middleware::node::NodeError;
use lgvi_msgs::msg::PlanProgress;
use tracing::{info, warn};

use super::{Current, Origin, Planner, Purpose};
use crate::prediction::Forecast;
use crate::replanner::Replanner;
use crate::sequence::Sequence;
use crate::solver::{
    End, Guess, Initial, Iteration, NOT_MINIMUM_IN_FLIGHT, Reason, Solved, Task, Unsolved,
    check_known,
};
use crate::used::Used;

/// Why a plan is not flown that was made for an earlier course of the flight.
const ANEW: &str = "the flight has restarted";

impl Planner {
    /// The task of the rest of the maneuver from a later step on, to arrive when the last plan does.
    pub(super) fn rest(&self, first_step: u64, warm: bool) -> Result<Task, String> {
        let latest = self
            .follower
            .latest()
            .ok_or("no state of the flight has been heard of")?;
        let last = self.sequences.last();
        let arrival = last.map_or(self.scene.steps, Sequence::arrival);
        let intervals = arrival.saturating_sub(first_step);
        if intervals < 2 {
            let arrival = format!("the arrival at step {arrival}");
            return Err(format!(
                "`first_step` is {first_step}, expected at least two steps before {arrival}"
            ));
        }
        if self.initial.is_none() {
            let known = check_known(&self.scene, &self.maneuver, first_step);
            known.map_err(|unsolved| unsolved.message)?;
        }
        let forecast = Forecast {
            scheme: self.scheme,
            from: latest.clone(),
            sequences: self.sequences.clone(),
            used_before: self.used_before.clone(),
        };
        Ok(Task {
            first_step,
            initial: Initial::Forecast(Box::new(forecast)),
            end: End::After(intervals as usize),
            guess: warm.then(|| self.guess(first_step)).flatten(),
            switches: last.map(|last| last.phased.switches.clone()),
        })
    }

    /// The last plan that will be flown at a step, to start from.
    pub(super) fn guess(&self, first_step: u64) -> Option<Guess> {
        let mut newest = self.sequences.iter().rev();
        let flown = newest.find(|sequence| sequence.first_step <= first_step)?;
        Some(flown.guess(first_step))
    }

    /// Begins a plan in flight where one is due.
    pub(super) fn replan(&mut self) -> Result<(), NodeError> {
        let (None, None, Some(replanner)) = (&self.current, &self.waiting, &mut self.replanner)
        else {
            return Ok(());
        };
        let (Some(now), Some(sequence)) = (self.follower.latest(), self.sequences.last()) else {
            return Ok(());
        };
        let origin = Origin {
            step: now.step,
            at: now.at,
        };
        let deadline = origin.at + replanner.deadline();
        let deadline = (!replanner.in_lockstep()).then_some(deadline);
        let pace = self.follower.pace();
        let Some(first_step) = replanner.due(now, pace, sequence.arrival()) else {
            return Ok(());
        };
        match self.rest(first_step, true) {
            Ok(task) => self.begin(task, Purpose::Replan(origin), deadline),
            Err(why) => self.keep(first_step, origin, Iteration::NONE, why),
        }
    }

    /// A plan made in flight is flown if it is there in time, else the old one.
    pub(super) fn replanned(
        &mut self,
        current: &Current,
        origin: Origin,
        ended: Result<Solved, Unsolved>,
    ) -> Result<(), NodeError> {
        let first_step = current.first_step;
        let solved = match ended.map_err(|unsolved| unsolved.message) {
            Ok(solved) if self.in_lockstep() => Ok(solved),
            Ok(solved) => self.in_time(first_step).map(|()| solved),
            Err(why) => Err(why),
        };
        match solved {
            Ok(solved) => {
                let sufficient = current.last.sufficient;
                let remark = match solved.companions.is_empty() {
                    true => String::new(),
                    false => solved.remark.clone(),
                };
                self.publish(first_step, solved)?;
                let seconds = origin.at.elapsed().as_secs_f64();
                if !sufficient {
                    Warning::new(WarningCode::NotMinimum, NOT_MINIMUM_IN_FLIGHT).tell(&self.events);
                }
                let outcome = (PlanProgress::CONVERGED, remark);
                self.progress(first_step, &current.last, outcome);
                if let Some(replanner) = &mut self.replanner {
                    replanner.published += 1;
                }
                let milliseconds = seconds * 1e3;
                info!("replanned from step {first_step} in {milliseconds:.1} ms");
                self.count(ReplanReport {
                    step: origin.step,
                    first_step,
                    seconds,
                    iterations: current.last.iteration,
                    kept: None,
                });
                Ok(())
            }
            Err(why) => self.keep(first_step, origin, current.last, why),
        }
    }

    /// If the flight has restarted, forgets what was planned for its earlier course.
    pub(super) fn follow(&mut self) {
        if self.follower.course() == self.course {
            return;
        }
        self.course = self.follower.course();
        info!("the flight has restarted");
        self.sequences = self.initial.iter().cloned().collect();
        self.used_before = Used::default();
        if let Some(replanner) = &mut self.replanner {
            replanner.begin_anew();
        }
        let in_flight = |current: &mut Current| current.first_step > 0;
        let Some(Current { purpose, stop, .. }) = self.current.take_if(in_flight) else {
            return;
        };
        stop.cancel();
        if let Purpose::Goal(goal) = purpose {
            let why = (Reason::Refused, ANEW);
            goal.fail(&self.scene, self.maneuver.body, why, None);
        }
    }

    /// Whether a sequence that begins at `first_step` can still be flown.
    pub(super) fn in_time(&mut self, first_step: u64) -> Result<(), String> {
        self.look();
        if first_step > 0 && self.follower.course() != self.course {
            return Err(ANEW.to_owned());
        }
        match self.follower.latest() {
            // The flight holds at step 0 until it has a sequence.
            Some(latest) if latest.step >= first_step && latest.step > 0 => Err(format!(
                "the flight has reached step {} meanwhile",
                latest.step
            )),
            _ => Ok(()),
        }
    }

    /// Takes note that the old plan is flown on. A flight in lockstep gets the rest of it in place of a new one.
    fn keep(
        &mut self,
        first_step: u64,
        origin: Origin,
        last: Iteration,
        why: String,
    ) -> Result<(), NodeError> {
        if self.in_lockstep() {
            let mut newest = self.sequences.iter().rev();
            if let Some(flown) = newest.find(|sequence| sequence.first_step <= first_step) {
                for one in flown.all() {
                    self.outlet.rest(&self.scene, one, first_step)?;
                }
            }
        }
        warn!("the old plan is kept; there is no new plan from step {first_step}: {why}");
        self.progress(first_step, &last, (PlanProgress::KEPT, why.clone()));
        if let Some(replanner) = &mut self.replanner {
            replanner.kept += 1;
        }
        self.monitor.kept.fetch_add(1, Ordering::Relaxed);
        self.count(ReplanReport {
            step: origin.step,
            first_step,
            seconds: origin.at.elapsed().as_secs_f64(),
            iterations: last.iteration,
            kept: Some(why),
        });
        Ok(())
    }

    fn count(&self, last: ReplanReport) {
        if let Some(Replanner {
            published, kept, ..
        }) = self.replanner
        {
            self.report(Event::Replanned {
                published,
                kept,
                last,
            });
        }
    }
}
