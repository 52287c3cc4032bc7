//! The goals of an action server, and what waits to be sent: shared by the server, its protocol and its goals.

use std::{
    collections::VecDeque,
    sync::{Arc, Condvar, Mutex, OnceLock},
};

use lgvi_msgs::{Action, RosMessage, Service, cdr};
use tracing::warn;

use super::{
    GoalId, GoalState,
    goals::{Ending, Goals, Stop},
};
use crate::{
    ros::{RequestId, executor::Wakeup},
    sync::lock,
};

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

/// Shared by the server, its protocol and its goals.
pub(super) struct Shared<A: Action> {
    pub(super) table: Mutex<Table<A>>,
    pub(super) arrival: Condvar,
    pub(super) wakeup: Wakeup,
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

impl<A: Action> Shared<A> {
    /// Of a server without goals, whose protocol is woken by `wakeup`.
    pub(super) fn new(wakeup: Wakeup) -> Self {
        Self {
            table: Mutex::new(Table {
                goals: Goals::default(),
                queue: VecDeque::new(),
                feedback: VecDeque::new(),
                results: VecDeque::new(),
            }),
            arrival: Condvar::new(),
            wakeup,
            shorten: OnceLock::new(),
        }
    }

    /// Ends a goal, if it is active, and has those told who wait for its result.
    pub(super) fn finish(&self, id: GoalId, ending: Ending, result: A::Result) {
        let mut table = lock(&self.table);
        table.finish(id, ending, result);
        drop(table);
        self.wakeup.wake();
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
        warn!("a result is too long to be sent; the default result is sent instead");
        encode(&Response::<A>::from((code, A::Result::default())))
    }

    pub(super) fn feedback(&self, id: GoalId, feedback: A::Feedback) {
        let message = encode(&A::FeedbackMessage::from((id.message(), feedback)));
        let mut table = lock(&self.table);
        if table.feedback.len() >= MAX_FEEDBACK {
            table.feedback.pop_front();
        }
        table.feedback.push_back(message);
        drop(table);
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
