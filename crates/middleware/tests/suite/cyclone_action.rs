//! A client of another make: `tests/python/cyclone_action_peer.py`, which calls services as `rmw_cyclonedds_cpp` does.
//!
//! Needs a Python with PyPI `cyclonedds` 11.0.1: `target/python-env`, or what `LGVI_PYTHON` names.

use std::{
    io::{BufRead, BufReader, Lines, Read},
    process::{Child, ChildStdout, Stdio},
    thread,
    time::{Duration, Instant},
};

use crate::common::{isolated, node, own_name, python_peer};
use lgvi_middleware::{
    Environment, Rmw, ServiceMapping,
    ros::{ActionServer, Decision, GoalHandle, GoalState, StopReason},
};
use lgvi_msgs::{
    action::{PlanManeuver, PlanManeuverFeedback, PlanManeuverGoal, PlanManeuverResult},
    action_msgs::srv::CancelGoalResponse,
    geometry_msgs::Vector3,
};
use nix::{
    sys::signal::{Signal, kill},
    unistd::Pid,
};
use serde_json::{Value, json};

const PATIENCE: Duration = Duration::from_secs(20);

/// A peer that is killed when the test ends.
struct Peer {
    child: Child,
    lines: Lines<BufReader<ChildStdout>>,
}

impl Peer {
    fn start(environment: &Environment, args: &[&str]) -> Self {
        let mut child = python_peer("cyclone_action_peer.py", environment)
            .args(["--timeout", &PATIENCE.as_secs().to_string()])
            .args(args)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        Self { child, lines }
    }

    fn line(&mut self) -> Value {
        match self.lines.next() {
            Some(line) => serde_json::from_str(&line.unwrap()).unwrap(),
            None => panic!("{}", self.complaint()),
        }
    }

    fn complaint(&mut self) -> String {
        let mut complaint = String::new();
        let stderr = self.child.stderr.as_mut().unwrap();
        stderr.read_to_string(&mut complaint).unwrap();
        complaint
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

fn action() -> String {
    own_name("/planner/plan_maneuver")
}

fn environment() -> Environment {
    Environment {
        rmw: Rmw::Dds(ServiceMapping::Cyclone),
        ..isolated()
    }
}

fn server(environment: &Environment) -> ActionServer<PlanManeuver> {
    node("planner", environment)
        .action_server(
            &own_name("~/plan_maneuver"),
            |goal: &PlanManeuverGoal, _| {
                if goal.first_step == 99 {
                    Decision::Refuse
                } else {
                    Decision::Accept
                }
            },
        )
        .unwrap()
}

fn feedback(goal: &GoalHandle<PlanManeuver>, iteration: u32) {
    goal.feedback(PlanManeuverFeedback {
        iteration,
        trials: 2 * iteration,
        violation: 1e-300,
        phase: "x".repeat(iteration as usize % 5),
        ..PlanManeuverFeedback::default()
    });
}

#[test]
fn a_stranger_plans_and_gets_feedback_and_a_long_result() {
    const ITERATIONS: u32 = 30;
    let environment = environment();
    let server = server(&environment);
    let mut peer = Peer::start(&environment, &["--plan", &action(), "--first-step", "7"]);
    let goal = server.next_goal(PATIENCE).unwrap();
    let expected = PlanManeuverGoal {
        first_step: 7,
        deadline: 2.5,
        warm: true,
    };
    assert_eq!(*goal.goal(), expected);
    let accepted = peer.line();
    assert_eq!(accepted["accepted"]["accepted"], true);
    assert!(accepted["accepted"]["stamp"]["sec"].as_i64().unwrap() > 1_700_000_000);
    assert_eq!(accepted["goal_id"], json!(goal.id().0));
    for iteration in 1..=ITERATIONS {
        feedback(&goal, iteration);
    }
    for iteration in 1..=ITERATIONS {
        let line = peer.line();
        let feedback = &line["feedback"];
        assert_eq!(feedback["iteration"], iteration);
        assert_eq!(feedback["trials"], 2 * iteration);
        assert_eq!(feedback["violation"], 1e-300);
        assert_eq!(feedback["phase"], "x".repeat(iteration as usize % 5));
    }
    let mut result = PlanManeuverResult {
        reason: PlanManeuverResult::NOT_CONVERGED,
        message: "it is hard".into(),
        condition: 1e17,
        duration: 0.125,
        ..PlanManeuverResult::default()
    };
    let x = |x: i32| Vector3 {
        x: f64::from(x),
        ..Vector3::default()
    };
    result.controls.force = (0..3000).map(x).collect();
    result.controls.moment = (0..3000).map(x).collect();
    goal.abort(result);
    let line = peer.line();
    let (status, result) = (&line["result"]["status"], &line["result"]["result"]);
    assert_eq!(*status, 6, "action_msgs/GoalStatus: aborted");
    assert_eq!(result["success"], false);
    assert_eq!(result["reason"], 2);
    assert_eq!(result["message"], "it is hard");
    assert_eq!(
        (&result["condition"], &result["duration"]),
        (&json!(1e17), &json!(0.125))
    );
    let force = result["controls"]["force"].as_array().unwrap();
    assert_eq!((force.len(), &force[2999]["x"]), (3000, &json!(2999.0)));
    assert_eq!(result["controls"]["moment"][1234]["x"], 1234.0);
}

#[test]
fn a_stranger_cancels_its_goal_and_is_refused_another() {
    let environment = environment();
    let server = server(&environment);
    let mut peer = Peer::start(&environment, &["--plan", &action(), "--cancel-after", "3"]);
    let goal = server.next_goal(PATIENCE).unwrap();
    let start = Instant::now();
    let mut iteration = 0;
    while goal.stop_reason() != Some(StopReason::Cancelled) {
        assert!(start.elapsed() < PATIENCE);
        iteration += 1;
        feedback(&goal, iteration);
        thread::sleep(Duration::from_millis(5));
    }
    let id = goal.id();
    goal.canceled(PlanManeuverResult {
        reason: PlanManeuverResult::CANCELLED,
        ..PlanManeuverResult::default()
    });
    let mut lines = vec![peer.line()];
    while lines.last().unwrap().get("result").is_none() {
        lines.push(peer.line());
    }
    let cancelled = lines.iter().find_map(|line| line.get("cancelled")).unwrap();
    assert_eq!(cancelled["return_code"], CancelGoalResponse::ERROR_NONE);
    assert_eq!(
        cancelled["goals_canceling"][0]["goal_id"]["uuid"],
        json!(id.0)
    );
    let result = &lines.last().unwrap()["result"];
    assert_eq!(result["status"], 5, "action_msgs/GoalStatus: canceled");
    assert_eq!(result["result"]["reason"], PlanManeuverResult::CANCELLED);

    let mut peer = Peer::start(&environment, &["--plan", &action(), "--first-step", "99"]);
    assert_eq!(peer.line()["accepted"]["accepted"], false);
}

#[test]
fn a_stranger_calls_a_service() {
    let environment = environment();
    let server = server(&environment);
    let mut peer = Peer::start(&environment, &["--cancel-all", &action()]);
    let reply = peer.line();
    assert_eq!(
        reply["cancelled"]["return_code"],
        CancelGoalResponse::ERROR_NONE
    );
    assert_eq!(reply["cancelled"]["goals_canceling"], json!([]));
    assert!(server.next_goal(Duration::ZERO).is_none());
}

/// The stopped process acknowledges nothing and is not missed for its lease of ten seconds and more.
#[test]
fn a_client_that_hangs_does_not_stall_the_others() {
    const GOALS: u32 = 20;
    let environment = environment();
    let server = server(&environment);
    let mut deaf = Peer::start(&environment, &["--deaf", &action()]);
    let mut sent = String::new();
    BufReader::new(deaf.child.stderr.as_mut().unwrap())
        .read_line(&mut sent)
        .unwrap();
    assert_eq!(sent.trim(), "sent");
    let goal = server.next_goal(PATIENCE).unwrap();
    kill(
        Pid::from_raw(deaf.child.id().try_into().unwrap()),
        Signal::SIGSTOP,
    )
    .unwrap();
    goal.succeed(PlanManeuverResult::default());

    let client = node("client", &environment)
        .action_client::<PlanManeuver>(&action())
        .unwrap();
    assert!(client.wait_for_server(PATIENCE));
    let start = Instant::now();
    for step in 0..GOALS {
        let goal = PlanManeuverGoal {
            first_step: step.into(),
            ..PlanManeuverGoal::default()
        };
        let id = client.send_goal(goal, PATIENCE).unwrap();
        let goal = server.next_goal(PATIENCE).unwrap();
        for iteration in 0..20 {
            feedback(&goal, iteration);
        }
        goal.succeed(PlanManeuverResult::default());
        assert_eq!(
            client.result(id, PATIENCE).unwrap().state,
            GoalState::Succeeded
        );
    }
    assert!(
        start.elapsed() < Duration::from_secs(5),
        "{:?}",
        start.elapsed()
    );
}
