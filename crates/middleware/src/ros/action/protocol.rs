//! The protocol of an action server.

use std::{
    fmt,
    sync::Arc,
    task::{Context, Poll},
    time::{Duration, Instant},
};

use lgvi_msgs::{
    Action, RosMessage, Service,
    action_msgs::{GoalStatusArray, srv::CancelGoal},
    stamp,
    unique_identifier_msgs::UUID,
};
use tracing::warn;

use super::{
    Decision, GoalId, GoalState, StopReason,
    goals::{Answer, Ending, MAX_ACTIVE},
    part,
    table::{Shared, response},
};
use crate::{
    ros::{Publisher, Qos, RawPublisher, Request, RequestId, RosError, RosNode, ServiceServer},
    sync::lock,
    wall,
};

/// The longest a message waits for a hanging client, or for one that has just been found to be introduced.
const MAX_WAIT: Duration = Duration::from_millis(20);

/// How often expired results are looked for.
pub(super) const CYCLE: Duration = Duration::from_secs(1);

/// Requests of a kind that are answered in a row, so that a flood of them holds up no others.
const ROW: usize = 16;

/// The endpoints of an action server, and its goals.
pub(super) struct Protocol<A: Action, D> {
    shared: Arc<Shared<A>>,
    decide: D,
    send_goal: ServiceServer<A::SendGoal>,
    cancel_goal: ServiceServer<CancelGoal>,
    get_result: ServiceServer<A::GetResult>,
    feedback: RawPublisher,
    status: Publisher<GoalStatusArray>,
}

impl<A, D> Protocol<A, D>
where
    A: Action,
    D: FnMut(&A::Goal, usize) -> Decision,
{
    pub(super) fn new(
        node: &RosNode,
        action: &str,
        shared: Arc<Shared<A>>,
        decide: D,
    ) -> Result<Self, RosError> {
        Ok(Self {
            shared,
            decide,
            feedback: node.raw_publisher(
                &part(action, "feedback"),
                A::FeedbackMessage::TYPE_NAME,
                &Qos::reliable(10).max_wait(MAX_WAIT),
            )?,
            status: node.publisher(&part(action, "status"), &Qos::latched(1).max_wait(MAX_WAIT))?,
            send_goal: node.service_server(&part(action, "send_goal"))?,
            cancel_goal: node.service_server(&part(action, "cancel_goal"))?,
            get_result: node.service_server(&part(action, "get_result"))?,
        })
    }

    /// Does what there is to do, and has the task woken when there is more.
    pub(super) fn turn(&mut self, context: &Context<'_>) {
        self.take_cancellations(context);
        self.take_goals(context);
        self.take_result_requests(context);
        self.send();
    }

    fn take_goals(&mut self, context: &Context<'_>) {
        for Request { id, message } in taken(&self.send_goal, context) {
            let (goal_id, goal) = message.into();
            let goal_id = GoalId(goal_id.uuid);
            let now = stamp::to_message(wall::now()).unwrap_or_default();
            let accepted = self.decided(goal_id, &goal);
            // The goal is known before the client may ask for it, and worked on after the reply is on its way.
            let stop =
                accepted.then(|| lock(&self.shared.table).goals.accept(goal_id, now.clone()));
            warn_of(self.send_goal.reply(id, &(accepted, now).into()));
            if let Some(stop) = stop {
                lock(&self.shared.table)
                    .queue
                    .push_back((goal_id, goal, stop));
                self.shared.arrival.notify_one();
            }
        }
    }

    fn decided(&mut self, id: GoalId, goal: &A::Goal) -> bool {
        let table = lock(&self.shared.table);
        let active = table.goals.active();
        if table.goals.contains(id) {
            return false;
        }
        drop(table);
        let decision = (self.decide)(goal, active);
        let mut table = lock(&self.shared.table);
        let active = table.goals.active();
        match decision {
            Decision::Refuse => false,
            Decision::Accept => active < MAX_ACTIVE,
            // Those that nobody works on yet make room.
            Decision::Preempt if active.saturating_sub(table.queue.len()) < MAX_ACTIVE => {
                table.goals.stop_all(StopReason::Preempted);
                table.finish_stopped();
                true
            }
            Decision::Preempt => false,
        }
    }

    fn take_cancellations(&self, context: &Context<'_>) {
        for Request { id, message } in taken(&self.cancel_goal, context) {
            let mut table = lock(&self.shared.table);
            let response = table.goals.cancel(&message);
            table.finish_stopped();
            drop(table);
            warn_of(self.cancel_goal.reply(id, &response));
        }
    }

    fn take_result_requests(&self, context: &Context<'_>) {
        for Request { id, message } in taken(&self.get_result, context) {
            let goal: UUID = message.into();
            let answer = lock(&self.shared.table).goals.result(GoalId(goal.uuid), id);
            match answer {
                Answer::Now(cdr) => self.reply_result(id, cdr),
                Answer::Unknown => {
                    self.reply_result(id, response::<A>(GoalState::Unknown, A::Result::default()));
                }
                Answer::Later => {}
            }
        }
    }
}

impl<A: Action, D> Protocol<A, D> {
    /// Replies with a response, with a shorter result if that is too long for the peers that are there now.
    fn reply_result(&self, id: RequestId, cdr: Vec<u8>) {
        let limit = self.get_result.max_reply();
        let cdr = if cdr.len() <= limit {
            cdr
        } else {
            self.shared.shortened(&cdr, limit)
        };
        warn_of(self.get_result.reply_cdr(id, cdr));
    }

    /// Sends what waits to be sent: feedback before the states, and these before the results.
    fn send(&self) {
        let mut table = lock(&self.shared.table);
        table.goals.expire(Instant::now());
        let feedback = std::mem::take(&mut table.feedback);
        let states = table.goals.changed_states();
        let results = std::mem::take(&mut table.results);
        drop(table);
        for cdr in feedback {
            warn_of(self.feedback.publish(cdr));
        }
        if let Some(states) = states {
            warn_of(self.status.publish(&states));
        }
        for (id, cdr) in results {
            self.reply_result(id, cdr);
        }
    }
}

impl<A: Action, D> Drop for Protocol<A, D> {
    /// Aborts the goals that are left.
    fn drop(&mut self) {
        let mut table = lock(&self.shared.table);
        table.goals.stop_all(StopReason::Closed);
        for id in table.goals.unfinished_ids() {
            table.finish(id, Ending::Stopped, A::Result::default());
        }
        table.queue.clear();
        drop(table);
        self.send();
    }
}

/// The next requests that are some. Where a row is full, the task is woken to look for more.
fn taken<S: Service>(server: &ServiceServer<S>, context: &Context<'_>) -> Vec<Request<S::Request>> {
    let mut requests = Vec::new();
    for _ in 0..ROW {
        match server.poll_take(context) {
            Poll::Ready(Ok(request)) => requests.push(request),
            Poll::Ready(Err(error)) => warn!(%error, "dropped a request of an action client"),
            Poll::Pending => return requests,
        }
    }
    context.waker().wake_by_ref();
    requests
}

fn warn_of(sent: Result<(), impl fmt::Display>) {
    if let Err(error) = sent {
        warn!(%error, "an action client misses a message");
    }
}
