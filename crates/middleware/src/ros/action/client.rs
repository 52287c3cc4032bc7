//! The client's side of an action.

use std::time::Duration;

use lgvi_msgs::{
    Action,
    action_msgs::{
        GoalInfo, GoalStatusArray,
        srv::{CancelGoal, CancelGoalRequest, CancelGoalResponse},
    },
};

use super::{GoalId, GoalState, part};
use crate::{
    block::Deadline,
    ros::{CallError, Qos, RosError, RosNode, ServiceClient, Subscription, TakeError},
};

/// Feedback that waits to be taken.
const FEEDBACK: usize = 1000;

/// A goal that is not worked on.
#[derive(Debug, thiserror::Error)]
pub enum SendGoalError {
    /// The server has not answered.
    #[error(transparent)]
    Call(#[from] CallError),
    /// The server has refused it.
    #[error("{action}: the server refuses the goal")]
    Refused {
        /// The action.
        action: String,
    },
}

/// How a goal has ended.
#[derive(Debug, Clone, PartialEq)]
pub struct GoalOutcome<R> {
    /// Its last state; unknown if the server does not know the goal, or no longer.
    pub state: GoalState,
    /// What has come of it.
    pub result: R,
}

/// Sends goals to an action server. Each of its calls may be made from another thread.
pub struct ActionClient<A: Action> {
    name: String,
    send_goal: ServiceClient<A::SendGoal>,
    cancel_goal: ServiceClient<CancelGoal>,
    get_result: ServiceClient<A::GetResult>,
    feedback: Subscription<A::FeedbackMessage>,
    status: Subscription<GoalStatusArray>,
}

impl<A: Action> ActionClient<A> {
    pub(in crate::ros) fn new(node: &RosNode, action: &str) -> Result<Self, RosError> {
        Ok(Self {
            name: action.into(),
            feedback: node.subscription(&part(action, "feedback"), &Qos::reliable(FEEDBACK))?,
            status: node.subscription(&part(action, "status"), &Qos::latched(1))?,
            send_goal: node.service_client(&part(action, "send_goal"))?,
            cancel_goal: node.service_client(&part(action, "cancel_goal"))?,
            get_result: node.service_client(&part(action, "get_result"))?,
        })
    }

    /// Blocks until a server and its feedback are found or the time has passed; returns whether they are.
    pub fn wait_for_server(&self, timeout: Duration) -> bool {
        let deadline = Deadline::after(timeout);
        self.send_goal.wait_for_server(deadline.left())
            && self.cancel_goal.wait_for_server(deadline.left())
            && self.get_result.wait_for_server(deadline.left())
            && self.feedback.wait_for_publishers(1, deadline.left())
    }

    /// Sends a goal and waits for the server to accept it.
    ///
    /// # Errors
    /// The server refuses it, or does not answer in time.
    pub fn send_goal(&self, goal: A::Goal, timeout: Duration) -> Result<GoalId, SendGoalError> {
        let id = GoalId::random();
        let request = (id.message(), goal).into();
        let (accepted, _) = self.send_goal.call(&request, timeout)?.into();
        if accepted {
            Ok(id)
        } else {
            Err(SendGoalError::Refused {
                action: self.name.clone(),
            })
        }
    }

    /// Waits for the end of a goal.
    ///
    /// # Errors
    /// The server does not answer in time.
    pub fn result(
        &self,
        id: GoalId,
        timeout: Duration,
    ) -> Result<GoalOutcome<A::Result>, CallError> {
        let response = self.get_result.call(&id.message().into(), timeout)?;
        let (status, result) = response.into();
        Ok(GoalOutcome {
            state: GoalState::from_code(status),
            result,
        })
    }

    /// Cancels a goal; returns what the server says to it, which is not yet the end of the goal.
    ///
    /// # Errors
    /// The server does not answer in time.
    pub fn cancel(&self, id: GoalId, timeout: Duration) -> Result<CancelGoalResponse, CallError> {
        let goal_info = GoalInfo {
            goal_id: id.message(),
            ..GoalInfo::default()
        };
        let request = CancelGoalRequest { goal_info };
        self.cancel_goal.call(&request, timeout)
    }

    /// Waits for the next feedback on a goal; what is for others is dropped. `None` if none came.
    ///
    /// # Errors
    /// A message that is not the action's feedback.
    pub fn feedback(
        &self,
        id: GoalId,
        timeout: Duration,
    ) -> Result<Option<A::Feedback>, TakeError> {
        let deadline = Deadline::after(timeout);
        loop {
            let Some(sample) = self.feedback.recv_timeout(deadline.left())? else {
                return Ok(None);
            };
            let (goal, feedback) = sample.message.into();
            if goal.uuid == id.0 {
                return Ok(Some(feedback));
            }
        }
    }

    /// Waits for the server to tell the states of its goals, which it does when they change and to who comes late.
    ///
    /// # Errors
    /// A message that is no status of goals.
    pub fn states(&self, timeout: Duration) -> Result<Option<Vec<(GoalId, GoalState)>>, TakeError> {
        let sample = self.status.recv_timeout(timeout)?;
        Ok(sample.map(|sample| {
            let states = sample.message.status_list.into_iter();
            states
                .map(|status| {
                    let id = GoalId(status.goal_info.goal_id.uuid);
                    (id, GoalState::from_code(status.status))
                })
                .collect()
        }))
    }
}
