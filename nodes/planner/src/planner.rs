use std::sync::Arc;
use std::time::{Duration, Instant};

use lgvi_control::Plan;
use lgvi_msgs::msg::PlanProgress;
use lgvi_node::{Event, Node, NodeError, PlanReport};
use lgvi_scene::{Maneuver, Scene, Scheme};
use tracing::{info, warn};

use crate::follower::Follower;
use crate::messages;
use crate::outlet::Outlet;
use crate::prediction::{PredictionError, predict};
use crate::replanner::Replanner;
use crate::sequence::Sequence;
use crate::solver::{End, Iteration, Reason, Task, Unsolved};
use crate::worker::{Stop, Update, Worker};

/// How long the worker is listened to before states, goals and the shutdown are looked after.
const LOOK: Duration = Duration::from_millis(5);

/// Sequences that may still act, or on which later ones build.
const SEQUENCES: usize = 4;

/// The node between its start and its end.
pub(crate) struct Planner<'n> {
    pub(crate) node: &'n Node,
    pub(crate) scene: Arc<Scene>,
    /// That of `scene`.
    pub(crate) maneuver: Maneuver,
    pub(crate) scheme: Scheme,
    pub(crate) outlet: Outlet,
    pub(crate) follower: Follower,
    pub(crate) worker: Worker,
    pub(crate) replanner: Option<Replanner>,
    /// What the worker is at.
    pub(crate) current: Option<Current>,
    /// What has been published, the last ones, in the order of their first steps.
    pub(crate) sequences: Vec<Sequence>,
}

/// A task in the worker's hands.
pub(crate) struct Current {
    number: u64,
    purpose: Purpose,
    first_step: u64,
    stop: Arc<Stop>,
    began: Instant,
    last: Option<Iteration>,
}

/// What a plan is made for.
pub(crate) enum Purpose {
    /// To have one at all.
    Own,
    /// To correct what has happened since the last one.
    Replan,
}

impl Planner<'_> {
    /// Plans the manoeuvre from the scene's start, and serves until the shutdown.
    pub(crate) fn run(&mut self) -> Result<(), NodeError> {
        let intervals = match self.maneuver.final_time {
            Some(range) => End::Free(range),
            None => End::After(self.scene.steps as usize),
        };
        let task = Task {
            first_step: 0,
            initial: self.scene.bodies[self.maneuver.body].state,
            end: intervals,
            guess: None,
        };
        self.begin(task, Purpose::Own, None)?;
        while !self.node.shutdown.requested() {
            if let Some((number, update)) = self.worker.hear(LOOK)? {
                self.take(number, update)?;
            }
            self.follower.look();
            self.replan()?;
        }
        self.leave();
        Ok(())
    }

    fn begin(
        &mut self,
        task: Task,
        purpose: Purpose,
        deadline: Option<Instant>,
    ) -> Result<(), NodeError> {
        let stop = Arc::new(Stop::new(deadline));
        let first_step = task.first_step;
        self.current = Some(Current {
            number: self.worker.give(task, Arc::clone(&stop))?,
            purpose,
            first_step,
            stop,
            began: Instant::now(),
            last: None,
        });
        Ok(())
    }

    /// Takes in what the worker says of the present task; of others it no longer matters.
    fn take(&mut self, number: u64, update: Update) -> Result<(), NodeError> {
        let Some(mut current) = self.current.take_if(|current| current.number == number) else {
            return Ok(());
        };
        match update {
            Update::Iteration(now) => {
                current.last = Some(now);
                self.tell(&current, &now);
                self.current = Some(current);
                Ok(())
            }
            Update::Ended(ended) => match current.purpose {
                Purpose::Own => self.own(&current, *ended),
                Purpose::Replan => self.replanned(&current, *ended),
            },
        }
    }

    /// Says where the solver is. Of plans made in flight only the outcome is told.
    fn tell(&mut self, current: &Current, now: &Iteration) {
        match current.purpose {
            Purpose::Own => {
                self.node.report(&Event::Planning(report(now)));
                self.progress(current, (PlanProgress::SOLVING, String::new()));
            }
            Purpose::Replan => {}
        }
    }

    /// Publishes the last iteration as it stands.
    fn progress(&mut self, current: &Current, outcome: (u8, String)) {
        if let Some(now) = &current.last {
            let (body, first_step) = (self.maneuver.body, current.first_step);
            let message = messages::progress(&self.scene, body, first_step, now, outcome);
            self.outlet.progress(message);
        }
    }

    /// The plan of the whole manoeuvre, without which the node has nothing to do.
    fn own(&mut self, current: &Current, ended: Result<Plan, Unsolved>) -> Result<(), NodeError> {
        let plan = match ended {
            Ok(plan) => plan,
            Err(unsolved) => {
                let Unsolved { reason, message, .. } = unsolved;
                self.progress(current, (PlanProgress::FAILED, message.clone()));
                self.outlet.await_listener(&self.node.shutdown);
                self.account();
                return match reason {
                    Reason::Cancelled => Ok(()),
                    Reason::Refused => Err(NodeError::Input(format!("no plan: {message}"))),
                    _ => Err(NodeError::Runtime(format!("no plan: {message}"))),
                };
            }
        };
        let seconds = current.began.elapsed().as_secs_f64();
        self.progress(current, (PlanProgress::CONVERGED, String::new()));
        if let Some(now) = &current.last {
            let Iteration {
                iteration,
                cost,
                violation,
                ..
            } = now;
            info!("planned in {iteration} iterations: cost {cost}, terminal error {violation:.1e}");
        }
        self.publish(current.first_step, plan)?;
        self.account();
        if let Some(now) = &current.last {
            self.node.report(&Event::Planned {
                plan: report(now),
                seconds,
            });
        }
        Ok(())
    }

    /// Begins a plan in flight where one is due.
    fn replan(&mut self) -> Result<(), NodeError> {
        let (None, Some(replanner)) = (&self.current, &mut self.replanner) else {
            return Ok(());
        };
        let (Some(now), Some(sequence)) = (self.follower.latest(), self.sequences.last()) else {
            return Ok(());
        };
        let Some(first_step) = replanner.due(now, self.follower.pace(), sequence.arrival()) else {
            return Ok(());
        };
        let deadline = now.at + replanner.deadline();
        match self.rest(first_step, true) {
            Ok(task) => self.begin(task, Purpose::Replan, Some(deadline)),
            Err(error) => {
                self.keep(first_step, &error.to_string());
                Ok(())
            }
        }
    }

    /// The task of the rest of the manoeuvre from a later step on.
    fn rest(&self, first_step: u64, warm: bool) -> Result<Task, PredictionError> {
        
    }

    /// A plan made in flight is flown if it is there in time, else the old one.
    fn replanned(
        &mut self,
        current: &Current,
        ended: Result<Plan, Unsolved>,
    ) -> Result<(), NodeError> {
        self.follower.look();
        let first_step = current.first_step;
        let reached = self.follower.latest().map_or(0, |latest| latest.step);
        let why = match ended {
            Ok(plan) if reached < first_step => {
                self.publish(first_step, plan)?;
                self.progress(current, (PlanProgress::CONVERGED, String::new()));
                if let Some(replanner) = &mut self.replanner {
                    replanner.published += 1;
                }
                let milliseconds = current.began.elapsed().as_secs_f64() * 1e3;
                info!("planned anew from step {first_step} on, in {milliseconds:.1} ms");
                self.count();
                return Ok(());
            }
            Ok(_) => format!("the flight has reached step {reached} meanwhile"),
            Err(unsolved) => unsolved.message,
        };
        self.progress(current, (PlanProgress::KEPT, why.clone()));
        self.keep(first_step, &why);
        Ok(())
    }

    /// Takes note that the old plan is flown on.
    fn keep(&mut self, first_step: u64, why: &str) {
        warn!("the old plan is kept, no new one from step {first_step} on: {why}");
        if let Some(replanner) = &mut self.replanner {
            replanner.kept += 1;
        }
        self.count();
    }

    fn count(&self) {
        if let Some(Replanner {
            published, kept, ..
        }) = self.replanner
        {
            self.node.report(&Event::Replanned { published, kept });
        }
    }
}
