mod flight;
mod on_demand;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use lgvi_common::{Event, PhaseReport, PhasesReport, PlanReport, SoftReport, Warning, WarningCode};
use lgvi_middleware::node::{Node, NodeError};
use lgvi_middleware::report::Reporter;
use lgvi_middleware::ros::{ActionServer, Diagnosed};
use lgvi_msgs::action::PlanManeuver;
use lgvi_msgs::msg::PlanProgress;
use lgvi_scene::{Maneuver, Scene, Scheme};
use tracing::{info, warn};

use crate::follower::Follower;
use crate::goals::Goal;
use crate::messages;
use crate::monitor::Monitor;
use crate::outlet::{Outlet, PATIENCE};
use crate::replanner::Replanner;
use crate::sequence::Sequence;
use crate::solver::{Iteration, NOT_MINIMUM, Phased, Reason, Solved, Task, Unsolved};
use crate::used::Used;
use crate::worker::{Stop, Update, Worker};

/// How long the worker is listened to before states, goals and the shutdown are looked after.
const LOOK: Duration = Duration::from_millis(5);

/// How long acknowledgments are waited for, by topic, when the node ends.
const FAREWELL: Duration = Duration::from_millis(200);

/// The node while it is configured.
pub(crate) struct Planner {
    pub(crate) events: Arc<Reporter>,
    pub(crate) scene: Arc<Scene>,
    /// That of `scene`.
    pub(crate) maneuver: Maneuver,
    /// What flies it.
    pub(crate) scheme: Scheme,
    pub(crate) outlet: Outlet,
    pub(crate) follower: Follower,
    pub(crate) worker: Worker,
    pub(crate) actions: ActionServer<PlanManeuver>,
    /// Whether goals are accepted.
    pub(crate) active: Arc<AtomicBool>,
    pub(crate) monitor: Arc<Monitor>,
    pub(crate) _diagnosed: Diagnosed,
    pub(crate) replanner: Option<Replanner>,
    /// What the worker is at.
    pub(crate) current: Option<Current>,
    /// A goal that waits for its turn.
    pub(crate) waiting: Option<Goal>,
    /// What has been published and may still act, in the order of the first steps.
    pub(crate) sequences: Vec<Sequence>,
    /// What those before the first of them have used.
    pub(crate) used_before: Used,
    /// The one of them that the flight begins with, whenever it begins anew.
    pub(crate) initial: Option<Sequence>,
    /// The flight's course that they are for.
    pub(crate) course: u64,
}

/// A task in the worker's hands.
pub(crate) struct Current {
    number: u64,
    purpose: Purpose,
    first_step: u64,
    stop: Arc<Stop>,
    began: Instant,
    last: Iteration,
}

/// What a plan is made for.
enum Purpose {
    /// To have one at all.
    Own,
    /// To correct what has happened since the last one.
    Replan(Origin),
    /// To reach a goal.
    Goal(Goal),
}

/// The state that a plan in flight is made from.
#[derive(Clone, Copy)]
struct Origin {
    step: u64,
    /// When it was heard.
    at: Instant,
}

impl Planner {
    /// Plans the maneuver from the scene's start, where `own` says so and there is no plan yet, and serves until the
    /// node is to stop.
    pub(crate) fn work(&mut self, node: &Node, own: bool) -> Result<(), NodeError> {
        if own && self.sequences.is_empty() {
            let task = self.whole(false);
            self.begin(task, Purpose::Own, None)?;
        }
        let mut busy = false;
        while !node.interrupted() {
            let pause = if busy { LOOK / 10 } else { LOOK };
            if let Some((number, update)) = self.worker.hear(pause)? {
                self.take(node, number, update)?;
            }
            busy = !self.waited_for() && self.look();
            self.follow();
            self.attend_goals()?;
            self.replan()?;
        }
        Ok(())
    }

    /// Whether the flight waits for the plans made on its way.
    pub(crate) fn in_lockstep(&self) -> bool {
        let replanner = self.replanner.as_ref();
        replanner.is_some_and(Replanner::in_lockstep)
    }

    /// Whether the flight waits for what the worker is at: in lockstep a plan is made of the state that it is due at, though
    /// later ones may have come.
    fn waited_for(&self) -> bool {
        let purpose = self.current.as_ref().map(|current| &current.purpose);
        self.in_lockstep() && matches!(purpose, Some(Purpose::Own | Purpose::Replan(_)))
    }

    /// Takes in where the flight is; whether the next look should come soon.
    pub(crate) fn look(&mut self) -> bool {
        let replanner = self.replanner.as_ref();
        self.follower
            .look(|step| replanner.is_some_and(|replanner| replanner.stops_at(step)))
    }

    /// Ends what is under way: nobody waits for it.
    pub(crate) fn leave(&mut self) {
        self.follower.end();
        let body = self.maneuver.body;
        let why = (Reason::Cancelled, "the planner stops");
        if let Some(current) = self.current.take() {
            current.stop.cancel();
            if let Purpose::Goal(goal) = current.purpose {
                goal.fail(&self.scene, body, why, None);
            }
        }
        let accepted = std::iter::from_fn(|| self.actions.next_goal(Duration::ZERO));
        for goal in self
            .waiting
            .take()
            .into_iter()
            .chain(accepted.map(Goal::new))
        {
            goal.fail(&self.scene, body, why, None);
        }
        self.account(FAREWELL);
    }

    /// The task of the whole maneuver, from the last plan of it or from nothing.
    fn whole(&self, warm: bool) -> Task {
        Task {
            guess: warm.then(|| self.guess(0)).flatten(),
            ..Task::whole(&self.scene, &self.maneuver)
        }
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
            last: Iteration::NONE,
        });
        Ok(())
    }

    /// Takes in what the worker says of the present task; of others it no longer matters.
    fn take(&mut self, node: &Node, number: u64, update: Update) -> Result<(), NodeError> {
        let Some(mut current) = self.current.take_if(|current| current.number == number) else {
            return Ok(());
        };
        match update {
            Update::Iteration(now) => {
                current.last = now;
                self.tell(&current, &now);
                self.current = Some(current);
                Ok(())
            }
            Update::Ended(ended) => {
                if let Ok(solved) = &*ended {
                    current.last.settle(&solved.plan);
                    let companions = solved.companions.iter();
                    companions.for_each(|plan| current.last.join(plan));
                }
                self.monitor
                    .note(&current.last, current.began.elapsed(), ended.is_ok());
                self.conclude(&current, &ended);
                match current.purpose {
                    Purpose::Own => self.own(node, &current, *ended),
                    Purpose::Replan(origin) => self.replanned(&current, origin, *ended),
                    Purpose::Goal(goal) => self.reached(goal, current.first_step, *ended),
                }
            }
        }
    }

    /// Says where the solver is. Of plans made in flight only the outcome is told.
    fn tell(&mut self, current: &Current, now: &Iteration) {
        match &current.purpose {
            // JSON has no other numbers.
            Purpose::Own if now.violation.is_finite() && now.cost.is_finite() => {
                self.events.progress(Event::Planning(report(now)));
            }
            Purpose::Own => {}
            Purpose::Goal(goal) => goal.tell(now),
            Purpose::Replan(_) => return,
        }
        let outcome = (PlanProgress::SOLVING, String::new());
        self.progress(current.first_step, now, outcome);
    }

    /// Says how the solver has ended. Of a plan made in flight that is not enough to know what becomes of it.
    fn conclude(&mut self, current: &Current, ended: &Result<Solved, Unsolved>) {
        let outcome = match (&current.purpose, ended) {
            (Purpose::Replan(_), _) => return,
            (_, Ok(solved)) => (PlanProgress::CONVERGED, solved.remark.clone()),
            (_, Err(unsolved)) => (PlanProgress::FAILED, unsolved.message.clone()),
        };
        self.progress(current.first_step, &current.last, outcome);
    }

    /// Publishes an iteration of a plan that begins at `first_step`, with what has become of it.
    fn progress(&mut self, first_step: u64, now: &Iteration, outcome: (u8, String)) {
        let body = self.maneuver.body;
        let message = messages::progress(&self.scene, body, first_step, now, outcome);
        self.outlet.progress(message);
    }

    fn publish(&mut self, first_step: u64, solved: Solved) -> Result<Sequence, NodeError> {
        let sequence = Sequence::of(&self.maneuver, first_step, solved);
        self.outlet.plan(&self.scene, &sequence)?;
        // As the propagator does: the later one takes the place of those that would begin after it.
        self.sequences
            .retain(|earlier| earlier.first_step < first_step);
        let reached = self.follower.latest().map_or(0, |latest| latest.step);
        while let [_, next, ..] = &self.sequences[..]
            && next.first_step <= reached
        {
            let end = next.first_step;
            let gone = self.sequences.remove(0);
            let body = &self.scene.bodies[self.maneuver.body].body;
            self.used_before.add(&self.scene, body, &gone, end);
        }
        self.sequences.push(sequence.clone());
        if first_step == 0 {
            self.initial = Some(sequence.clone());
        }
        Ok(sequence)
    }

    /// Tells the supervisor, if there is one.
    pub(crate) fn report(&self, event: Event) {
        self.events.report(event);
    }

    /// Tells the supervisor what has been published so far, when those who listen have it.
    fn account(&self, patience: Duration) {
        match self.outlet.settle(patience) {
            Ok(messages) => self.report(Event::Published { messages }),
            Err(error) => warn!("{error}"),
        }
    }

    /// The plan of the whole maneuver, without which the node has nothing to do.
    fn own(
        &mut self,
        node: &Node,
        current: &Current,
        ended: Result<Solved, Unsolved>,
    ) -> Result<(), NodeError> {
        let solved = match ended {
            Ok(solved) => solved,
            Err(Unsolved {
                reason, message, ..
            }) => {
                info!("no plan; subscribers to the progress have a moment to connect");
                self.outlet.await_listener(node);
                self.account(PATIENCE);
                return match reason {
                    Reason::Cancelled => Ok(()),
                    Reason::Refused => Err(NodeError::Input(format!("no plan: {message}"))),
                    _ => Err(NodeError::Runtime(format!("no plan: {message}"))),
                };
            }
        };
        let seconds = current.began.elapsed().as_secs_f64();
        let sequence = self.publish(current.first_step, solved)?;
        // The flight has begun: where it waits for no plan, acknowledgments are waited for when it is over.
        if self.replanner.is_none() || self.in_lockstep() {
            self.account(PATIENCE);
        }
        for (one, maneuver) in sequence.all().zip(self.maneuver.planned()) {
            let alone = Scene {
                maneuver: Some(maneuver.clone()),
                ..(*self.scene).clone()
            };
            if let Some(warning) = alone.coarse_steps(self.scheme, &one.plan.controls) {
                Warning::new(WarningCode::CoarseSteps, warning).tell(&node.events);
            }
        }
        let Iteration {
            iteration,
            cost,
            violation,
            stationarity,
            condition,
            sufficient,
            ..
        } = current.last;
        info!(
            "planned in {iteration} iterations: cost {cost}, violation {violation:.1e}, stationarity {stationarity:.1e}, \
             condition {condition:.1e}, known to be a strict minimum: {sufficient}"
        );
        if !sufficient {
            Warning::new(WarningCode::NotMinimum, NOT_MINIMUM).tell(&node.events);
        }
        let phases = self.phases(&sequence.phased);
        self.report(Event::Planned {
            plan: PlanReport {
                phases,
                ..report(&current.last)
            },
            seconds,
        });
        Ok(())
    }
}

impl Planner {
    /// The phases of a plan, if the maneuver has any.
    fn phases(&self, phased: &Phased) -> Option<PhasesReport> {
        let schedule = self.maneuver.schedule(&phased.switches, self.scene.steps);
        let legs = schedule.map(|(phase, [first_step, end])| PhaseReport {
            name: phase.name.clone(),
            first_step,
            steps: end - first_step,
        });
        let legs: Vec<_> = legs.collect();
        (!legs.is_empty()).then_some(PhasesReport {
            legs,
            schedules: phased.schedules,
            solves: phased.solves,
        })
    }
}

fn report(now: &Iteration) -> PlanReport {
    PlanReport {
        iterations: now.iteration,
        trials: now.trials,
        violation: now.violation,
        cost: now.cost,
        phases: None,
        soft: (now.priced > 0.0).then_some(SoftReport {
            violation: now.priced,
            paid: now.paid,
        }),
    }
}
