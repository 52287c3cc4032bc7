//! Each node is a program of its own, and takes the names that it is given.

use std::time::Duration;

use lgvi_middleware::ros::Qos;
use lgvi_msgs::{action::PlanManeuver, rcl_interfaces::Log};
use lgvi_tests::{Process, World, binary, eventually, scene};

/// Starts a node's own program as `/y/x`, with further ROS arguments.
fn renamed(world: &World, program: &str, arguments: &[&str]) -> Process {
    let mut command = world.command(&binary(program));
    command.args([
        "--supervised",
        "--ros-args",
        "-r",
        "__node:=x",
        "-r",
        "__ns:=/y",
    ]);
    command.args(["--log-level", "info"]).args(arguments);
    world.start(program, command)
}

/// Waits until the node shows these topics; none may have a default name.
#[track_caller]
fn shows(world: &World, publishers: &[&str], subscriptions: &[&str]) {
    let observer = world.ros_node("observer");
    eventually(
        &format!("publishers of {publishers:?}, subscriptions to {subscriptions:?}"),
        || {
            let topics = observer.topics();
            let of = |wanted: &[&str], count: fn(&lgvi_middleware::ros::TopicInfo) -> usize| {
                wanted.iter().all(|name| {
                    topics
                        .iter()
                        .any(|topic| topic.name == *name && count(topic) > 0)
                })
            };
            let all = of(publishers, |topic| topic.publishers)
                && of(subscriptions, |topic| topic.subscriptions);
            all.then_some(())
        },
    );
    let foreign: Vec<_> = observer
        .topics()
        .into_iter()
        .filter(|topic| topic.name.contains("lgvi_"))
        .collect();
    assert!(
        foreign.is_empty(),
        "topics under the default name: {foreign:?}"
    );
}

/// Waits for a line of the node's log under its new name.
#[track_caller]
fn logs(world: &World) {
    let observer = world.ros_node("listener");
    let rosout = observer
        .subscription::<Log>("/rosout", &Qos::latched(100))
        .unwrap();
    let name = eventually("a message on /rosout", || {
        Some(rosout.take().unwrap()?.message.name)
    });
    assert_eq!(name, "y.x");
}

#[test]
fn the_propagator() {
    let world = World::new();
    let scene = format!("scene:={}", scene("free_body").display());
    let remap = "~/invariants:=/truth/invariants";
    let arguments = ["-p", &scene, "-p", "real_time_factor:=0.0", "-r", remap];
    let propagator = renamed(&world, "lgvi_propagator", &arguments);
    let publishers = [
        "/y/x/state",
        "/y/x/odometry/body",
        "/y/x/scene",
        "/y/x/markers",
        "/y/x/flown_control",
        "/truth/invariants",
        "/tf",
    ];
    shows(&world, &publishers, &["/y/x/control_sequence"]);
    logs(&world);
    propagator.stop().expect(0);
}

#[test]
fn the_planner() {
    let world = World::new();
    let scene = format!("scene:={}", scene("inclination_change").display());
    let planner = renamed(&world, "lgvi_planner", &["-p", &scene]);
    shows(
        &world,
        &[
            "/y/x/control_sequence",
            "/y/x/progress",
            "/y/x/planned_path",
            "/y/x/markers",
        ],
        &[],
    );
    logs(&world);
    planner.stop().expect(0);
}

#[test]
fn the_recorder() {
    let world = World::new();
    let output = format!("output:={}", world.path("bag").display());
    let topics = "topics:=['odometry=nav_msgs/msg/Odometry', '/tf=tf2_msgs/msg/TFMessage']";
    let arguments = ["-p", &output, "-p", topics, "-r", "/tf:=/y/tf"];
    let recorder = renamed(&world, "lgvi_recorder", &arguments);
    shows(&world, &[], &["/y/odometry", "/y/tf"]);
    logs(&world);
    recorder.stop().expect(0);
}

#[test]
fn the_player() {
    let world = World::new();
    let (_, bag) = world.fly(&scene("free_body"), "flight");
    let bag = format!("bag:={}", bag.display());
    let mut arguments = vec!["-p", &bag, "-p", "await_subscribers:=1"];
    let remaps = ["state", "odometry/body", "scene", "markers", "invariants"]
        .map(|topic| format!("/lgvi_propagator/{topic}:=/replayed/{topic}"));
    arguments.extend(remaps.iter().flat_map(|remap| ["-r", remap]));
    let player = renamed(&world, "lgvi_player", &arguments);
    let publishers = [
        "/replayed/state",
        "/replayed/odometry/body",
        "/replayed/scene",
        "/replayed/markers",
        "/replayed/invariants",
        "/tf",
    ];
    shows(&world, &publishers, &[]);
    player.stop().expect(0);
}

#[test]
fn rules_for_topics_leave_services_alone_and_the_other_way_round() {
    let world = World::new();
    let scene = format!("scene:={}", scene("inclination_change").display());
    let arguments = [
        "-p",
        &scene,
        "-r",
        "rostopic://~/planned_path:=/seen/path",
        "-r",
        "rosservice://~/progress:=/wrong/progress",
        "-r",
        "other:~/control_sequence:=/wrong/controls",
        "-r",
        "x:~/control_sequence:=~/controls",
        "-r",
        "~/plan_maneuver/_action/feedback:=/act/feedback",
        "-r",
        "rosservice://~/plan_maneuver/_action/status:=/wrong/status",
    ];
    let planner = renamed(&world, "lgvi_planner", &arguments);
    let publishers = [
        "/seen/path",
        "/y/x/progress",
        "/y/x/controls",
        "/act/feedback",
        "/y/x/plan_maneuver/_action/status",
    ];
    shows(&world, &publishers, &[]);
    planner.stop().expect(0);
}

#[test]
fn an_action_is_renamed_as_a_whole() {
    let world = World::new();
    let scene = format!("scene:={}", scene("inclination_change").display());
    let arguments = [
        "-p",
        &scene,
        "-p",
        "plan_at_start:=false",
        "-r",
        "~/plan_maneuver:=/plan",
    ];
    let planner = renamed(&world, "lgvi_planner", &arguments);
    shows(
        &world,
        &["/plan/_action/feedback", "/plan/_action/status"],
        &[],
    );
    let client = world.ros_node("client");
    let client = client.action_client::<PlanManeuver>("/plan").unwrap();
    assert!(client.wait_for_server(Duration::from_secs(10)));
    planner.stop().expect(0);
}

#[test]
fn a_rule_outside_of_ros_arguments_counts_with_a_warning() {
    let world = World::new();
    let mut command = world.command(&binary("lgvi_recorder"));
    let output = format!("output:={}", world.path("bag").display());
    command.args(["--supervised", "/tf:=/y/tf", "__node:=x", "__ns:=/y"]);
    command.args([
        "--ros-args",
        "-p",
        &output,
        "-p",
        "topics:=['/tf=tf2_msgs/msg/TFMessage']",
    ]);
    let recorder = world.start("lgvi_recorder", command);
    shows(&world, &[], &["/y/tf"]);
    recorder
        .stop()
        .expect(0)
        .says(&["\"__node:=x\" stands outside of --ros-args", "deprecated"]);
}
