//! The goals that an action server knows: their states, results, and who waits for these.

use std::{
    collections::VecDeque,
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};

use lgvi_msgs::{
    action_msgs::{
        GoalInfo, GoalStatus, GoalStatusArray,
        srv::{CancelGoalRequest, CancelGoalResponse},
    },
    builtin_interfaces::Time,
};

use super::{GoalId, GoalState, StopReason};
use crate::{ros::RequestId, sync::lock};

/// Goals that may be active at a time.
pub(super) const MAX_ACTIVE: usize = 16;

/// Results that are kept, and for how long, which is as long as `rclcpp` keeps them.
const MAX_RESULTS: usize = 16;
const MAX_AGE: Duration = Duration::from_secs(15 * 60);

/// The most bytes of results that are kept, unless the latest alone has more.
const MAX_BYTES: usize = 1 << 26;

/// Requests that may wait for one result; further ones push out the oldest.
const MAX_WAITING: usize = 64;

/// Whether and why a goal is to stop, for the thread that works on it.
#[derive(Debug, Default)]
pub(super) struct Stop(Mutex<Option<StopReason>>);

impl Stop {
    pub(super) fn reason(&self) -> Option<StopReason> {
        *lock(&self.0)
    }

    /// A client's wish comes before the server's.
    pub(super) fn set(&self, reason: StopReason) {
        let mut first = lock(&self.0);
        if reason == StopReason::Cancelled || first.is_none() {
            *first = Some(reason);
        }
    }
}

/// How a goal ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ending {
    Success,
    Failure,
    /// Stopped: cancelled if a client has asked for it, and otherwise aborted.
    Stopped,
}

/// What a request for a result is answered.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Answer {
    /// The response, encoded.
    Now(Vec<u8>),
    /// At the goal's end.
    Later,
    /// That there is no such goal.
    Unknown,
}

/// In the order in which they were accepted.
#[derive(Debug, Default)]
pub(super) struct Goals {
    entries: VecDeque<Entry>,
    changed: bool,
}

#[derive(Debug)]
struct Entry {
    id: GoalId,
    stamp: Time,
    state: GoalState,
    stop: Arc<Stop>,
    waiting: VecDeque<RequestId>,
    /// When the goal ended, and the encoded response to requests for the result.
    ended: Option<(Instant, Vec<u8>)>,
}

impl Entry {
    fn info(&self) -> GoalInfo {
        GoalInfo {
            goal_id: self.id.message(),
            stamp: self.stamp.clone(),
        }
    }

    /// When it ended, its identity and the response, if it has ended.
    fn result(&self) -> Option<(Instant, GoalId, &[u8])> {
        let (ended, response) = self.ended.as_ref()?;
        Some((*ended, self.id, response))
    }
}

impl Goals {
    pub(super) fn contains(&self, id: GoalId) -> bool {
        self.entries.iter().any(|entry| entry.id == id)
    }

    /// How many goals have not ended.
    pub(super) fn active(&self) -> usize {
        self.unfinished().count()
    }

    pub(super) fn accept(&mut self, id: GoalId, stamp: Time) -> Arc<Stop> {
        let stop = Arc::new(Stop::default());
        self.entries.push_back(Entry {
            id,
            stamp,
            state: GoalState::Accepted,
            stop: Arc::clone(&stop),
            waiting: VecDeque::new(),
            ended: None,
        });
        self.changed = true;
        stop
    }

    /// Notes that a goal is being worked on.
    pub(super) fn execute(&mut self, id: GoalId) {
        if let Some(entry) = self.find(id)
            && entry.state == GoalState::Accepted
        {
            entry.state = GoalState::Executing;
            self.changed = true;
        }
    }

    /// Has all active goals stop.
    pub(super) fn stop_all(&self, reason: StopReason) {
        self.unfinished().for_each(|entry| entry.stop.set(reason));
    }

    /// Cancels goals by identity, by time of acceptance, or all, as `action_msgs/srv/CancelGoal` says.
    pub(super) fn cancel(&mut self, request: &CancelGoalRequest) -> CancelGoalResponse {
        let GoalInfo { goal_id, stamp } = &request.goal_info;
        let id = (goal_id.uuid != [0; 16]).then_some(GoalId(goal_id.uuid));
        let until = (*stamp != Time::default()).then_some((stamp.sec, stamp.nanosec));
        if let (Some(id), None) = (id, until) {
            match self.find(id).map(|entry| entry.state.is_terminal()) {
                None => return refusal(CancelGoalResponse::ERROR_UNKNOWN_GOAL_ID),
                Some(true) => return refusal(CancelGoalResponse::ERROR_GOAL_TERMINATED),
                Some(false) => {}
            }
        }
        let mut response = refusal(CancelGoalResponse::ERROR_NONE);
        for entry in &mut self.entries {
            let meant = match until {
                Some(until) => (entry.stamp.sec, entry.stamp.nanosec) <= until,
                None => id.is_none(),
            };
            if (meant || id == Some(entry.id)) && !entry.state.is_terminal() {
                entry.state = GoalState::Canceling;
                entry.stop.set(StopReason::Cancelled);
                response.goals_canceling.push(entry.info());
                self.changed = true;
            }
        }
        response
    }

    /// Ends an active goal with what `encode` makes of its last state; returns the requests that wait for it. `None` if
    /// it is not active.
    pub(super) fn finish(
        &mut self,
        id: GoalId,
        ending: Ending,
        encode: impl FnOnce(GoalState) -> Vec<u8>,
    ) -> Option<(Vec<u8>, VecDeque<RequestId>)> {
        let entry = self.find(id).filter(|entry| !entry.state.is_terminal())?;
        entry.state = match ending {
            Ending::Success => GoalState::Succeeded,
            Ending::Stopped if entry.state == GoalState::Canceling => GoalState::Canceled,
            Ending::Stopped | Ending::Failure => GoalState::Aborted,
        };
        let response = encode(entry.state);
        entry.ended = Some((Instant::now(), response.clone()));
        let waiting = std::mem::take(&mut entry.waiting);
        self.changed = true;
        self.forget_oldest();
        Some((response, waiting))
    }

    /// Answers a request for a result, or remembers it.
    pub(super) fn result(&mut self, id: GoalId, request: RequestId) -> Answer {
        match self.find(id) {
            None => Answer::Unknown,
            Some(Entry {
                ended: Some((_, response)),
                ..
            }) => Answer::Now(response.clone()),
            Some(entry) => {
                if entry.waiting.len() >= MAX_WAITING {
                    entry.waiting.pop_front();
                }
                entry.waiting.push_back(request);
                Answer::Later
            }
        }
    }

    /// The goals that have not ended.
    pub(super) fn unfinished_ids(&self) -> Vec<GoalId> {
        self.unfinished().map(|entry| entry.id).collect()
    }

    /// Forgets goals that ended too long ago.
    pub(super) fn expire(&mut self, now: Instant) {
        let before = self.entries.len();
        self.entries.retain(|entry| {
            entry
                .ended
                .as_ref()
                .is_none_or(|(ended, _)| now.saturating_duration_since(*ended) < MAX_AGE)
        });
        self.changed |= self.entries.len() < before;
    }

    /// The states of all goals, if they have changed since the last time.
    pub(super) fn changed_states(&mut self) -> Option<GoalStatusArray> {
        std::mem::take(&mut self.changed).then(|| GoalStatusArray {
            status_list: self
                .entries
                .iter()
                .map(|entry| GoalStatus {
                    goal_info: entry.info(),
                    status: entry.state.code(),
                })
                .collect(),
        })
    }

    fn forget_oldest(&mut self) {
        loop {
            let ended = || self.entries.iter().filter_map(Entry::result);
            let bytes: usize = ended().map(|(.., response)| response.len()).sum();
            let count = ended().count();
            if count <= MAX_RESULTS && (count <= 1 || bytes <= MAX_BYTES) {
                return;
            }
            let oldest = ended().min_by_key(|(ended, ..)| *ended);
            let Some(oldest) = oldest.map(|(_, id, _)| id) else {
                return;
            };
            self.entries.retain(|entry| entry.id != oldest);
        }
    }

    fn unfinished(&self) -> impl Iterator<Item = &Entry> {
        self.entries
            .iter()
            .filter(|entry| !entry.state.is_terminal())
    }

    fn find(&mut self, id: GoalId) -> Option<&mut Entry> {
        self.entries.iter_mut().find(|entry| entry.id == id)
    }
}

fn refusal(return_code: i8) -> CancelGoalResponse {
    CancelGoalResponse {
        return_code,
        goals_canceling: Vec::new(),
    }
}

#[cfg(test)]
mod tests;
