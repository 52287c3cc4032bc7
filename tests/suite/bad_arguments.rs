//! Arguments, parameters and variables that a node does not understand.

use lgvi_tests::{Finished, World, binary, scene};

const NODES: [&str; 4] = [
    "lgvi_propagator",
    "lgvi_planner",
    "lgvi_recorder",
    "lgvi_player",
];

fn run(world: &World, node: &str, arguments: &[&str]) -> Finished {
    let mut command = world.command(&binary(node));
    command.args(arguments);
    world.start(node, command).finish()
}

#[test]
fn every_node_refuses_what_it_does_not_know_by_its_name() {
    let world = World::new();
    for node in NODES {
        run(&world, node, &["--nonsense"])
            .expect(2)
            .says(&["\"--nonsense\""]);
        run(&world, node, &["--ros-args", "--nonsense"])
            .expect(2)
            .says(&["\"--nonsense\""]);
        let unknown = run(&world, node, &["--ros-args", "-p", "nonsense:=1"]).expect(2);
        unknown.says(&["unknown parameter \"nonsense\"", "this node has"]);
        run(&world, node, &["--ros-args", "-p", "nonsense"])
            .expect(2)
            .says(&["\"nonsense\""]);
    }
}

#[test]
fn a_parameter_with_a_wrong_value_is_refused_with_name_value_and_expectation() {
    let scene = format!("scene:={}", scene("free_body").display());
    let cases: [(&str, &[&str], &[&str]); 8] = [
        (
            "lgvi_propagator",
            &[],
            &["\"scene\" is missing", "expected a path"],
        ),
        (
            "lgvi_planner",
            &[],
            &["\"scene\" is missing", "expected a path"],
        ),
        (
            "lgvi_player",
            &[],
            &["\"bag\" is missing", "expected a path"],
        ),
        (
            "lgvi_propagator",
            &[&scene, "real_time_factor:=-1.0"],
            &["\"real_time_factor\" is -1", "expected a finite number ≥ 0"],
        ),
        (
            "lgvi_propagator",
            &[&scene, "real_time_factor:=fast"],
            &["\"real_time_factor\" is fast", "expected a number"],
        ),
        (
            "lgvi_propagator",
            &[&scene, "await_control:=true"],
            &["\"await_control\" is true", "expected false"],
        ),
        ("lgvi_planner", &[&scene], &["`maneuver` is missing"]),
        (
            "lgvi_recorder",
            &["topics:=['/tf=tf2_msgs/msg/Nothing']"],
            &[
                "\"topics\" has \"/tf=tf2_msgs/msg/Nothing\"",
                "expected a message type",
            ],
        ),
    ];
    let world = World::new();
    for (node, parameters, fragments) in cases {
        let mut arguments = vec!["--ros-args"];
        arguments.extend(parameters.iter().flat_map(|parameter| ["-p", parameter]));
        run(&world, node, &arguments).expect(2).says(fragments);
    }
}

#[test]
fn a_domain_that_is_none_is_refused() {
    let world = World::new();
    for node in NODES {
        let mut command = world.command(&binary(node));
        command.env("ROS_DOMAIN_ID", "233");
        let finished = world.start(node, command).finish().expect(2);
        finished.says(&[
            "ROS_DOMAIN_ID is \"233\"",
            "expected a number from 0 to 232",
        ]);
    }
}
