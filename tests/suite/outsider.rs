//! A stranger's process, on Cyclone DDS and without any code of ours, commands the propagator and watches it.

use lgvi_msgs::msg::ControlSequence;
use lgvi_msgs::nav_msgs::Odometry;
use lgvi_msgs::tf2_msgs::TFMessage;
use lgvi_msgs::{RosMessage, cdr};
use lgvi_tests::{Process, Recording, World, scene};

const CONTROL: &str = "/lgvi_propagator/control_sequence";
const ODOMETRY: &str = "/lgvi_propagator/odometry/spacecraft";
const TF: &str = "/tf";

/// The messages that a peer has printed, as CDR.
fn printed<M: RosMessage>(peer: Process) -> Vec<Vec<u8>> {
    let output = peer.finish().expect(0).stdout;
    output
        .lines()
        .map(|line| cdr::encode::<M>(&serde_json::from_str(line).unwrap()).unwrap())
        .collect()
}

fn payloads<'a>(flight: &'a Recording, topic: &str) -> Vec<&'a [u8]> {
    flight.on(topic).map(|record| &*record.data).collect()
}

#[test]
fn the_propagator_flies_a_strangers_controls_and_the_stranger_sees_every_bit_of_it() {
    let world = World::new();
    let scene = scene("inclination_change");
    let (_, bag) = world.fly(&scene, "flight");
    let flight = Recording::read(&bag);
    let plan = flight
        .messages::<ControlSequence>("/lgvi_propagator/flown_control")
        .pop()
        .unwrap();
    let control = world.path("control.json");
    std::fs::write(&control, serde_json::to_string(&plan).unwrap()).unwrap();

    let repeated = world.path("repeated");
    let output = format!("output:={}", repeated.display());
    let topics = "topics:=[/lgvi_propagator/scene=lgvi_msgs/msg/Scene, \
                  /lgvi_propagator/flown_control=lgvi_msgs/msg/ControlSequence, \
                  /lgvi_propagator/invariants=lgvi_msgs/msg/Invariants]";
    let recorder = world.node("recorder", &[&output, topics, "log_time:=stamp"]);
    recorder.await_ready();
    let scene = format!("scene:={}", scene.display());
    let propagator = world.node(
        "propagator",
        &[&scene, "real_time_factor:=0.0", "await_subscribers:=1"],
    );
    propagator.await_ready();

    let watch = |option, topic| {
        let peer = world.python("cyclone_peer.py", &[option, topic, "--count", "101"]);
        peer.await_stderr("matched");
        peer
    };
    let (odometry, tf) = (watch("--odometry", ODOMETRY), watch("--tf", TF));
    let file = control.to_str().unwrap();
    let commander = world.python(
        "cyclone_peer.py",
        &["--send-control", CONTROL, "--file", file],
    );
    commander.finish().expect(0);

    let report = propagator.await_flown();
    assert_eq!(report.steps, 1000);
    assert!(report.miss.unwrap().norm <= 1e-12);
    assert_eq!(printed::<Odometry>(odometry), payloads(&flight, ODOMETRY));
    assert_eq!(printed::<TFMessage>(tf), payloads(&flight, TF));
    let last = flight
        .messages::<Odometry>(ODOMETRY)
        .pop()
        .unwrap()
        .pose
        .pose
        .position;
    // `maneuver.target.position` of the scene.
    let target = [
        -0.353_553_390_593_273_8,
        0.353_553_390_593_273_8,
        0.866_025_403_784_438_6,
    ];
    for (found, expected) in [last.x, last.y, last.z].into_iter().zip(target) {
        assert!((found - expected).abs() < 1e-12, "{last:?}");
    }

    propagator.stop().expect(0);
    recorder.stop().expect(0);
    world.verify_agrees(&repeated, 1001);
    let state = "/lgvi_propagator/state";
    assert!(payloads(&Recording::read(&repeated), state) == payloads(&flight, state));
}
