//! A goal in the hands of what works on it.

use std::sync::Arc;

use lgvi_msgs::Action;

use super::{
    GoalId,
    goals::{Ending, Stop},
    table::Shared,
};

/// Why work on a goal is to stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// A client has cancelled it.
    Cancelled,
    /// Another goal has taken its place.
    Preempted,
    /// The server is gone; nobody will get the result.
    Closed,
}

/// A goal that is being worked on. Nothing here waits. Dropped without an ending, it is aborted with the default result.
pub struct GoalHandle<A: Action> {
    pub(super) id: GoalId,
    pub(super) goal: A::Goal,
    pub(super) stop: Arc<Stop>,
    pub(super) shared: Arc<Shared<A>>,
}

impl<A: Action> GoalHandle<A> {
    /// The identity that the client has given the goal.
    pub fn id(&self) -> GoalId {
        self.id
    }

    /// What is to be done.
    pub fn goal(&self) -> &A::Goal {
        &self.goal
    }

    /// Why work is to stop, if it is. Cheap.
    pub fn stop_reason(&self) -> Option<StopReason> {
        self.stop.reason()
    }

    /// Has feedback sent.
    pub fn feedback(&self, feedback: A::Feedback) {
        self.shared.feedback(self.id, feedback);
    }

    /// Ends the goal: it has been reached.
    pub fn succeed(self, result: A::Result) {
        self.shared.finish(self.id, Ending::Success, result);
    }

    /// Ends the goal: it has failed.
    pub fn abort(self, result: A::Result) {
        self.shared.finish(self.id, Ending::Failure, result);
    }

    /// Ends the goal: it has been stopped. Clients see it cancelled if one of them has asked for it, else aborted.
    pub fn canceled(self, result: A::Result) {
        self.shared.finish(self.id, Ending::Stopped, result);
    }
}

impl<A: Action> Drop for GoalHandle<A> {
    fn drop(&mut self) {
        let ending = match self.stop_reason() {
            Some(_) => Ending::Stopped,
            None => Ending::Failure,
        };
        self.shared.finish(self.id, ending, A::Result::default());
    }
}
