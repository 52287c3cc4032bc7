//! Managed nodes, led through their lives by their services.

use std::io::Write;
use std::path::PathBuf;
use std::time::Duration;

use lgvi_common::Event;
use lgvi_middleware::ros::{ActionClient, GoalState, Qos, Subscription};
use lgvi_msgs::action::{PlanManeuver, PlanManeuverGoal};
use lgvi_msgs::lifecycle_msgs::TransitionEvent;
use lgvi_msgs::lifecycle_msgs::srv::{
    GetAvailableStates, GetAvailableStatesRequest, GetAvailableTransitions,
    GetAvailableTransitionsRequest,
};
use lgvi_msgs::msg::SystemState;
use lgvi_msgs::rcl_interfaces::Log;
use lgvi_msgs::std_srvs::srv::{Trigger, TriggerRequest};
use lgvi_tests::{
    Operator, PATIENCE, Process, Recording, World, binary, coast, edited, eventually, publish,
    root, scene,
};

const STATE: &str = "/lgvi_propagator/state";

/// Nodes do nothing of their own accord.
const MANAGED: &str = "autostart:=false";

/// The parameter that names a scene.
fn flying(name: &str) -> String {
    format!("scene:={}", scene(name).display())
}

fn transition_events(operator: &Operator, node: &str) -> Subscription<TransitionEvent> {
    let topic = format!("/{node}/transition_event");
    let events = operator
        .ros()
        .subscription(&topic, &Qos::reliable(100))
        .unwrap();
    eventually("the publisher of transition events", || {
        (events.matched_publishers() > 0).then_some(())
    });
    events
}

/// Transitions as they were made, as label and goal.
#[track_caller]
fn made(events: &Subscription<TransitionEvent>, expected: &[(&str, &str)]) {
    for (label, goal) in expected {
        let event = events.recv_timeout(PATIENCE).unwrap();
        let event = event.expect("a transition event").message;
        let found = (event.transition.label, event.goal_state.label);
        assert_eq!(found, ((*label).to_owned(), (*goal).to_owned()));
    }
}

/// The transitions that are possible now, and those of the whole graph.
fn transitions(operator: &Operator) -> (Vec<String>, usize) {
    let request = GetAvailableTransitionsRequest::default();
    let call = |service| {
        operator
            .call::<GetAvailableTransitions>(service, &request)
            .available_transitions
    };
    let available = call("get_available_transitions").into_iter();
    let labels = available.map(|description| description.transition.label);
    (labels.collect(), call("get_transition_graph").len())
}

#[test]
fn every_node_is_led_through_its_life() {
    let world = World::new();
    let scene = flying("inclination_change");
    let output = format!("output:={}", world.path("bag").display());
    let bag = format!("bag:={}", root().join("bags/inclination_change").display());
    let started = [
        ("propagator", vec![&*scene]),
        ("planner", vec![&*scene]),
        ("recorder", vec![&*output]),
        ("player", vec![&*bag, "await_subscribers:=9"]),
    ];
    for (kind, parameters) in started {
        let name = format!("lgvi_{kind}");
        let node = world.node(kind, &[&[MANAGED][..], &parameters].concat());
        let operator = world.operator(&name);
        assert_eq!(operator.state(), "unconfigured", "{kind}");
        assert_eq!(world.shared_memory(), Vec::<PathBuf>::new(), "{kind}");
        let events = transition_events(&operator, &name);
        assert_eq!(
            transitions(&operator),
            (vec!["configure".into(), "shutdown".into()], 25)
        );
        let states = operator.call::<GetAvailableStates>(
            "get_available_states",
            &GetAvailableStatesRequest::default(),
        );
        assert_eq!(states.available_states.len(), 11, "{states:?}");

        for impossible in ["activate", "deactivate", "cleanup", "nonsense"] {
            assert!(!operator.change(impossible), "{kind} {impossible}");
        }
        operator.lead(&["configure"]);
        assert_ne!(world.shared_memory(), Vec::<PathBuf>::new(), "{kind}");
        assert!(!operator.change("configure"), "{kind}");
        operator.lead(&["activate"]);
        assert_eq!(transitions(&operator).0, ["deactivate", "shutdown"]);
        operator.lead(&["deactivate", "cleanup"]);
        assert_eq!(world.shared_memory(), Vec::<PathBuf>::new(), "{kind}");
        assert_eq!(operator.state(), "unconfigured", "{kind}");

        std::fs::remove_dir_all(world.path("bag")).ok();
        operator.lead(&["configure", "activate", "shutdown"]);
        assert_eq!(operator.state(), "finalized", "{kind}");
        assert_eq!(world.shared_memory(), Vec::<PathBuf>::new(), "{kind}");
        assert!(!operator.change("configure"), "{kind}");
        let succeeds = "transition_success";
        let life = [
            ("configure", "configuring"),
            (succeeds, "inactive"),
            ("activate", "activating"),
            (succeeds, "active"),
            ("deactivate", "deactivating"),
            (succeeds, "inactive"),
            ("cleanup", "cleaningup"),
            (succeeds, "unconfigured"),
            ("configure", "configuring"),
            (succeeds, "inactive"),
            ("activate", "activating"),
            (succeeds, "active"),
            ("shutdown", "shuttingdown"),
            (succeeds, "finalized"),
        ];
        made(&events, &life);
        node.stop().expect(0);
    }
}

#[test]
fn a_node_that_cannot_be_configured_says_why_and_can_be_put_right() {
    let world = World::new();
    let node = world.node("propagator", &[MANAGED, "scene:=/nowhere.toml"]);
    let operator = world.operator("lgvi_propagator");
    let log: Subscription<Log> = operator
        .ros()
        .subscription("/rosout", &Qos::latched(100))
        .unwrap();
    let events = transition_events(&operator, "lgvi_propagator");
    assert!(!operator.change("configure"));
    made(
        &events,
        &[
            ("configure", "configuring"),
            ("transition_failure", "unconfigured"),
        ],
    );
    let said = eventually("the error on /rosout", || {
        let said = log.take().unwrap()?.message;
        (said.level == Log::ERROR).then_some(said)
    });
    assert!(said.msg.contains("/nowhere.toml"), "{}", said.msg);
    assert_eq!(world.shared_memory(), Vec::<PathBuf>::new());

    let right = scene("free_body");
    operator.set_text("scene", right.to_str().unwrap()).unwrap();
    operator.lead(&["configure"]);
    let refused = operator.set_text("scene", "/other.toml").unwrap_err();
    assert!(refused.contains("scene"), "{refused}");
    operator.lead(&["activate"]);
    node.stop().expect(0);
}

/// A sequence that spins the body up until a step cannot be made.
fn spin_up() -> lgvi_msgs::msg::ControlSequence {
    let mut sequence = coast();
    for moment in &mut sequence.moment {
        moment.x = 100.0;
    }
    sequence
}

#[test]
fn an_error_in_flight_leads_a_managed_node_to_unconfigured() {
    let world = World::new();
    let scene = flying("inclination_change");
    let node = world.node("propagator", &[MANAGED, &scene]);
    let operator = world.operator("lgvi_propagator");
    let events = transition_events(&operator, "lgvi_propagator");
    operator.lead(&["configure", "activate"]);
    let fatal = publish(operator.ros(), &spin_up());
    let succeeds = "transition_success";
    made(
        &events,
        &[
            ("configure", "configuring"),
            (succeeds, "inactive"),
            ("activate", "activating"),
            (succeeds, "active"),
            ("deactivate", "deactivating"),
            ("transition_error", "errorprocessing"),
            (succeeds, "unconfigured"),
        ],
    );
    assert_eq!(operator.state(), "unconfigured");
    assert_eq!(world.shared_memory(), Vec::<PathBuf>::new());
    node.await_stderr("past the limit of solvability");

    // It can be tried again, with something else.
    drop(fatal);
    let _harmless = publish(operator.ros(), &coast());
    operator.lead(&["configure", "activate"]);
    node.await_stderr("flown 1000 steps");
    assert_eq!(operator.state(), "active");
    node.stop().expect(0);
}

#[test]
fn an_error_in_flight_ends_a_node_that_nobody_manages() {
    let world = World::new();
    let scene = flying("inclination_change");
    let node = world.node("propagator", &[&scene]);
    let stranger = world.ros_node("stranger");
    let _fatal = publish(&stranger, &spin_up());
    node.finish()
        .expect(1)
        .says(&["past the limit of solvability"]);
}

/// Waits until the flight has come to a step, as its states over DDS say.
#[track_caller]
fn await_step(states: &Subscription<SystemState>, step: u64) {
    eventually(&format!("step {step}"), || {
        let state = states.take().unwrap()?.message;
        (state.step >= step).then_some(())
    });
}

fn states(operator: &Operator) -> Subscription<SystemState> {
    operator
        .ros()
        .subscription(STATE, &Qos::reliable(1000))
        .unwrap()
}

#[test]
fn a_flight_that_was_interrupted_goes_on_bit_for_bit() {
    let world = World::new();
    let scene = edited(
        &world,
        "free_body",
        &[
            ("duration = 100.0", "duration = 6.0"),
            ("steps = 10000", "steps = 600"),
        ],
    );
    let bag = world.path("bag");
    let output = format!("output:={}", bag.display());
    let recorder = world.node("recorder", &[&output, "log_time:=stamp"]);
    recorder.await_ready();
    let scene = format!("scene:={}", scene.display());
    let parameters = [MANAGED, &scene, "ros_every:=10", "await_subscribers:=1"];
    let node = world.node("propagator", &parameters);
    let operator = world.operator("lgvi_propagator");
    let states = states(&operator);
    operator.lead(&["configure", "activate"]);
    await_step(&states, 100);
    operator.lead(&["deactivate"]);
    // What was still on its way.
    while states
        .recv_timeout(Duration::from_millis(500))
        .unwrap()
        .is_some()
    {}
    let refused = operator.call::<Trigger>("reset", &TriggerRequest::default());
    assert!(!refused.success && refused.message.contains("not active"));
    let still = states.recv_timeout(Duration::from_millis(300)).unwrap();
    assert!(still.is_none(), "{still:?}");
    operator.lead(&["activate"]);
    let next = states.recv_timeout(PATIENCE).unwrap().expect("a state");
    assert!(next.message.step < 600, "it did not wait");
    node.await_stderr("flown 600 steps");
    node.stop().expect(0);
    recorder.stop().expect(0);
    world.verify_agrees(&bag, 601);
}

const ACTION: &str = "/lgvi_planner/plan_maneuver";

#[test]
fn a_planner_takes_goals_only_while_it_is_active() {
    let world = World::new();
    let endless = edited(
        &world,
        "inclination_change",
        &[("steps = 1000", "steps = 1000000")],
    );
    let endless = format!("scene:={}", endless.display());
    let node = world.node("planner", &[MANAGED, &endless, "plan_at_start:=false"]);
    let operator = world.operator("lgvi_planner");
    operator.lead(&["configure"]);
    let client: ActionClient<PlanManeuver> = operator.ros().action_client(ACTION).unwrap();
    assert!(client.wait_for_server(PATIENCE));
    let goal = PlanManeuverGoal::default;
    assert!(
        client.send_goal(goal(), PATIENCE).is_err(),
        "while inactive"
    );

    operator.lead(&["activate"]);
    let under_way = client.send_goal(goal(), PATIENCE).unwrap();
    assert!(client.feedback(under_way, PATIENCE).unwrap().is_some());
    operator.lead(&["deactivate"]);
    let outcome = client.result(under_way, PATIENCE).unwrap();
    assert_eq!(outcome.state, GoalState::Aborted);
    assert!(
        outcome.result.message.contains("planner stops"),
        "{}",
        outcome.result.message
    );
    assert!(
        client.send_goal(goal(), PATIENCE).is_err(),
        "while inactive"
    );
    operator.lead(&["activate"]);
    client.send_goal(goal(), PATIENCE).unwrap();
    node.stop().expect(0);
}

#[test]
fn an_inactive_planner_keeps_no_flight_waiting() {
    let world = World::new();
    let mut command = world.command(&binary("lgvi_planner"));
    let remapped = "~/state:=/lgvi_propagator/state";
    command
        .args(["--ros-args", "-r", remapped, "-p", MANAGED, "-p"])
        .args([&flying("inclination_change"), "-p", "plan_at_start:=false"]);
    let planner = world.start("planner", command);
    let operator = world.operator("lgvi_planner");
    operator.lead(&["configure", "activate", "deactivate"]);
    // More states than have room to wait, and none may be lost.
    let parameters = [&*flying("free_body"), "real_time_factor:=0.0"];
    let propagator = world.node("propagator", &parameters);
    let report = propagator.await_flown();
    assert_eq!((report.steps, report.refused), (10_000, 0));
    // Nobody is waited for as long as for who does not keep up, 5 s.
    assert!(report.seconds < 4.0, "{} s", report.seconds);
    propagator.stop().expect(0);
    planner.stop().expect(0);
}

#[test]
fn a_recorder_makes_a_bag_each_time_that_it_is_active() {
    let world = World::new();
    let [first, second] = ["first", "second"].map(|name| world.path(name));
    let output = format!("output:={}", first.display());
    let node = world.node("recorder", &[MANAGED, &output]);
    let operator = world.operator("lgvi_recorder");
    operator.lead(&["configure"]);
    assert!(!first.exists());
    let propagator = world.node("propagator", &[&flying("free_body")]);
    let recorded = |bag: &PathBuf| {
        operator.lead(&["activate"]);
        eventually("states in the bag", || {
            let stdout = node.stdout();
            let last = stdout
                .lines()
                .rev()
                .find(|line| line.contains("\"event\""))?;
            match serde_json::from_str(last).ok()? {
                Event::Recording { messages, .. } => (*messages.get(STATE)? >= 20).then_some(()),
                _ => None,
            }
        });
        operator.lead(&["deactivate"]);
        assert!(Recording::read(bag).on(STATE).count() >= 20);
    };
    recorded(&first);
    let before = Recording::read(&first);
    assert!(!operator.change("activate"), "the bag exists");
    assert_eq!(operator.state(), "inactive");
    node.await_stderr(first.to_str().unwrap());

    operator.lead(&["cleanup"]);
    operator
        .set_text("output", second.to_str().unwrap())
        .unwrap();
    operator.lead(&["configure"]);
    recorded(&second);
    assert_eq!(Recording::read(&first), before, "the first one is complete");
    node.stop().expect(0);
    propagator.stop().expect(0);
}

#[test]
fn a_player_pauses_while_it_is_inactive() {
    let world = World::new();
    let bag = root().join("bags/inclination_change");
    let total = Recording::read(&bag).on(STATE).count() as u64;
    let bag = format!("bag:={}", bag.display());
    let node = world.node("player", &[MANAGED, &bag, "rate:=0.5"]);
    let operator = world.operator("lgvi_player");
    let states = states(&operator);
    operator.lead(&["configure"]);
    eventually("the player's topic", || {
        (states.matched_publishers() > 0).then_some(())
    });
    operator.lead(&["activate"]);
    let mut steps = Vec::new();
    let mut hear = |patience: Duration| {
        let sample = states.recv_timeout(patience).unwrap();
        sample
            .map(|sample| steps.push(sample.message.step))
            .is_some()
    };
    (0..100).for_each(|_| assert!(hear(PATIENCE)));
    operator.lead(&["deactivate"]);
    while hear(Duration::from_millis(500)) {}
    assert!(!hear(Duration::from_millis(300)));
    operator.lead(&["activate"]);
    while steps.len() < total as usize {
        let sample = states.recv_timeout(PATIENCE).unwrap();
        steps.push(sample.expect("a state").message.step);
    }
    assert!(steps.iter().copied().eq(0..total), "{steps:?}");
    node.finish().expect(0);
}

/// A line from the peer, which prints one for each that it is given.
fn ask(peer: &mut Peer, line: &str) -> serde_json::Value {
    writeln!(peer.process.stdin(), "{line}").unwrap();
    peer.heard += 1;
    let heard = peer.heard;
    eventually(&format!("the peer's answer to {line}"), || {
        let stdout = peer.process.stdout();
        let mut lines = stdout.split_inclusive('\n');
        let line = lines.nth(heard)?;
        line.ends_with('\n')
            .then(|| serde_json::from_str(line).unwrap())
    })
}

struct Peer {
    process: Process,
    heard: usize,
}

#[test]
fn a_stranger_leads_a_node_as_ros_does() {
    let world = World::new();
    let mut command = world.command(&binary("lgvi_propagator"));
    command
        .env("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp")
        .args(["--ros-args", "-p", MANAGED, "-p", &flying("free_body")]);
    let node = world.start("propagator", command);
    let process = world.python("cyclone_lifecycle_peer.py", &["/lgvi_propagator"]);
    let mut peer = Peer { process, heard: 0 };
    eventually("the peer to find the node", || {
        peer.process.stdout().contains("found").then_some(())
    });
    let mut asked = |line: &str| ask(&mut peer, line);
    let state = |label: &str, id: u8| serde_json::json!({"id": id, "label": label});
    assert_eq!(
        asked(r#"["get_state"]"#)["current_state"],
        state("unconfigured", 1)
    );
    let changes = [
        (1, "configure", state("inactive", 2)),
        (3, "activate", state("active", 3)),
        (4, "deactivate", state("inactive", 2)),
        (2, "cleanup", state("unconfigured", 1)),
    ];
    for (id, label, goal) in changes {
        assert_eq!(
            asked(r#"["change_state", 4, "nonsense"]"#)["success"],
            false
        );
        // By number, as `ros2 lifecycle` does.
        assert_eq!(
            asked(&format!(r#"["change_state", {id}, ""]"#))["success"],
            true
        );
        let [begun, ended] = [asked(r#"["event"]"#), asked(r#"["event"]"#)];
        assert_eq!(begun["transition"], state(label, id));
        assert_eq!(ended["goal_state"], goal);
        assert_eq!(asked(r#"["get_state"]"#)["current_state"], goal);
    }
    let available = asked(r#"["get_available_transitions"]"#);
    let [configure, shutdown] = &available["available_transitions"].as_array().unwrap()[..] else {
        panic!("{available}")
    };
    assert_eq!(configure["transition"], state("configure", 1));
    assert_eq!(configure["goal_state"], state("configuring", 10));
    assert_eq!(shutdown["transition"], state("shutdown", 5));
    let count = |reply: serde_json::Value, field: &str| reply[field].as_array().unwrap().len();
    let graph = asked(r#"["get_transition_graph"]"#);
    assert_eq!(count(graph, "available_transitions"), 25);
    let states = asked(r#"["get_available_states"]"#);
    assert_eq!(count(states, "available_states"), 11);
    assert_eq!(asked(r#"["change_state", 5, ""]"#)["success"], true);
    assert_eq!(
        asked(r#"["get_state"]"#)["current_state"],
        state("finalized", 4)
    );
    node.stop().expect(0);
}
