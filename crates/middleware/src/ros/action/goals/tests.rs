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
fn long_results_push_out_older_ones() {
    let mut goals = goals(4);
    let mut known_after = |number, bytes| {
        goals.finish(id(number), Ending::Success, |_| vec![0; bytes]);
        goals.entries.iter().map(|entry| entry.id.0[0]).collect()
    };
    let expected: [(u8, usize, Vec<u8>); 4] = [
        (1, MAX_BYTES / 2, vec![1, 2, 3, 4]),
        (2, MAX_BYTES / 2, vec![1, 2, 3, 4]),
        (3, 1, vec![2, 3, 4]),
        (4, MAX_BYTES + 1, vec![4]),
    ];
    for (number, bytes, expected) in expected {
        let known: Vec<u8> = known_after(number, bytes);
        assert_eq!(known, expected);
    }
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
