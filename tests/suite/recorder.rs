//! The recorder on its own, among publishers that it has not been made for.

use std::time::{Duration, Instant};

use lgvi_common::Event;
use lgvi_middleware::ros::Qos;
use lgvi_msgs::msg::{ControlSequence, PlanProgress, SystemState};
use lgvi_tests::{Process, Recording, Summary, World, coast, edited, eventually, publish, scene};

const CONTROL: &str = "/lgvi_propagator/control_sequence";
const PROGRESS: &str = "/lgvi_planner/progress";
const ODOMETRY: &str = "/lgvi_propagator/odometry/body";
const STATE: &str = "/lgvi_propagator/state";

/// How soon the bag must be closed after Ctrl-C; a loaded machine has some more.
const SOON: Duration = Duration::from_secs(5);

/// Waits until so many messages of a topic are recorded.
#[track_caller]
fn await_recorded(recorder: &Process, topic: &str, count: u64) {
    let awaited = format!("{count} messages on {topic}");
    eventually(&awaited, || {
        let stdout = recorder.stdout();
        let events = stdout
            .lines()
            .filter_map(|line| serde_json::from_str(line).ok());
        let mut latest = events.filter_map(|event| match event {
            Event::Recording { messages, .. } => messages.get(topic).copied(),
            _ => None,
        });
        (latest.next_back()? >= count).then_some(())
    });
}

#[test]
fn ctrl_c_closes_the_bag_though_publishers_go_on() {
    let world = World::new();
    let bag = world.path("bag");
    let output = format!("output:={}", bag.display());
    let recorder = world.node("recorder", &[&output]);
    recorder.await_ready();
    // A hundred states a second, for a hundred seconds.
    let scene = format!("scene:={}", scene("free_body").display());
    let propagator = world.node(
        "propagator",
        &[&scene, "real_time_factor:=1.0", "await_subscribers:=1"],
    );
    await_recorded(&recorder, STATE, 100);

    let start = Instant::now();
    recorder.stop().expect(0);
    let took = start.elapsed();
    assert!(took < SOON, "{took:?}");
    assert!(bag.join("metadata.yaml").exists(), "the bag is not closed");
    assert!(Recording::read(&bag).on(STATE).count() >= 100);
    propagator.stop().expect(0);
}

#[test]
fn states_are_recorded_once_however_often_they_are_named() {
    let world = World::new();
    let bag = world.path("bag");
    let output = format!("output:={}", bag.display());
    let states = format!("states:=[{STATE}, lgvi_propagator/state, {STATE}]");
    let recorder = world.node("recorder", &[&output, &states]);
    recorder.await_ready();
    let scene = format!("scene:={}", scene("free_body").display());
    let arguments = [&scene, "real_time_factor:=0.0", "await_subscribers:=1"];
    let propagator = world.node("propagator", &arguments);
    await_recorded(&recorder, STATE, 10_000);
    propagator.stop().expect(0);
    recorder.stop().expect(0);
    let recording = Recording::read(&bag);
    let sequences: Vec<u32> = recording.on(STATE).map(|record| record.sequence).collect();
    let whole: Vec<u32> = (0..).take(sequences.len()).collect();
    assert_eq!(sequences, whole);
}

#[test]
fn lgvi_record_is_the_recorder_as_a_tool() {
    let world = World::new();
    let bag = world.path("bag");
    let topics = [
        "/lgvi_propagator/scene",
        "/tf",
        "/lgvi_propagator/invariants",
        ODOMETRY,
    ];
    let options = ["--compression", "lz4", "--log-time", "stamp"];
    let line = ["record", "--output", bag.to_str().unwrap(), "--topics"];
    let line = line.into_iter().chain(topics).chain(options);
    let recorder = world.lgvi(line);
    recorder.await_stderr("writing");
    let scene = format!("scene:={}", scene("free_body").display());
    let arguments = [&scene, "real_time_factor:=0.0", "await_subscribers:=1"];
    let propagator = world.node("propagator", &arguments);
    propagator.await_flown();
    propagator.stop().expect(0);
    recorder.stop().expect(0);
    let [scene, tf, invariants, odometry] = topics;
    let counts = [
        (scene, 1),
        (STATE, 10_001),
        (tf, 101),
        (invariants, 101),
        (odometry, 101),
    ];
    assert_eq!(Recording::read(&bag).counts(), counts.into());
    world.verify_agrees(&bag, 10_001);
}

#[test]
fn lgvi_run_splits_and_compresses_as_it_is_told() {
    let world = World::new();
    let changes = [
        ("duration = 100.0", "duration = 20.0"),
        ("steps = 10000", "steps = 2000"),
    ];
    let scene = edited(&world, "free_body", &changes);
    let options = ["--compression", "none", "--max-bytes", "200000"];
    let summary: Summary = world
        .start_flight(&scene, "bag", &options)
        .finish()
        .expect(0)
        .json();
    assert_eq!(summary.lost, Some(0), "messages lost");
    let bag = world.path("bag");
    assert!(bag.join("bag_2.mcap").exists());
    let info = world
        .lgvi(["info", bag.to_str().unwrap(), "--json"])
        .finish()
        .expect(0);
    let info: serde_json::Value = info.json();
    let chunks = info["chunks"].as_object().unwrap();
    assert_eq!(chunks.keys().collect::<Vec<_>>(), ["none"]);
    world.verify_agrees(&bag, 2001);
}

/// Until they come to shared memory too.
#[test]
fn states_that_come_over_dds_only_are_told() {
    let world = World::new();
    let bag = world.path("bag");
    let output = format!("output:={}", bag.display());
    let recorder = world.node("recorder", &[&output, "states:=[/elsewhere]"]);
    recorder.await_ready();
    let node = world.ros_node("remote");
    let publisher = node
        .publisher::<SystemState>("/elsewhere", &Qos::reliable(10))
        .unwrap();
    recorder.await_stderr("/elsewhere is published over DDS only and not recorded");
    drop(publisher);
    recorder.stop().expect(0);
}

#[test]
fn a_planner_that_fails_at_once_is_heard_to_the_end() {
    let world = World::new();
    let solver = "[maneuver.solver]\nmax_iterations = 1\n\n[maneuver.target]";
    let changes = [("[maneuver.target]", solver)];
    let scene = edited(&world, "inclination_change", &changes);
    let bag = world.path("bag");
    let output = format!("output:={}", bag.display());
    let topics = format!("topics:=['{PROGRESS}=lgvi_msgs/msg/PlanProgress']");
    let recorder = world.node("recorder", &[&output, &topics]);
    recorder.await_ready();
    let scene = format!("scene:={}", scene.display());
    world.node("planner", &[&scene]).finish().expect(1);
    recorder.stop().expect(0);

    let progress = Recording::read(&bag).messages::<PlanProgress>(PROGRESS);
    let statuses: Vec<_> = progress.iter().map(|now| now.status).collect();
    let (last, before) = statuses.split_last().unwrap();
    assert_eq!(*last, PlanProgress::FAILED);
    assert!(!before.is_empty() && before.iter().all(|status| *status == PlanProgress::SOLVING));
}

#[test]
fn a_topic_is_recorded_once_from_publishers_of_every_kind() {
    let world = World::new();
    let node = world.ros_node("latched");
    // History, sent before anybody listens.
    let latched = node
        .publisher::<ControlSequence>(CONTROL, &Qos::latched(8))
        .unwrap();
    let sequence = |first_step| ControlSequence {
        first_step,
        ..coast()
    };
    (0..3).for_each(|step| latched.publish(&sequence(step)).unwrap());

    let bag = world.path("bag");
    let output = format!("output:={}", bag.display());
    let topics = format!("topics:=['{CONTROL}=lgvi_msgs/msg/ControlSequence']");
    let recorder = world.node("recorder", &[&output, &topics]);
    await_recorded(&recorder, CONTROL, 3);

    let file = world.path("control.json");
    std::fs::write(&file, serde_json::to_string(&sequence(10)).unwrap()).unwrap();
    let arguments = ["--send-control", CONTROL, "--qos", "reliable", "--file"];
    let arguments = [&arguments[..], &[file.to_str().unwrap()]].concat();
    let volatile = world.python("cyclone_peer.py", &arguments);
    volatile.finish().expect(0);
    await_recorded(&recorder, CONTROL, 4);

    // Now there are two subscriptions to these.
    (3..6).for_each(|step| latched.publish(&sequence(step)).unwrap());
    let late = publish(&world.ros_node("late"), &sequence(20));
    await_recorded(&recorder, CONTROL, 8);
    recorder.stop().expect(0);
    drop((latched, late));

    let mut steps: Vec<_> = Recording::read(&bag)
        .messages::<ControlSequence>(CONTROL)
        .iter()
        .map(|sequence| sequence.first_step)
        .collect();
    steps.sort_unstable();
    assert_eq!(steps, [0, 1, 2, 3, 4, 5, 10, 20]);
}
