//! The server's side of an action.

use std::{
    collections::VecDeque,
    fmt,
    sync::{
        Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    task::{Context, Poll},
    thread::{self, JoinHandle, Thread},
    time::{Duration, Instant, SystemTime, UNIX_EPOCH},
};

use lgvi_msgs::{
    Action, RosMessage, Service,
    action_msgs::{GoalStatusArray, srv::CancelGoal},
    builtin_interfaces::Time,
    cdr, stamp,
    unique_identifier_msgs::UUID,
};
use tracing::warn;

use super::{
    GoalHandle, GoalId, GoalState, StopReason,
    goals::{Answer, Ending, Goals, MAX_ACTIVE, Stop},
    part,
};
use crate::{
    block::thread_waker,
    ros::{Publisher, Qos, RawPublisher, Request, RequestId, RosError, RosNode, ServiceServer},
};

/// Feedback that may wait to be sent.
const MAX_FEEDBACK: usize = 64;

/// The longest a message waits for a hanging client, or for one that has just been found to be introduced.
const MAX_WAIT: Duration = Duration::from_millis(20);

/// How often expired results are looked for.
const CYCLE: Duration = Duration::from_secs(1);

/// What becomes of a goal that a client sends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decision {
    /// It is worked on, beside or after those that are active.
    Accept,
    /// It is worked on, and those that are active are to stop.
    Preempt,
    /// It is not worked on.
    Refuse,
}

/// Offers an action: see [`RosNode::action_server`]. Dropped, it aborts the goals that are left.
pub struct ActionServer<A: Action> {
    name: String,
    shared: Arc<Shared<A>>,
    thread: Option<JoinHandle<()>>,
}

/// What the server, its thread and its goals share.
pub(super) struct Shared<A: Action> {
    table: Mutex<Table<A>>,
    arrival: Condvar,
    stop: AtomicBool,
    thread: OnceLock<Thread>,
    /// The most bytes of a response with a result.
    max_response: AtomicUsize,
}

struct Table<A: Action> {
    goals: Goals,
    /// Accepted goals that wait to be taken up.
    queue: VecDeque<(GoalId, A::Goal, Arc<Stop>)>,
    /// Encoded messages that wait to be sent.
    feedback: VecDeque<Vec<u8>>,
    results: VecDeque<(RequestId, Vec<u8>)>,
}

/// What the server's thread works with.
struct Protocol<A: Action, D> {
    shared: Arc<Shared<A>>,
    decide: D,
    send_goal: ServiceServer<A::SendGoal>,
    cancel_goal: ServiceServer<CancelGoal>,
    get_result: ServiceServer<A::GetResult>,
    feedback: RawPublisher,
    status: Publisher<GoalStatusArray>,
}

impl<A: Action> ActionServer<A> {
    pub(in crate::ros) fn new<D>(node: &RosNode, action: &str, decide: D) -> Result<Self, RosError>
    where
        D: FnMut(&A::Goal, usize) -> Decision + Send + 'static,
    {
        let shared = Arc::new(Shared {
            table: Mutex::new(Table {
                goals: Goals::default(),
                queue: VecDeque::new(),
                feedback: VecDeque::new(),
                results: VecDeque::new(),
            }),
            arrival: Condvar::new(),
            stop: AtomicBool::new(false),
            thread: OnceLock::new(),
            max_response: AtomicUsize::new(usize::MAX),
        });
        let protocol = Protocol::<A, D> {
            shared: Arc::clone(&shared),
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
        };
        let thread = thread::Builder::new()
            .name("action-server".into())
            .spawn(|| protocol.run())
            .map_err(|error| RosError::Endpoint {
                topic: action.into(),
                type_name: A::TYPE_NAME.into(),
                reason: error.to_string(),
            })?;
        Ok(Self {
            name: action.into(),
            shared,
            thread: Some(thread),
        })
    }

    /// Waits for the next accepted goal, up to `timeout`; `None` if there is none. May be called from several threads.
    pub fn next_goal(&self, timeout: Duration) -> Option<GoalHandle<A>> {
        let (mut table, _) = self
            .shared
            .arrival
            .wait_timeout_while(self.shared.table(), timeout, |table| table.queue.is_empty())
            .unwrap_or_else(PoisonError::into_inner);
        let (id, goal, stop) = table.queue.pop_front()?;
        table.goals.execute(id);
        drop(table);
        self.shared.wake();
        Some(GoalHandle {
            id,
            goal,
            stop,
            shared: Arc::clone(&self.shared),
        })
    }

    /// The absolute name of the action.
    pub fn name(&self) -> &str {
        &self.name
    }
}

impl<A: Action> Shared<A> {
    /// Ends a goal, if it is active, and has those told who wait for its result.
    pub(super) fn finish(&self, id: GoalId, ending: Ending, result: A::Result) {
        let result = if self.fits(&result) {
            result
        } else {
            warn!(%id, "the result is too long to be sent: replaced by the default one");
            A::Result::default()
        };
        let mut table = self.table();
        table.finish(id, ending, result);
        drop(table);
        self.wake();
    }

    pub(super) fn fits(&self, result: &A::Result) -> bool {
        // The response has the state before the result, which aligns to eight bytes at most.
        encode(result).len() + 8 <= self.max_response.load(Ordering::Relaxed)
    }

    pub(super) fn feedback(&self, id: GoalId, feedback: A::Feedback) {
        let message = encode(&A::FeedbackMessage::from((id.message(), feedback)));
        let mut table = self.table();
        if table.feedback.len() >= MAX_FEEDBACK {
            table.feedback.pop_front();
        }
        table.feedback.push_back(message);
        drop(table);
        self.wake();
    }

    fn table(&self) -> MutexGuard<'_, Table<A>> {
        self.table.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Has the server's thread look for something to do.
    fn wake(&self) {
        self.thread.get().map(Thread::unpark);
    }
}

impl<A: Action> Table<A> {
    fn finish(&mut self, id: GoalId, ending: Ending, result: A::Result) {
        let ended = self
            .goals
            .finish(id, ending, |state| response::<A>(state, result));
        if let Some((response, waiting)) = ended {
            let results = waiting
                .into_iter()
                .map(|request| (request, response.clone()));
            self.results.extend(results);
        }
    }

    /// Ends the goals that are to stop and that nobody works on yet.
    fn finish_stopped(&mut self) {
        let (stopped, queue) = std::mem::take(&mut self.queue)
            .into_iter()
            .partition(|(_, _, stop)| stop.reason().is_some());
        self.queue = queue;
        let stopped: VecDeque<_> = stopped;
        for (id, ..) in stopped {
            self.finish(id, Ending::Stopped, A::Result::default());
        }
    }
}

impl<A, D> Protocol<A, D>
where
    A: Action,
    D: FnMut(&A::Goal, usize) -> Decision,
{
    fn run(mut self) {
        let shared = Arc::clone(&self.shared);
        shared.thread.get_or_init(thread::current);
        let waker = thread_waker();
        let context = Context::from_waker(&waker);
        while !shared.stop.load(Ordering::Acquire) {
            let max_response = self.get_result.max_reply();
            shared.max_response.store(max_response, Ordering::Relaxed);
            self.take_goals(&context);
            self.take_cancellations(&context);
            self.take_result_requests(&context);
            self.send();
            let looks = [
                self.send_goal.next_look(),
                self.cancel_goal.next_look(),
                self.get_result.next_look(),
            ];
            thread::park_timeout(looks.into_iter().flatten().min().unwrap_or(CYCLE));
        }
        self.close();
    }

    fn take_goals(&mut self, context: &Context<'_>) {
        while let Some(Request { id, message }) = taken(&self.send_goal, context) {
            let (goal_id, goal) = message.into();
            let goal_id = GoalId(goal_id.uuid);
            let (accepted, now) = (self.decided(goal_id, &goal), now());
            // The goal is known before the client may ask for it, and worked on after the reply is on its way.
            let stop = accepted.then(|| self.shared.table().goals.accept(goal_id, now.clone()));
            warn_of(self.send_goal.reply(id, &(accepted, now).into()));
            if let Some(stop) = stop {
                self.shared.table().queue.push_back((goal_id, goal, stop));
                self.shared.arrival.notify_one();
            }
        }
    }

    fn decided(&mut self, id: GoalId, goal: &A::Goal) -> bool {
        let table = self.shared.table();
        let active = table.goals.active();
        if table.goals.contains(id) {
            return false;
        }
        drop(table);
        let decision = (self.decide)(goal, active);
        if decision == Decision::Refuse {
            return false;
        }
        let mut table = self.shared.table();
        if decision == Decision::Preempt {
            table.goals.stop_all(StopReason::Preempted);
            table.finish_stopped();
        }
        table.goals.active() < MAX_ACTIVE
    }

    fn take_cancellations(&self, context: &Context<'_>) {
        while let Some(Request { id, message }) = taken(&self.cancel_goal, context) {
            let mut table = self.shared.table();
            let response = table.goals.cancel(&message);
            table.finish_stopped();
            drop(table);
            warn_of(self.cancel_goal.reply(id, &response));
        }
    }

    fn take_result_requests(&self, context: &Context<'_>) {
        while let Some(Request { id, message }) = taken(&self.get_result, context) {
            let goal: UUID = message.into();
            let answer = self.shared.table().goals.result(GoalId(goal.uuid), id);
            let cdr = match answer {
                Answer::Now(cdr) => cdr,
                Answer::Unknown => response::<A>(GoalState::Unknown, A::Result::default()),
                Answer::Later => continue,
            };
            warn_of(self.get_result.reply_cdr(id, cdr));
        }
    }

    /// Sends what waits to be sent: feedback before the states, and these before the results.
    fn send(&self) {
        let mut table = self.shared.table();
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
            warn_of(self.get_result.reply_cdr(id, cdr));
        }
    }

    fn close(&self) {
        let mut table = self.shared.table();
        table.goals.stop_all(StopReason::Closed);
        for id in table.goals.unfinished_ids() {
            table.finish(id, Ending::Stopped, A::Result::default());
        }
        table.queue.clear();
        drop(table);
        self.send();
    }
}

/// The next request that is one.
fn taken<S: Service>(
    server: &ServiceServer<S>,
    context: &Context<'_>,
) -> Option<Request<S::Request>> {
    loop {
        match server.poll_take(context) {
            Poll::Ready(Ok(request)) => return Some(request),
            Poll::Ready(Err(error)) => warn!(%error, "dropped a request of an action client"),
            Poll::Pending => return None,
        }
    }
}

fn warn_of(sent: Result<(), impl fmt::Display>) {
    if let Err(error) = sent {
        warn!(%error, "an action client misses a message");
    }
}

fn response<A: Action>(state: GoalState, result: A::Result) -> Vec<u8> {
    type Response<A> = <<A as Action>::GetResult as Service>::Response;
    encode(&Response::<A>::from((state.code(), result)))
}

/// Nothing if it cannot be encoded, which no generated message type can cause; sending that is an error.
fn encode<M: RosMessage>(message: &M) -> Vec<u8> {
    cdr::encode(message).unwrap_or_default()
}

fn now() -> Time {
    let elapsed = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    i64::try_from(elapsed.as_nanos())
        .ok()
        .and_then(|nanoseconds| stamp::to_message(nanoseconds).ok())
        .unwrap_or_default()
}

impl<A: Action> Drop for ActionServer<A> {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            if thread.join().is_err() {
                warn!("the thread of an action server has panicked");
            }
        }
    }
}

impl<A: Action> fmt::Debug for ActionServer<A> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ActionServer")
            .field("name", &self.name)
            .finish_non_exhaustive()
    }
}
