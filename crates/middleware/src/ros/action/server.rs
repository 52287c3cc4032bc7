//! The server's side of an action.

use std::{
    collections::VecDeque,
    fmt,
    sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError},
    time::Duration,
};

use lgvi_msgs::{Action, RosMessage, Service, cdr};
use tracing::warn;

use super::{
    GoalHandle, GoalId, GoalState,
    goals::{Ending, Goals, Stop},
    protocol::Protocol,
};
use crate::ros::{Executor, RequestId, RosError, RosNode, Running, executor::Wakeup};

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
    _running: Running,
}

/// Shared by the server, its protocol and its goals.
pub(super) struct Shared<A: Action> {
    table: Mutex<Table<A>>,
    pub(super) arrival: Condvar,
    wakeup: Wakeup,
    /// What is left of a result that is too long.
    pub(super) shorten: OnceLock<fn(A::Result) -> A::Result>,
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
        let mut executor = Executor::new();
        let shared = Arc::new(Shared {
            table: Mutex::new(Table {
                goals: Goals::default(),
                queue: VecDeque::new(),
                feedback: VecDeque::new(),
                results: VecDeque::new(),
            }),
            arrival: Condvar::new(),
            wakeup: executor.handle(),
            shorten: OnceLock::new(),
        });
        let protocol = Protocol::new(node, action, Arc::clone(&shared), decide)?;
        executor.add(protocol);
        let running = executor.start().map_err(|error| RosError::Endpoint {
            topic: action.into(),
            type_name: A::TYPE_NAME.into(),
            reason: error.to_string(),
        })?;
        Ok(Self {
            name: action.into(),
            shared,
            _running: running,
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

    /// Has results that are too long to be sent replaced by what `shorten` leaves of them, if that is not too long too.
    #[must_use]
    pub fn shortened_by(self, shorten: fn(A::Result) -> A::Result) -> Self {
        self.shared.shorten.get_or_init(|| shorten);
        self
    }

    /// The absolute name of the action.
    pub fn name(&self) -> &str {
        &self.name
    }
}

impl<A: Action> Shared<A> {
    /// Ends a goal, if it is active, and has those told who wait for its result.
    pub(super) fn finish(&self, id: GoalId, ending: Ending, result: A::Result) {
        let mut table = self.table();
        table.finish(id, ending, result);
        drop(table);
        self.wake();
    }

    /// The same response with a shorter result, or with the default one if that is longer than `limit` too.
    pub(super) fn shortened(&self, response: &[u8], limit: usize) -> Vec<u8> {
        let (code, result) = match cdr::decode::<Response<A>>(response) {
            Ok(response) => response.into(),
            Err(_) => (GoalState::Unknown.code(), A::Result::default()),
        };
        if let Some(shorten) = self.shorten.get() {
            let shorter = encode(&Response::<A>::from((code, shorten(result))));
            if shorter.len() <= limit {
                return shorter;
            }
        }
        warn!("a result is too long to be sent: replaced by the default one");
        encode(&Response::<A>::from((code, A::Result::default())))
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

    /// Has the protocol look for something to do.
    fn wake(&self) {
        self.wakeup.wake();
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

/// Nothing if it cannot be encoded, which no generated message type can cause; sending that is an error.
fn encode<M: RosMessage>(message: &M) -> Vec<u8> {
    cdr::encode(message).unwrap_or_default()
}

impl<A: Action> fmt::Debug for ActionServer<A> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ActionServer")
            .field("name", &self.name)
            .finish_non_exhaustive()
    }
}
