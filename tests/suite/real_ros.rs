//! A real ROS 2 node, on rclpy and Fast DDS, among the nodes of the suite.

use std::collections::{BTreeMap, BTreeSet};

use lgvi_common::Event;
use lgvi_msgs::msg::{ControlSequence, Scene, SystemState};
use lgvi_msgs::nav_msgs::Odometry;
use lgvi_msgs::tf2_msgs::TFMessage;
use lgvi_msgs::{RosMessage, cdr};
use lgvi_tests::{Process, Recording, World, coast, edited, root, scene};
use serde::Deserialize;
use serde_json::{Value, json};

const CONTROL: &str = "/lgvi_propagator/control_sequence";
const STATE: &str = "/lgvi_propagator/state";
const ODOMETRY: &str = "/lgvi_propagator/odometry/spacecraft";
const TF: &str = "/tf";
const SCENE: &str = "/lgvi_propagator/scene";
const ACTION: &str = "/lgvi_planner/plan_maneuver";

/// `action_msgs/msg/GoalStatus`
const SUCCEEDED: i64 = 4;
const CANCELED: i64 = 5;

/// What a peer has printed.
fn lines(peer: Process) -> Vec<Value> {
    let stdout = peer.finish().expect(0).stdout;
    stdout
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

/// The messages that a peer has printed, as CDR.
fn printed<M: RosMessage>(peer: Process) -> Vec<Vec<u8>> {
    lines(peer)
        .into_iter()
        .map(|line| cdr::encode::<M>(&serde_json::from_value(line).unwrap()).unwrap())
        .collect()
}

fn payloads<'a>(flight: &'a Recording, topic: &str) -> Vec<&'a [u8]> {
    flight.on(topic).map(|record| &*record.data).collect()
}

/// Names of topics or services and their types, of which each has one.
pub(crate) type Names = BTreeMap<String, [String; 1]>;

/// What ROS knows of a node.
#[derive(Debug, Deserialize)]
pub(crate) struct Graph {
    pub(crate) publishers: Names,
    pub(crate) subscriptions: Names,
    pub(crate) services: Names,
}

impl Graph {
    /// Of a node that publishes so many topics at least.
    pub(crate) fn of(world: &World, node: &str, topics: &str) -> Self {
        let peer = world.ros_python("ros2_peer.py", &["graph", node, "--topics", topics]);
        serde_json::from_value(lines(peer).remove(0)).unwrap()
    }
}

#[track_caller]
fn has(names: &Names, expected: &[(&str, &str)]) {
    for (name, kind) in expected {
        assert_eq!(
            names.get(*name).map(|kinds| &*kinds[0]),
            Some(*kind),
            "{name}"
        );
    }
}

#[test]
fn ros_2_sees_the_propagator_commands_it_and_hears_every_bit_of_its_flight() {
    let world = World::new();
    let flight = Recording::read(&root().join("bags/inclination_change"));
    let plan: ControlSequence = flight
        .messages("/lgvi_propagator/flown_control")
        .pop()
        .unwrap();
    let control = world.path("control.json");
    std::fs::write(&control, serde_json::to_string(&plan).unwrap()).unwrap();
    let scene = format!("scene:={}", scene("inclination_change").display());
    let propagator = world.node("propagator", &[&scene, "real_time_factor:=0.0"]);
    propagator.await_ready();

    let graph = Graph::of(&world, "/lgvi_propagator", "7");
    has(
        &graph.publishers,
        &[
            (STATE, SystemState::TYPE_NAME),
            (ODOMETRY, Odometry::TYPE_NAME),
            (TF, TFMessage::TYPE_NAME),
            (SCENE, Scene::TYPE_NAME),
            ("/lgvi_propagator/invariants", "lgvi_msgs/msg/Invariants"),
            ("/lgvi_propagator/flown_control", ControlSequence::TYPE_NAME),
            ("/rosout", "rcl_interfaces/msg/Log"),
        ],
    );
    has(
        &graph.subscriptions,
        &[(CONTROL, ControlSequence::TYPE_NAME)],
    );

    let watch = |topic, kind| {
        let peer = world.ros_python("ros2_peer.py", &["echo", topic, kind, "--count", "101"]);
        peer.await_stderr("matched");
        peer
    };
    let state = watch(STATE, SystemState::TYPE_NAME);
    let odometry = watch(ODOMETRY, Odometry::TYPE_NAME);
    let tf = watch(TF, TFMessage::TYPE_NAME);
    let file = control.to_str().unwrap();
    let kind = ControlSequence::TYPE_NAME;
    let command = ["publish", CONTROL, kind, "--file", file];
    let commander = world.ros_python("ros2_peer.py", &command);
    commander.finish().expect(0);

    let report = propagator.await_flown();
    assert_eq!(report.steps, 1000);
    assert!(report.miss.unwrap().norm <= 1e-12);
    let flown = printed::<Odometry>(odometry);
    assert_eq!(flown.len(), 101);
    assert_eq!(flown, payloads(&flight, ODOMETRY));
    assert_eq!(printed::<TFMessage>(tf), payloads(&flight, TF));
    // The bag has every state, from shared memory; DDS has every tenth.
    let all: Vec<SystemState> = flight.messages(STATE);
    for line in lines(state) {
        let mut state: SystemState = serde_json::from_value(line).unwrap();
        let expected = &all[usize::try_from(state.step).unwrap()];
        state.sequence = expected.sequence;
        assert_eq!(&state, expected);
    }

    let late = ["echo", SCENE, Scene::TYPE_NAME, "--qos", "latched"];
    let found = lines(world.ros_python("ros2_peer.py", &late)).remove(0);
    let found: Scene = serde_json::from_value(found).unwrap();
    assert_eq!(found.text, flight.messages::<Scene>(SCENE)[0].text);
    propagator.stop().expect(0);
}

/// A node of ROS 2 publishes control sequences and `/parameter_events` for no late joiners.
#[test]
fn neither_side_warns_of_incompatible_qos() {
    let world = World::new();
    let scene = format!("scene:={}", scene("inclination_change").display());
    let control = world.path("control.json");
    std::fs::write(&control, serde_json::to_string(&coast()).unwrap()).unwrap();
    let output = format!("output:={}", world.path("bag").display());
    let recorder = world.node("recorder", &[&output]);
    let planner = world.node("planner", &[&scene, "plan_at_start:=false"]);
    let propagator = world.node("propagator", &[&scene, "real_time_factor:=0.0"]);
    for topic in ["/parameter_events", "/diagnostics", "/rosout", TF] {
        recorder.await_stderr(&format!("recording {topic}\n"));
    }

    let file = control.to_str().unwrap();
    let kind = ControlSequence::TYPE_NAME;
    let command = [
        "publish", CONTROL, kind, "--file", file, "--qos", "reliable",
    ];
    let commander = world.ros_python("ros2_peer.py", &command).finish();
    propagator.await_event("flown", |event| {
        matches!(event, Event::Flown(_)).then_some(())
    });
    // Takes until all of the recorder's endpoints are known.
    let arguments = ["graph", "/lgvi_recorder", "--topics", "3"];
    let listener = world.ros_python("ros2_peer.py", &arguments).finish();
    let nodes = [propagator, planner, recorder].map(Process::stop);
    for finished in [commander, listener].into_iter().chain(nodes) {
        let stderr = finished.expect(0).stderr;
        for warning in ["incompatible QoS", "no messages will be"] {
            assert!(!stderr.contains(warning), "{stderr}");
        }
    }
}

/// The planner of a scene, waiting for goals.
fn planner(world: &World, scene: &std::path::Path) -> Process {
    let scene = format!("scene:={}", scene.display());
    let planner = world.node("planner", &[&scene, "plan_at_start:=false"]);
    planner.await_ready();
    planner
}

fn act(world: &World, goal: &str, more: &[&str]) -> Vec<Value> {
    let mut arguments = vec!["act", ACTION, "lgvi_msgs/action/PlanManeuver", goal];
    arguments.extend(more);
    lines(world.ros_python("ros2_peer.py", &arguments))
}

const GOAL: &str = r#"{"first_step": 0, "deadline": 0.0, "warm": false}"#;

#[test]
fn an_action_client_of_ros_2_gets_its_plan() {
    let world = World::new();
    let planner = planner(&world, &scene("inclination_change"));
    let said = act(&world, GOAL, &[]);
    let kinds: BTreeSet<&str> = said
        .iter()
        .flat_map(|line| line.as_object().unwrap().keys().map(String::as_str))
        .collect();
    assert_eq!(kinds, ["accepted", "feedback", "result", "status"].into());
    assert_eq!(
        said.iter().find_map(|line| line["accepted"].as_bool()),
        Some(true)
    );
    let last = said.last().unwrap();
    assert_eq!(last["status"], SUCCEEDED);
    let result = &last["result"];
    assert_eq!(result["success"], true);
    assert!(
        (result["cost"].as_f64().unwrap() - 13.030005006).abs() < 1e-8,
        "{result}"
    );
    // The controls are too long for RustDDS to send them to Fast DDS in a reply: they are on their topic.
    let topic = "/lgvi_planner/control_sequence";
    let late = [
        "echo",
        topic,
        ControlSequence::TYPE_NAME,
        "--qos",
        "latched",
    ];
    let plan = lines(world.ros_python("ros2_peer.py", &late)).remove(0);
    assert_eq!(plan["force"].as_array().map(Vec::len), Some(1000));

    let graph = Graph::of(&world, "/lgvi_planner", "4");
    let action = |part: &str| format!("{ACTION}/_action/{part}");
    let own = |part: &str| format!("lgvi_msgs/action/PlanManeuver_{part}");
    has(
        &graph.services,
        &[
            (&*action("send_goal"), &*own("SendGoal")),
            (&*action("get_result"), &*own("GetResult")),
            (&*action("cancel_goal"), "action_msgs/srv/CancelGoal"),
        ],
    );
    has(
        &graph.publishers,
        &[
            (&*action("feedback"), &*own("FeedbackMessage")),
            (&*action("status"), "action_msgs/msg/GoalStatusArray"),
        ],
    );
    planner.stop().expect(0);
}

#[test]
fn an_action_client_of_ros_2_cancels_its_goal_and_hears_why_another_is_not_accepted() {
    let world = World::new();
    let long = edited(
        &world,
        "inclination_change",
        &[("steps = 1000", "steps = 1000000")],
    );
    let planner = planner(&world, &long);
    let said = act(&world, GOAL, &["--cancel-after", "1"]);
    let canceling = said.iter().find(|line| line["canceling"].is_array());
    assert_eq!(canceling.unwrap()["canceling"], serde_json::json!([true]));
    assert_eq!(said.last().unwrap()["status"], CANCELED);

    let negative = GOAL.replace("0.0", "-1.0");
    assert_eq!(
        act(&world, &negative, &[]),
        [serde_json::json!({ "accepted": false })]
    );
    planner.stop().expect(0);
}

#[test]
fn a_ros_2_client_manages_the_propagator_and_intervenes_in_its_flight() {
    let world = World::new();
    let scene = format!("scene:={}", scene("free_body").display());
    let propagator = world.node("propagator", &["autostart:=false", &scene]);
    let state = || ("get_state", "lifecycle_msgs/srv/GetState", json!({}));
    let change = |id: u8, label: &str| {
        let transition = json!({"transition": {"id": id, "label": label}});
        ("change_state", "lifecycle_msgs/srv/ChangeState", transition)
    };
    let graph = "lifecycle_msgs/srv/GetAvailableTransitions";
    let trigger = "std_srvs/srv/Trigger";
    let body = json!({
        "name": "body", "position": [1.0, 2.0, 3.0], "linear_momentum": [0.0, 0.0, 0.0],
        "attitude": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], "angular_momentum": [0.0, 0.0, 1.0],
    });
    let calls = [
        change(3, "activate"),
        change(1, "configure"),
        change(3, ""),
        state(),
        ("get_available_transitions", graph, json!({})),
        ("pause", "std_srvs/srv/SetBool", json!({"data": true})),
        ("reset", trigger, json!({})),
        ("step", "lgvi_msgs/srv/Step", json!({"steps": 9})),
        (
            "set_state",
            "lgvi_msgs/srv/SetState",
            json!({"bodies": [body.clone()]}),
        ),
        (
            "set_state",
            "lgvi_msgs/srv/SetState",
            json!({"bodies": [body.clone(), body]}),
        ),
        change(0, "deactivate"),
        ("reset", trigger, json!({})),
        change(2, "cleanup"),
        change(5, "shutdown"),
        state(),
    ];
    let calls = calls.map(|(service, kind, request)| {
        json!([format!("/lgvi_propagator/{service}"), kind, request])
    });
    let calls = Value::from(calls.to_vec()).to_string();
    let responses = lines(world.ros_python("ros2_peer.py", &["calls", &calls]));
    let success = |response: usize| responses[response]["success"] == json!(true);
    let expected = [false, true, true];
    assert_eq!(
        [success(0), success(1), success(2)],
        expected,
        "{responses:?}"
    );
    assert_eq!(
        responses[3]["current_state"],
        json!({"id": 3, "label": "active"})
    );
    let transitions = responses[4]["available_transitions"].as_array().unwrap();
    let labels = transitions.iter().map(|edge| &edge["transition"]["label"]);
    assert!(labels.eq(["deactivate", "shutdown"]), "{transitions:?}");
    assert!(success(5) && success(6), "{responses:?}");
    assert_eq!(responses[7]["step"], 9, "{}", responses[7]);
    assert!(success(8) && responses[8]["step"] == 9, "{}", responses[8]);
    assert!(!success(9), "{}", responses[9]);
    assert!(success(10) && !success(11), "{responses:?}");
    assert!(success(12) && success(13), "{responses:?}");
    assert_eq!(
        responses[14]["current_state"],
        json!({"id": 4, "label": "finalized"})
    );
    propagator.stop().expect(0);
}
