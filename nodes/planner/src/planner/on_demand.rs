//! The plans that clients of the action ask for.

use std::time::Duration;

use lgvi_middleware::node::NodeError;
use lgvi_msgs::msg::PlanProgress;

use super::{Current, Planner, Purpose};
use crate::goals::Goal;
use crate::sequence::Sequence;
use crate::solver::{Reason, Solved, Unsolved};

/// How long after its deadline a goal waits for the worker to say how far it has come.
const GRACE: Duration = Duration::from_millis(100);

impl Planner {
    /// Ends goals that are over, takes up new ones, and begins the one whose turn it is.
    pub(super) fn attend_goals(&mut self) -> Result<(), NodeError> {
        self.end_goals();
        if let Some(handle) = self.actions.next_goal(Duration::ZERO) {
            let goal = Goal::new(handle);
            if let Some(older) = self.waiting.replace(goal) {
                let why = (Reason::Cancelled, "a newer goal has taken its place");
                older.fail(&self.scene, self.maneuver.body, why, None);
            }
        }
        // The node's own plan comes first; one in flight gives way, unless the flight waits for it.
        let busy = match &self.current {
            None => false,
            Some(current) => self.in_lockstep() || !matches!(current.purpose, Purpose::Replan(_)),
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
            (0, Ok(())) => Ok(self.whole(warm)),
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
            let outcome = (PlanProgress::FAILED, why.1.into());
            self.progress(current.first_step, &current.last, outcome);
            if let Purpose::Goal(goal) = current.purpose {
                goal.fail(&self.scene, body, why, None);
            }
        }
    }

    /// A goal's plan is flown if it is there in time.
    pub(super) fn reached(
        &mut self,
        goal: Goal,
        first_step: u64,
        ended: Result<Solved, Unsolved>,
    ) -> Result<(), NodeError> {
        let body = self.maneuver.body;
        match ended {
            Ok(solved) => match self.in_time(first_step) {
                Ok(()) => {
                    let remark = solved.remark.clone();
                    let sequence = self.publish(first_step, solved)?;
                    goal.succeed(&self.scene, body, &sequence, remark);
                }
                Err(why) => {
                    let late = Sequence::of(&self.maneuver, first_step, solved);
                    goal.fail(&self.scene, body, (Reason::Refused, &why), Some(&late));
                }
            },
            Err(Unsolved {
                reason,
                message,
                best,
                ..
            }) => {
                let best = best.map(|best| Sequence::new(&self.maneuver, first_step, *best));
                goal.fail(&self.scene, body, (reason, &message), best.as_ref());
            }
        }
        Ok(())
    }
}
