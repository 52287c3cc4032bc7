//! The launch file composes command lines with which the nodes' own programs fly together.

use lgvi_msgs::msg::SystemState;
use lgvi_tests::{Finished, Process, Recording, World, binary, root, scene, within};
use std::time::Duration;

/// Whatever the graph has by then: the recorder of the launch file records all topics of known types.
const EXPECTED: [&str; 5] = [
    "/lgvi_propagator/scene",
    "/lgvi_propagator/flown_control",
    "/lgvi_propagator/invariants",
    "/lgvi_propagator/odometry/spacecraft",
    "/tf",
];

fn start(world: &World, command: &[String]) -> Process {
    let mut process = world.command(&binary(&command[0]));
    process.args(&command[1..]);
    world.start(&command[0], process)
}

#[test]
fn a_flight_under_the_launch_file_is_recorded_whole() {
    let world = World::new();
    let bag = world.path("launched");
    let file = root().join("launch_scripts/lgvi.launch.py");
    let arguments = [
        file.display().to_string(),
        format!("scene:={}", scene("inclination_change").display()),
        format!("bag:={}", bag.display()),
    ];
    let arguments: Vec<_> = arguments.iter().map(String::as_str).collect();
    let composed: Finished = world
        .python("compose_launch.py", &arguments)
        .finish()
        .expect(0);
    let commands: Vec<Vec<String>> = composed.json();
    assert_eq!(commands.len(), 3, "{commands:?}");

    let observer = world.ros_node("observer");
    let last = observer
        .subscription::<SystemState>(
            "/lgvi_propagator/state",
            &lgvi_middleware::ros::Qos::latched(200),
        )
        .unwrap();
    let nodes: Vec<_> = commands
        .iter()
        .map(|command| start(&world, command))
        .collect();
    within(Duration::from_secs(60), "the flight's last state", || {
        let sample = last.take().unwrap()?;
        (sample.message.step == 1000).then_some(())
    });
    // The recorder drains its sources when it is told to end; it is told first.
    for node in nodes {
        node.stop().expect(0);
    }

    let recording = Recording::read(&bag);
    let counts = recording.counts();
    for topic in EXPECTED {
        assert!(
            counts.contains_key(topic),
            "{topic} is not among {counts:?}"
        );
    }
    world.verify_agrees(&bag, 1001);
}
