//! Actions between nodes of this crate, over the loopback interface, by any wire.

use std::{
    sync::atomic::{AtomicBool, Ordering},
    thread::{self, Scope},
    time::{Duration, Instant},
};

use crate::common::{isolated, node, own_name};
use lgvi_middleware::{
    Environment,
    ros::{
        ActionClient, ActionServer, Decision, GoalHandle, GoalId, GoalState, SendGoalError,
        ServiceServer, StopReason,
    },
};
use lgvi_msgs::{
    Action,
    action::{PlanManeuver, PlanManeuverFeedback, PlanManeuverGoal, PlanManeuverResult},
    action_msgs::srv::CancelGoalResponse,
    geometry_msgs::Vector3,
};

const PATIENCE: Duration = Duration::from_secs(20);

/// To the service that cancels, all goals.
const ALL: GoalId = GoalId([0; 16]);

pub(crate) type Server = ActionServer<PlanManeuver>;
pub(crate) type Client = ActionClient<PlanManeuver>;
pub(crate) type Goal = GoalHandle<PlanManeuver>;

pub(crate) fn server(environment: &Environment, decision: Decision) -> Server {
    node("planner", environment)
        .action_server(
            &own_name("~/plan_maneuver"),
            move |goal: &PlanManeuverGoal, _| {
                if goal.deadline < 0.0 {
                    Decision::Refuse
                } else {
                    decision
                }
            },
        )
        .unwrap()
}

pub(crate) fn client(environment: &Environment) -> Client {
    let client = node("client", environment)
        .action_client(&own_name("/planner/plan_maneuver"))
        .unwrap();
    assert!(client.wait_for_server(PATIENCE));
    client
}

fn goal(first_step: u64) -> PlanManeuverGoal {
    PlanManeuverGoal {
        first_step,
        ..PlanManeuverGoal::default()
    }
}

pub(crate) fn send(client: &Client, first_step: u64) -> GoalId {
    client.send_goal(goal(first_step), PATIENCE).unwrap()
}

/// Sends a goal that no server takes.
fn refuse(client: &Client) {
    let bad = PlanManeuverGoal {
        deadline: -1.0,
        ..goal(0)
    };
    let refusal = client.send_goal(bad, PATIENCE).unwrap_err();
    assert!(
        matches!(refusal, SendGoalError::Refused { .. }),
        "{refusal}"
    );
}

pub(crate) fn next(server: &Server) -> Goal {
    server.next_goal(PATIENCE).expect("a goal in time")
}

/// A plan of so many intervals.
pub(crate) fn plan(intervals: usize) -> PlanManeuverResult {
    let mut result = PlanManeuverResult {
        success: true,
        cost: 1.5,
        ..PlanManeuverResult::default()
    };
    let vector = Vector3 {
        x: 1.0,
        ..Vector3::default()
    };
    result.controls.force = vec![vector.clone(); intervals];
    result.controls.moment = vec![vector; intervals];
    result
}

fn failure(reason: u8) -> PlanManeuverResult {
    PlanManeuverResult {
        reason,
        ..PlanManeuverResult::default()
    }
}

fn stopped(goal: &Goal) -> StopReason {
    let start = Instant::now();
    while start.elapsed() < PATIENCE {
        if let Some(reason) = goal.stop_reason() {
            return reason;
        }
        thread::sleep(Duration::from_millis(1));
    }
    panic!("the goal was not stopped");
}

/// Reaches every goal at once, until it is told to stop.
fn work<'scope>(
    scope: &'scope Scope<'scope, '_>,
    server: &'scope Server,
    stop: &'scope AtomicBool,
) {
    scope.spawn(move || {
        while !stop.load(Ordering::Relaxed) {
            if let Some(goal) = server.next_goal(Duration::from_millis(5)) {
                goal.succeed(plan(10));
            }
        }
    });
}

pub(crate) fn a_plan_is_made(environment: &Environment, intervals: usize) {
    const ITERATIONS: u32 = 40;
    let server = server(environment, Decision::Accept);
    let client = client(environment);
    let id = send(&client, 7);
    let goal = next(&server);
    assert_eq!((goal.id(), goal.goal().first_step), (id, 7));
    assert_eq!(goal.stop_reason(), None);
    thread::scope(|scope| {
        let early = scope.spawn(|| client.result(id, PATIENCE).unwrap());
        for iteration in 1..=ITERATIONS {
            goal.feedback(PlanManeuverFeedback {
                iteration,
                phase: "solving".into(),
                ..PlanManeuverFeedback::default()
            });
        }
        for iteration in 1..=ITERATIONS {
            let feedback = client.feedback(id, PATIENCE).unwrap().unwrap();
            assert_eq!(
                (feedback.iteration, &*feedback.phase),
                (iteration, "solving")
            );
        }
        goal.succeed(plan(intervals));
        let outcome = early.join().unwrap();
        assert_eq!(outcome.state, GoalState::Succeeded);
        assert_eq!(outcome.result, plan(intervals));
    });
    let late = client.result(id, PATIENCE).unwrap();
    assert_eq!(
        (late.state, late.result),
        (GoalState::Succeeded, plan(intervals))
    );
    let states = std::iter::from_fn(|| client.states(PATIENCE).unwrap());
    let last = states
        .map(|states| states.last().copied())
        .find(|state| *state == Some((id, GoalState::Succeeded)));
    assert!(last.is_some());
    let unknown = client.result(GoalId([5; 16]), PATIENCE).unwrap();
    assert_eq!(unknown.state, GoalState::Unknown);
    assert_eq!(unknown.result, PlanManeuverResult::default());
}

#[test]
fn a_goal_is_watched_to_its_end() {
    a_plan_is_made(&isolated(), 1000);
}

#[test]
fn a_goal_is_cancelled_at_once() {
    let environment = isolated();
    let server = server(&environment, Decision::Accept);
    let client = client(&environment);
    let id = send(&client, 0);
    let goal = next(&server);
    assert_ne!(goal.stop_reason(), Some(StopReason::Cancelled));
    let start = Instant::now();
    let response = client.cancel(id, PATIENCE).unwrap();
    // The answer comes after the fact.
    assert_eq!(goal.stop_reason(), Some(StopReason::Cancelled));
    assert!(
        start.elapsed() < Duration::from_secs(10),
        "{:?}",
        start.elapsed()
    );
    assert_eq!(response.return_code, CancelGoalResponse::ERROR_NONE);
    assert_eq!(response.goals_canceling[0].goal_id.uuid, id.0);
    goal.canceled(failure(PlanManeuverResult::CANCELLED));
    let outcome = client.result(id, PATIENCE).unwrap();
    assert_eq!(outcome.state, GoalState::Canceled);
    assert_eq!(outcome.result.reason, PlanManeuverResult::CANCELLED);
    let again = client.cancel(id, PATIENCE).unwrap().return_code;
    assert_eq!(again, CancelGoalResponse::ERROR_GOAL_TERMINATED);
    let unknown = client.cancel(GoalId([5; 16]), PATIENCE).unwrap();
    assert_eq!(
        unknown.return_code,
        CancelGoalResponse::ERROR_UNKNOWN_GOAL_ID
    );
}

#[test]
fn goals_that_wait_are_cancelled_while_another_is_worked_on() {
    let environment = isolated();
    let server = server(&environment, Decision::Accept);
    let client = client(&environment);
    let first = send(&client, 1);
    let goal = next(&server);
    let second = send(&client, 2);
    client.cancel(second, PATIENCE).unwrap();
    let outcome = client.result(second, PATIENCE).unwrap();
    assert_eq!(outcome.state, GoalState::Canceled);
    assert_eq!(goal.stop_reason(), None);

    send(&client, 3);
    let response = client.cancel(ALL, PATIENCE).unwrap();
    assert_eq!(response.goals_canceling.len(), 2);
    assert_eq!(goal.stop_reason(), Some(StopReason::Cancelled));
    assert!(server.next_goal(Duration::ZERO).is_none());
    drop(goal);
    let outcome = client.result(first, PATIENCE).unwrap();
    assert_eq!(outcome.state, GoalState::Canceled);
}

#[test]
fn a_goal_is_refused_or_takes_the_place_of_another() {
    let environment = isolated();
    let server = server(&environment, Decision::Preempt);
    let client = client(&environment);
    refuse(&client);

    let [worked_on, waiting] = [send(&client, 1), send(&client, 2)];
    let goal = next(&server);
    assert_eq!(
        goal.id(),
        waiting,
        "the first has given way before it was taken up"
    );
    let outcome = client.result(worked_on, PATIENCE).unwrap();
    assert_eq!(outcome.state, GoalState::Aborted);
    send(&client, 3);
    assert_eq!(stopped(&goal), StopReason::Preempted);
    assert_ne!(goal.stop_reason(), Some(StopReason::Cancelled));
    goal.canceled(failure(PlanManeuverResult::CANCELLED));
    let outcome = client.result(waiting, PATIENCE).unwrap();
    assert_eq!(outcome.state, GoalState::Aborted);
    assert_eq!(next(&server).goal().first_step, 3);
}

/// Hears what a server is asked for, and answers nothing.
struct Witness(ServiceServer<<PlanManeuver as Action>::GetResult>);

impl Witness {
    /// Has `ask` ask the server until it hears that too.
    fn new(environment: &Environment, ask: impl Fn()) -> Self {
        let service = format!("{}/_action/get_result", own_name("/planner/plan_maneuver"));
        let witness = node("witness", environment).service_server(&service);
        let witness = Self(witness.unwrap());
        let start = Instant::now();
        while !witness.hears(Duration::from_millis(100)) {
            assert!(start.elapsed() < PATIENCE, "the witness hears nothing");
            ask();
        }
        while witness.hears(Duration::ZERO) {}
        witness
    }

    fn hears(&self, timeout: Duration) -> bool {
        self.0.recv_timeout(timeout).unwrap().is_some()
    }

    fn await_request(&self) {
        assert!(self.hears(PATIENCE), "nothing was asked for");
    }
}

#[test]
fn goals_that_are_dropped_or_lose_their_server_are_aborted() {
    let environment = isolated();
    let server = server(&environment, Decision::Accept);
    let client = client(&environment);
    let id = send(&client, 1);
    drop(next(&server));
    assert_eq!(
        client.result(id, PATIENCE).unwrap().state,
        GoalState::Aborted
    );

    let [worked_on, waiting] = [send(&client, 2), send(&client, 3)];
    let goal = next(&server);
    let witness = Witness::new(&environment, || {
        client.result(id, PATIENCE).unwrap();
    });
    thread::scope(|scope| {
        let result = scope.spawn(|| client.result(worked_on, PATIENCE).unwrap().state);
        witness.await_request();
        // What is answered later is taken together with it or after it.
        refuse(&client);
        drop(server);
        assert_eq!(result.join().unwrap(), GoalState::Aborted);
    });
    assert_eq!(goal.stop_reason(), Some(StopReason::Closed));
    assert_ne!(goal.id(), waiting);
    goal.succeed(plan(1));
}

/// Neither asks for results nor takes feedback; meanwhile another one gets everything at once.
#[test]
fn clients_that_never_ask_do_not_stall_the_server() {
    const GOALS: u64 = 100;
    let environment = isolated();
    let server = server(&environment, Decision::Accept);
    let silent = client(&environment);
    let other = node("other", &environment)
        .action_client::<PlanManeuver>(&own_name("/planner/plan_maneuver"))
        .unwrap();
    assert!(other.wait_for_server(PATIENCE));
    let stop = AtomicBool::new(false);
    thread::scope(|scope| {
        work(scope, &server, &stop);
        // More than may be active at a time.
        let accepted = |step| loop {
            match silent.send_goal(goal(step), PATIENCE) {
                Err(SendGoalError::Refused { .. }) => thread::yield_now(),
                sent => break sent.unwrap(),
            }
        };
        let ids: Vec<_> = (0..GOALS).map(accepted).collect();
        let start = Instant::now();
        let id = send(&other, 0);
        assert_eq!(
            other.result(id, PATIENCE).unwrap().state,
            GoalState::Succeeded
        );
        assert!(
            start.elapsed() < Duration::from_secs(10),
            "{:?}",
            start.elapsed()
        );
        let state = |id| silent.result(id, PATIENCE).unwrap().state;
        assert_eq!(
            state(ids[0]),
            GoalState::Unknown,
            "old results are forgotten"
        );
        assert_eq!(state(ids[GOALS as usize - 1]), GoalState::Succeeded);
        stop.store(true, Ordering::Relaxed);
    });
}

/// All that may be active are worked on, so that even one that would stop them has no place.
#[test]
fn a_goal_that_finds_no_room_stops_no_other() {
    let environment = isolated();
    let server = node("planner", &environment)
        .action_server::<PlanManeuver>(&own_name("~/plan_maneuver"), |_, active| {
            if active < 16 {
                Decision::Accept
            } else {
                Decision::Preempt
            }
        })
        .unwrap();
    let client = client(&environment);
    let goals: Vec<_> = (0..16)
        .map(|step| {
            send(&client, step);
            next(&server)
        })
        .collect();
    let refusal = client.send_goal(goal(16), PATIENCE).unwrap_err();
    assert!(
        matches!(refusal, SendGoalError::Refused { .. }),
        "{refusal}"
    );
    assert!(goals.iter().all(|goal| goal.stop_reason().is_none()));
}
