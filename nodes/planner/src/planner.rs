use std::sync::Arc;
use std::time::{Duration, Instant};

use lgvi_control::Plan;
use lgvi_middleware::ros::ActionServer;
use lgvi_msgs::action::PlanManeuver;
use lgvi_msgs::msg::PlanProgress;
use lgvi_node::{Event, Node, NodeError, PlanReport};
use lgvi_scene::{Maneuver, Scene, Scheme};
use tracing::{info, warn};

use crate::follower::Follower;
use crate::goals::Goal;
use crate::messages;
use crate::outlet::{Outlet, PATIENCE};
use crate::prediction::predict;
use crate::replanner::Replanner;
use crate::sequence::Sequence;
use crate::solver::{End, Guess, Iteration, Reason, Task, Unsolved};
use crate::worker::{Stop, Update, Worker};

/// How long the worker is listened to before states, goals and the shutdown are looked after.
const LOOK: Duration = Duration::from_millis(5);

/// How long after its deadline a goal waits for the worker to say how far it has come.
const GRACE: Duration = Duration::from_millis(100);

/// How long acknowledgements are waited for, by topic, when the node ends.
const FAREWELL: Duration = Duration::from_millis(200);

/// Sequences that may still act, or on which later ones build.
const SEQUENCES: usize = 4;

/// The node between its start and its end.
pub(crate) struct Planner<'n> {
    pub(crate) node: &'n Node,
    pub(crate) scene: Arc<Scene>,
    /// That of `scene`.
    pub(crate) maneuver: Maneuver,
    /// What flies it.
    pub(crate) scheme: Scheme,
    pub(crate) outlet: Outlet,
    pub(crate) follower: Follower,
    pub(crate) worker: Worker,
    pub(crate) actions: ActionServer<PlanManeuver>,
    pub(crate) replanner: Option<Replanner>,
    /// What the worker is at.
    pub(crate) current: Option<Current>,
    /// A goal that waits for its turn.
    pub(crate) waiting: Option<Goal>,
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
enum Purpose {
    /// To have one at all.
    Own,
    /// To correct what has happened since the last one.
    Replan,
    /// To reach a goal.
    Goal(Goal),
}

impl Planner<'_> {
    /// Plans the manoeuvre from the scene's start, where `own` says so, and serves until the shutdown.
    pub(crate) fn run(&mut self, own: bool) -> Result<(), NodeError> {
        if own {
            let task = self.whole();
            self.begin(task, Purpose::Own, None)?;
        }
        let mut busy = false;
        while !self.node.shutdown.requested() {
            let pause = if busy { LOOK / 10 } else { LOOK };
            if let Some((number, update)) = self.worker.hear(pause)? {
                self.take(number, update)?;
            }
            busy = self.follower.look();
            self.attend_goals()?;
            self.replan()?;
        }
        self.leave();
        Ok(())
    }

    /// Ends in order: the worker ends with the process.
    fn leave(&mut self) {
        let body = self.maneuver.body;
        let why = (Reason::Cancelled, "the planner ends");
        if let Some(current) = self.current.take() {
            current.stop.cancel();
            if let Purpose::Goal(goal) = current.purpose {
                goal.fail(&self.scene, body, why, None);
            }
        }
        if let Some(goal) = self.waiting.take() {
            goal.fail(&self.scene, body, why, None);
        }
        self.account(FAREWELL);
    }

    /// The task of the whole manoeuvre.
    fn whole(&self) -> Task {
        Task {
            first_step: 0,
            initial: self.scene.bodies[self.maneuver.body].state,
            end: match self.maneuver.final_time {
                Some(range) => End::Free(range),
                None => End::After(self.scene.steps as usize),
            },
            guess: None,
        }
    }

    /// The task of the rest of the manoeuvre from a later step on, to arrive when the last plan does.
    fn rest(&self, first_step: u64, warm: bool) -> Result<Task, String> {
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
        let (scheme, body) = (self.scheme, self.maneuver.body);
        let initial = predict(
            &self.scene,
            scheme,
            body,
            latest,
            &self.sequences,
            first_step,
        )
        .map_err(|error| error.to_string())?;
        let guess = last.filter(|last| warm && last.first_step <= first_step);
        Ok(Task {
            first_step,
            initial,
            end: End::After(intervals as usize),
            guess: guess.map(|last| Guess {
                plan: Arc::clone(&last.plan),
                flown: (first_step - last.first_step) as usize,
            }),
        })
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
            Update::Ended(ended) => {
                self.conclude(&current, &ended);
                match current.purpose {
                    Purpose::Own => self.own(&current, *ended),
                    Purpose::Replan => self.replanned(&current, *ended),
                    Purpose::Goal(goal) => self.reached(goal, current.first_step, *ended),
                }
            }
        }
    }

    /// Says where the solver is. Of plans made in flight only the outcome is told.
    fn tell(&mut self, current: &Current, now: &Iteration) {
        match &current.purpose {
            Purpose::Own => self.node.report(&Event::Planning(report(now))),
            Purpose::Goal(goal) => goal.tell(now),
            Purpose::Replan => return,
        }
        self.progress(current, (PlanProgress::SOLVING, String::new()));
    }

    /// Says how the solver has ended.
    fn conclude(&mut self, current: &Current, ended: &Result<Plan, Unsolved>) {
        let outcome = match (ended, &current.purpose) {
            (Ok(_), _) => (PlanProgress::CONVERGED, String::new()),
            (Err(unsolved), Purpose::Replan) => (PlanProgress::KEPT, unsolved.message.clone()),
            (Err(unsolved), _) => (PlanProgress::FAILED, unsolved.message.clone()),
        };
        self.progress(current, outcome);
    }

    /// Publishes the last iteration as it stands.
    fn progress(&mut self, current: &Current, outcome: (u8, String)) {
        if let Some(now) = &current.last {
            let (body, first_step) = (self.maneuver.body, current.first_step);
            let message = messages::progress(&self.scene, body, first_step, now, outcome);
            self.outlet.progress(message);
        }
    }

    fn publish(&mut self, first_step: u64, plan: Plan) -> Result<Sequence, NodeError> {
        let sequence = Sequence::new(&self.maneuver, first_step, plan);
        self.outlet
            .plan(&self.scene, self.maneuver.body, &sequence)?;
        // As the propagator does: the later one takes the place of those that would begin after it.
        self.sequences
            .retain(|earlier| earlier.first_step < first_step);
        if self.sequences.len() == SEQUENCES {
            self.sequences.remove(0);
        }
        self.sequences.push(sequence.clone());
        Ok(sequence)
    }

    /// Tells the supervisor what has been published so far, when those who listen have it.
    fn account(&self, patience: Duration) {
        let messages = self.outlet.settle(patience);
        self.node.report(&Event::Published { messages });
    }

    /// The plan of the whole manoeuvre, without which the node has nothing to do.
    fn own(&mut self, current: &Current, ended: Result<Plan, Unsolved>) -> Result<(), NodeError> {
        let plan = match ended {
            Ok(plan) => plan,
            Err(Unsolved {
                reason, message, ..
            }) => {
                self.outlet.await_listener(&self.node.shutdown);
                self.account(PATIENCE);
                return match reason {
                    Reason::Cancelled => Ok(()),
                    Reason::Refused => Err(NodeError::Input(format!("no plan: {message}"))),
                    _ => Err(NodeError::Runtime(format!("no plan: {message}"))),
                };
            }
        };
        let seconds = current.began.elapsed().as_secs_f64();
        self.publish(current.first_step, plan)?;
        self.account(PATIENCE);
        if let Some(now) = &current.last {
            let Iteration {
                iteration,
                cost,
                violation,
                ..
            } = now;
            info!("planned in {iteration} iterations: cost {cost}, violation {violation:.1e}");
            self.node.report(&Event::Planned {
                plan: report(now),
                seconds,
            });
        }
        Ok(())
    }

    /// Begins a plan in flight where one is due.
    fn replan(&mut self) -> Result<(), NodeError> {
        let (None, None, Some(replanner)) = (&self.current, &self.waiting, &mut self.replanner)
        else {
            return Ok(());
        };
        let (Some(now), Some(sequence)) = (self.follower.latest(), self.sequences.last()) else {
            return Ok(());
        };
        let deadline = now.at + replanner.deadline();
        let pace = self.follower.pace();
        let Some(first_step) = replanner.due(now, pace, sequence.arrival()) else {
            return Ok(());
        };
        match self.rest(first_step, true) {
            Ok(task) => self.begin(task, Purpose::Replan, Some(deadline)),
            Err(why) => {
                self.keep(first_step, &why);
                Ok(())
            }
        }
    }

    /// A plan made in flight is flown if it is there in time, else the old one.
    fn replanned(
        &mut self,
        current: &Current,
        ended: Result<Plan, Unsolved>,
    ) -> Result<(), NodeError> {
        let first_step = current.first_step;
        let plan = match ended.map_err(|unsolved| unsolved.message) {
            Ok(plan) => self.in_time(first_step).map(|()| plan),
            Err(why) => Err(why),
        };
        match plan {
            Ok(plan) => {
                self.publish(first_step, plan)?;
                if let Some(replanner) = &mut self.replanner {
                    replanner.published += 1;
                }
                let milliseconds = current.began.elapsed().as_secs_f64() * 1e3;
                info!("planned anew from step {first_step} on in {milliseconds:.1} ms");
                self.count();
            }
            Err(why) => self.keep(first_step, &why),
        }
        Ok(())
    }

    /// Whether a sequence that begins at `first_step` can still be flown.
    fn in_time(&mut self, first_step: u64) -> Result<(), String> {
        self.follower.look();
        match self.follower.latest() {
            // The flight holds at step 0 until it has a sequence.
            Some(latest) if latest.step >= first_step && latest.step > 0 => Err(format!(
                "the flight has reached step {} meanwhile",
                latest.step
            )),
            _ => Ok(()),
        }
    }

    /// Takes note that the old plan is flown on.
    fn keep(&mut self, first_step: u64, why: &str) {
        warn!("the old plan is kept, there is no new one from step {first_step} on: {why}");
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

    /// Ends goals that are over, takes up new ones, and begins the one whose turn it is.
    fn attend_goals(&mut self) -> Result<(), NodeError> {
        self.end_goals();
        if let Some(handle) = self.actions.next_goal(Duration::ZERO) {
            let goal = Goal::new(handle);
            if let Some(older) = self.waiting.replace(goal) {
                let why = (Reason::Cancelled, "a newer goal has taken its place");
                older.fail(&self.scene, self.maneuver.body, why, None);
            }
        }
        // The node's own plan comes first; one in flight gives way.
        let busy = match &self.current {
            None => false,
            Some(current) => !matches!(current.purpose, Purpose::Replan),
        };
        if busy {
            return Ok(());
        }
        let Some(goal) = self.waiting.take() else {
            return Ok(());
        };
        if let Some(replan) = self.current.take() {
            replan.stop.cancel();
        }
        let (first_step, warm) = (goal.handle.goal().first_step, goal.handle.goal().warm);
        let task = match (first_step, self.in_time(first_step)) {
            (_, Err(why)) => Err(why),
            (0, Ok(())) => Ok(self.whole()),
            (_, Ok(())) => self.rest(first_step, warm),
        };
        match task {
            Ok(task) => {
                let deadline = goal.deadline;
                self.begin(task, Purpose::Goal(goal), deadline)
            }
            Err(why) => {
                let why = (Reason::Refused, why.as_str());
                goal.fail(&self.scene, self.maneuver.body, why, None);
                Ok(())
            }
        }
    }

    /// Ends goals that are cancelled, or have found no plan in their time, whatever the worker is at.
    fn end_goals(&mut self) {
        let body = self.maneuver.body;
        if let Some(goal) = self
            .waiting
            .take_if(|goal| goal.over(Duration::ZERO).is_some())
            && let Some(why) = goal.over(Duration::ZERO)
        {
            goal.fail(&self.scene, body, why, None);
        }
        let over = |current: &Current| match &current.purpose {
            Purpose::Goal(goal) => goal.over(GRACE),
            _ => None,
        };
        if let Some(why) = self.current.as_ref().and_then(over)
            && let Some(current) = self.current.take()
        {
            current.stop.cancel();
            self.progress(&current, (PlanProgress::FAILED, why.1.into()));
            if let Purpose::Goal(goal) = current.purpose {
                goal.fail(&self.scene, body, why, None);
            }
        }
    }

    /// A goal's plan is flown if it is there in time.
    fn reached(
        &mut self,
        goal: Goal,
        first_step: u64,
        ended: Result<Plan, Unsolved>,
    ) -> Result<(), NodeError> {
        let body = self.maneuver.body;
        let sequence = |plan| Sequence::new(&self.maneuver, first_step, plan);
        match ended {
            Ok(plan) => match self.in_time(first_step) {
                Ok(()) => {
                    let sequence = self.publish(first_step, plan)?;
                    goal.succeed(&self.scene, body, &sequence);
                }
                Err(why) => {
                    let late = Sequence::new(&self.maneuver, first_step, plan);
                    goal.fail(&self.scene, body, (Reason::Refused, &why), Some(&late));
                }
            },
            Err(Unsolved {
                reason,
                message,
                best,
            }) => {
                let best = best.map(|best| sequence(*best));
                goal.fail(&self.scene, body, (reason, &message), best.as_ref());
            }
        }
        Ok(())
    }
}

fn report(now: &Iteration) -> PlanReport {
    PlanReport {
        iterations: now.iteration,
        trials: now.trials,
        violation: now.violation,
        cost: now.cost,
    }
}
