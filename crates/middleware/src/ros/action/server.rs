//! The server's side of an action.

use std::{
    collections::VecDeque,
    fmt,
    sync::{
        Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    thread::{self, JoinHandle, Thread},
    time::Duration,
};

use lgvi_msgs::{Action, RosMessage, Service, cdr};
use tracing::warn;

use super::{
    GoalHandle, GoalId, GoalState,
    goals::{Ending, Goals, Stop},
    protocol::Protocol,
};
use crate::ros::{RequestId, RosError, RosNode};

/// Feedback that may wait to be sent.
const MAX_FEEDBACK: usize = 64;

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
    pub(super) arrival: Condvar,
    pub(super) stop: AtomicBool,
    /// The server's own.
    pub(super) thread: OnceLock<Thread>,
    /// The most bytes of a response with a result.
    pub(super) max_response: AtomicUsize,
}

pub(super) struct Table<A: Action> {
    pub(super) goals: Goals,
    /// Accepted goals that wait to be taken up.
    pub(super) queue: VecDeque<(GoalId, A::Goal, Arc<Stop>)>,
    /// Encoded messages that wait to be sent.
    pub(super) feedback: VecDeque<Vec<u8>>,
    pub(super) results: VecDeque<(RequestId, Vec<u8>)>,
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
        let protocol = Protocol::new(node, action, Arc::clone(&shared), decide)?;
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

    pub(super) fn table(&self) -> MutexGuard<'_, Table<A>> {
        self.table.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Has the server's thread look for something to do.
    fn wake(&self) {
        self.thread.get().map(Thread::unpark);
    }
}

impl<A: Action> Table<A> {
    pub(super) fn finish(&mut self, id: GoalId, ending: Ending, result: A::Result) {
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
    pub(super) fn finish_stopped(&mut self) {
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

type Response<A> = <<A as Action>::GetResult as Service>::Response;

pub(super) fn response<A: Action>(state: GoalState, result: A::Result) -> Vec<u8> {
    encode(&Response::<A>::from((state.code(), result)))
}

/// The same response with the default result.
pub(super) fn without_result<A: Action>(response: &[u8]) -> Vec<u8> {
    let code = cdr::decode::<Response<A>>(response).map_or(GoalState::Unknown.code(), |response| {
        let (code, _) = response.into();
        code
    });
    encode(&Response::<A>::from((code, A::Result::default())))
}

/// Nothing if it cannot be encoded, which no generated message type can cause; sending that is an error.
fn encode<M: RosMessage>(message: &M) -> Vec<u8> {
    cdr::encode(message).unwrap_or_default()
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

#[cfg(test)]
mod tests {
    use lgvi_msgs::action::{PlanManeuver, PlanManeuverResult};

    use super::*;

    #[test]
    fn a_response_without_its_result_keeps_the_state() {
        let result = PlanManeuverResult {
            message: "a long one".repeat(1000),
            ..PlanManeuverResult::default()
        };
        let long = response::<PlanManeuver>(GoalState::Canceled, result);
        let default = PlanManeuverResult::default();
        let short = response::<PlanManeuver>(GoalState::Canceled, default);
        assert_eq!(without_result::<PlanManeuver>(&long), short);
    }
}
