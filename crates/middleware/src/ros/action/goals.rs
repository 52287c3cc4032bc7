//! The goals that an action server knows: their states, results, and who waits for these.

use std::{
    collections::VecDeque,
    sync::{
        Arc,
        atomic::{AtomicU8, Ordering},
    },
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
use crate::ros::RequestId;

/// Goals that may be active at a time.
pub(super) const MAX_ACTIVE: usize = 16;

/// Results that are kept, and for how long, which is as long as `rclcpp` keeps them.
const MAX_RESULTS: usize = 16;
const MAX_AGE: Duration = Duration::from_secs(15 * 60);

/// Requests that may wait for one result; further ones push out the oldest.
const MAX_WAITING: usize = 64;

/// Whether and why a goal is to stop, for the thread that works on it.
#[derive(Debug, Default)]
pub(super) struct Stop(AtomicU8);

impl Stop {
    pub(super) fn reason(&self) -> Option<StopReason> {
        match self.0.load(Ordering::Relaxed) {
            0 => None,
            1 => Some(StopReason::Cancelled),
            2 => Some(StopReason::Preempted),
            _ => Some(StopReason::Closed),
        }
    }

    /// A client's wish comes before the server's.
    pub(super) fn set(&self, reason: StopReason) {
        let code = match reason {
            StopReason::Cancelled => 1,
            StopReason::Preempted => 2,
            StopReason::Closed => 3,
        };
        if code == 1 || self.reason().is_none() {
            self.0.store(code, Ordering::Relaxed);
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
        let ended = self.entries.iter().filter(|entry| entry.ended.is_some());
        if ended.clone().count() > MAX_RESULTS
            && let Some(oldest) = ended
                .min_by_key(|entry| entry.ended.as_ref().map(|(ended, _)| *ended))
                .map(|entry| entry.id)
        {
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
mod tests {
    use super::*;
    use crate::ros::service::RequestId;

    const NONE: i8 = CancelGoalResponse::ERROR_NONE;

    fn id(number: u8) -> GoalId {
        GoalId([number; 16])
    }

    fn stamp(sec: i32) -> Time {
        Time { sec, nanosec: 5 }
    }

    /// Goals 1 … `count`, accepted at so many seconds.
    fn goals(count: u8) -> Goals {
        let mut goals = Goals::default();
        for number in 1..=count {
            goals.accept(id(number), stamp(number.into()));
        }
        goals
    }

    fn cancel(goals: &mut Goals, id: GoalId, stamp: Time) -> (i8, Vec<u8>) {
        let goal_info = GoalInfo {
            goal_id: id.message(),
            stamp,
        };
        let response = goals.cancel(&CancelGoalRequest { goal_info });
        let cancelled = response.goals_canceling.iter();
        (
            response.return_code,
            cancelled.map(|info| info.goal_id.uuid[0]).collect(),
        )
    }

    fn finish(goals: &mut Goals, number: u8, ending: Ending) -> Option<GoalState> {
        let mut last = None;
        goals.finish(id(number), ending, |state| {
            last = Some(state);
            vec![number]
        });
        last
    }

    #[test]
    fn cancels_one_all_or_those_up_to_a_time() {
        let all = id(0);
        assert_eq!(
            cancel(&mut goals(3), id(2), Time::default()),
            (NONE, vec![2])
        );
        assert_eq!(
            cancel(&mut goals(3), all, Time::default()),
            (NONE, vec![1, 2, 3])
        );
        assert_eq!(cancel(&mut goals(3), all, stamp(2)), (NONE, vec![1, 2]));
        assert_eq!(cancel(&mut goals(3), id(3), stamp(1)), (NONE, vec![1, 3]));
        assert_eq!(
            cancel(&mut goals(3), all, Time { sec: 0, nanosec: 1 }),
            (NONE, vec![])
        );
        assert_eq!(cancel(&mut goals(0), all, Time::default()), (NONE, vec![]));
        let unknown = CancelGoalResponse::ERROR_UNKNOWN_GOAL_ID;
        assert_eq!(
            cancel(&mut goals(3), id(4), Time::default()),
            (unknown, vec![])
        );
    }

    #[test]
    fn what_has_ended_is_not_cancelled_and_a_second_wish_changes_nothing() {
        let mut goals = goals(2);
        finish(&mut goals, 1, Ending::Success);
        let terminated = CancelGoalResponse::ERROR_GOAL_TERMINATED;
        assert_eq!(
            cancel(&mut goals, id(1), Time::default()),
            (terminated, vec![])
        );
        for _ in 0..2 {
            assert_eq!(cancel(&mut goals, id(0), Time::default()), (NONE, vec![2]));
        }
        assert_eq!(
            finish(&mut goals, 2, Ending::Stopped),
            Some(GoalState::Canceled)
        );
    }

    #[test]
    fn a_goal_ends_once_and_is_cancelled_only_if_a_client_wanted_it() {
        let mut goals = goals(4);
        assert_eq!(
            finish(&mut goals, 1, Ending::Stopped),
            Some(GoalState::Aborted)
        );
        assert_eq!(finish(&mut goals, 1, Ending::Success), None);
        cancel(&mut goals, id(0), Time::default());
        assert_eq!(
            finish(&mut goals, 2, Ending::Success),
            Some(GoalState::Succeeded)
        );
        assert_eq!(
            finish(&mut goals, 3, Ending::Failure),
            Some(GoalState::Aborted)
        );
        assert_eq!(finish(&mut goals, 9, Ending::Failure), None);
        assert_eq!(goals.active(), 1);
    }

    #[test]
    fn a_client_s_wish_comes_before_the_server_s() {
        let mut goals = Goals::default();
        let stop = goals.accept(id(1), stamp(1));
        assert_eq!(stop.reason(), None);
        goals.stop_all(StopReason::Preempted);
        goals.stop_all(StopReason::Closed);
        assert_eq!(stop.reason(), Some(StopReason::Preempted));
        cancel(&mut goals, id(1), Time::default());
        assert_eq!(stop.reason(), Some(StopReason::Cancelled));
        goals.stop_all(StopReason::Preempted);
        assert_eq!(stop.reason(), Some(StopReason::Cancelled));
    }

    #[test]
    fn results_are_for_who_waits_and_who_asks_later_until_they_expire() {
        let request = RequestId::numbered;
        let mut goals = goals(1);
        assert_eq!(goals.result(id(2), request(1)), Answer::Unknown);
        assert_eq!(goals.result(id(1), request(2)), Answer::Later);
        let (response, waiting) = goals.finish(id(1), Ending::Success, |_| vec![7]).unwrap();
        assert_eq!((response, waiting), (vec![7], VecDeque::from([request(2)])));
        assert_eq!(goals.result(id(1), request(3)), Answer::Now(vec![7]));
        goals.expire(Instant::now());
        assert!(goals.contains(id(1)));
        goals.expire(Instant::now() + MAX_AGE);
        assert_eq!(goals.result(id(1), request(4)), Answer::Unknown);
    }

    #[test]
    fn memory_is_bounded() {
        let mut goals = goals(200);
        for number in 1..=MAX_WAITING as i64 + 1 {
            goals.result(id(200), RequestId::numbered(number));
        }
        for number in 1..=199 {
            finish(&mut goals, number, Ending::Success);
        }
        assert_eq!(goals.entries.len(), MAX_RESULTS + 1);
        assert!(goals.contains(id(199)) && !goals.contains(id(183)));
        let (_, waiting) = goals.finish(id(200), Ending::Failure, |_| vec![]).unwrap();
        assert_eq!(waiting.front(), Some(&RequestId::numbered(2)));
        assert_eq!(waiting.len(), MAX_WAITING);
    }

    #[test]
    fn states_are_told_when_they_have_changed() {
        let mut goals = goals(1);
        let mut states = || {
            goals.changed_states().map(|states| {
                let states = states.status_list.into_iter();
                states
                    .map(|state| GoalState::from_code(state.status))
                    .collect::<Vec<_>>()
            })
        };
        assert_eq!(states(), Some(vec![GoalState::Accepted]));
        assert_eq!(states(), None);
        goals.execute(id(1));
        goals.execute(id(1));
        let states = goals.changed_states().unwrap();
        assert_eq!(states.status_list[0].status, GoalStatus::STATUS_EXECUTING);
        assert_eq!(states.status_list[0].goal_info.stamp, stamp(1));
        goals.execute(id(1));
        assert_eq!(goals.changed_states(), None);
    }
}
