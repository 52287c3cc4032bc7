//! The launch files compose command lines with which the nodes' own programs work together.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path as FilePath, PathBuf};
use std::time::Duration;

use lgvi_middleware::ros::{Qos, TopicInfo};
use lgvi_msgs::msg::{Scene, SystemState};
use lgvi_msgs::nav_msgs::Path;
use lgvi_msgs::tf2_msgs::TFMessage;
use lgvi_msgs::visualization_msgs::MarkerArray;
use lgvi_tests::{Process, Recording, World, binary, root, scene, within};
use serde::Deserialize;
use serde_json::{Value, json};

const FILES: [&str; 3] = ["lgvi", "node", "replay"];

/// What a launch file is seen from outside.
#[derive(Deserialize)]
pub(crate) struct Launch {
    /// Names and descriptions.
    arguments: BTreeMap<String, String>,
    /// Command lines in the order of their start.
    pub(crate) commands: Vec<Vec<String>>,
    /// For each of them, what its parameter files say.
    parameters: Vec<Vec<Value>>,
}

/// What `launch` composes with a launch file, where `prefixes` are sourced.
#[track_caller]
pub(crate) fn composed_in(
    world: &World,
    file: &FilePath,
    arguments: &[&str],
    prefixes: &FilePath,
) -> Launch {
    let mut command = world.ros_command("compose_launch.py", &[]);
    command
        .env("AMENT_PREFIX_PATH", prefixes)
        .arg(file)
        .args(arguments);
    let composing = world.start("compose_launch.py", command);
    composing.finish().expect(0).json()
}

/// Composes with a launch file of the repository; it is not installed.
#[track_caller]
fn compose(world: &World, name: &str, arguments: &[&str]) -> Launch {
    composed_in(world, &file(name), arguments, FilePath::new("/"))
}

/// A launch file of the repository.
pub(crate) fn file(name: &str) -> PathBuf {
    root().join(format!("launch_scripts/{name}.launch.py"))
}

/// Starts what a launch file has composed, and waits until the flight of `inclination_change` has been flown.
pub(crate) fn fly(world: &World, commands: &[Vec<String>], propagator: &str) -> Vec<Process> {
    let observer = world.ros_node("observer");
    let topic = format!("{propagator}/state");
    let states = observer
        .subscription::<SystemState>(&topic, &Qos::latched(200))
        .unwrap();
    let nodes = commands
        .iter()
        .map(|command| start(world, command))
        .collect();
    within(Duration::from_secs(60), "the flight's last state", || {
        let sample = states.take().unwrap()?;
        (sample.message.step == 1000).then_some(())
    });
    nodes
}

/// A program with its path, or one that would be taken from the PATH.
fn start(world: &World, command: &[String]) -> Process {
    let program = FilePath::new(&command[0]);
    let mut process = if program.is_absolute() {
        world.command(program)
    } else {
        world.command(&binary(&command[0]))
    };
    process.args(&command[1..]);
    let name = program.file_name().unwrap().to_string_lossy();
    world.start(&name, process)
}

/// Tells the nodes to end, as `ros2 launch` does it when it is interrupted.
pub(crate) fn end(nodes: Vec<Process>) {
    // The recorder drains its sources when it is told to end; it is told first.
    for node in nodes {
        node.stop().expect(0);
    }
}

#[test]
fn a_flight_in_a_namespace_under_the_launch_file_is_recorded_whole() {
    let world = World::new();
    let bag = world.path("launched");
    let params = world.path("params.yaml");
    let section = "/**/lgvi_propagator: {ros__parameters: {real_time_factor: 0.0}}";
    fs::write(&params, section).unwrap();
    let launched = compose(
        &world,
        "lgvi",
        &[
            &format!("scene:={}", scene("inclination_change").display()),
            &format!("bag:={}", bag.display()),
            &format!("params_file:={}", params.display()),
            "namespace:=chaser",
            "log_level:=info",
        ],
    );
    assert_eq!(launched.commands.len(), 3, "{:?}", launched.commands);
    end(fly(&world, &launched.commands, "/chaser/lgvi_propagator"));

    let recording = Recording::read(&bag);
    let counts = recording.counts();
    for topic in [
        "/chaser/lgvi_propagator/scene",
        "/chaser/lgvi_propagator/flown_control",
        "/chaser/lgvi_propagator/invariants",
        "/chaser/lgvi_propagator/odometry/spacecraft",
        "/chaser/lgvi_planner/control_sequence",
        "/tf",
    ] {
        assert!(
            counts.contains_key(topic),
            "{topic} is not among {counts:?}"
        );
    }
    world.verify_agrees(&bag, 1001);
}

/// The frames of transforms: parent and child.
fn frames(message: &TFMessage) -> impl Iterator<Item = (&str, &str)> {
    let transforms = message.transforms.iter();
    transforms.map(|placed| {
        let (parent, child) = (&placed.header.frame_id, &placed.child_frame_id);
        (parent.as_str(), child.as_str())
    })
}

#[test]
fn two_flights_side_by_side_have_frames_and_bags_of_their_own() {
    const SHARED: [&str; 6] = [
        "/tf",
        "/tf_static",
        "/clock",
        "/diagnostics",
        "/rosout",
        "/parameter_events",
    ];
    let world = World::new();
    let params = world.path("params.yaml");
    let section = "/**/lgvi_propagator: {ros__parameters: {real_time_factor: 0.0}}";
    fs::write(&params, section).unwrap();
    let observer = world.ros_node("observer");
    let names = ["chaser", "target"];
    let flights = names.map(|name| {
        let arguments = [
            format!("scene:={}", scene("docking_corridor").display()),
            format!("bag:={}", world.path(name).display()),
            format!("params_file:={}", params.display()),
            format!("namespace:={name}"),
        ];
        let launched = compose(&world, "lgvi", &arguments.each_ref().map(String::as_str));
        let topic = format!("/{name}/lgvi_propagator/state");
        let states = observer
            .subscription::<SystemState>(&topic, &Qos::latched(400))
            .unwrap();
        let nodes: Vec<_> = launched
            .commands
            .iter()
            .map(|node| start(&world, node))
            .collect();
        (nodes, states)
    });
    let ended = flights.map(|(nodes, states)| {
        within(Duration::from_secs(90), "the flight's last state", || {
            let sample = states.take().unwrap()?;
            (sample.message.step == 300).then_some(())
        });
        nodes
    });
    // The flight waits for the recorder of its own topics only.
    for name in names {
        let path = format!("/{name}/lgvi_planner/planned_path");
        within(Duration::from_secs(30), "the recorder of the path", || {
            let topics = observer.topics();
            let recorded = |topic: &TopicInfo| topic.name == path && topic.subscriptions > 0;
            topics.iter().any(recorded).then_some(())
        });
    }
    for nodes in ended {
        end(nodes);
    }

    for name in names {
        let bag = world.path(name);
        let recording = Recording::read(&bag);
        let own = format!("/{name}/");
        for topic in recording.counts().keys() {
            let taken = topic.starts_with(&own) || SHARED.iter().any(|shared| topic == shared);
            assert!(taken, "{topic} is in the bag of {name}");
        }
        let inertial = format!("{name}/inertial");
        let pair =
            |parent: &str, child: &str| (format!("{name}/{parent}"), format!("{name}/{child}"));
        let has = |topic: &str, (parent, child): &(String, String)| {
            let messages = recording.messages::<TFMessage>(topic);
            let found = messages
                .iter()
                .flat_map(frames)
                .any(|pair| pair == (parent.as_str(), child.as_str()));
            assert!(found, "{topic} has no {child} on {parent}");
        };
        has("/tf", &pair("inertial", "chaser"));
        has("/tf_static", &pair("inertial", "port"));
        has("/tf_static", &pair("chaser", "probe"));
        for message in recording.messages::<TFMessage>("/tf") {
            assert!(
                frames(&message).all(|(parent, child)| parent.contains('/') && child.contains('/'))
            );
        }
        let state = format!("/{name}/lgvi_propagator/state");
        for state in recording.messages::<SystemState>(&state) {
            assert_eq!(state.header.frame_id, inertial);
        }
        let path = recording.messages::<Path>(&format!("/{name}/lgvi_planner/planned_path"));
        assert_eq!(path[0].header.frame_id, inertial);
        let markers =
            recording.messages::<MarkerArray>(&format!("/{name}/lgvi_propagator/markers"));
        assert_eq!(
            markers[0].markers[0].header.frame_id,
            format!("{name}/chaser")
        );
        world.verify_agrees(&bag, 301);
    }
}

#[test]
fn one_node_is_started_with_its_parameter_file_under_another_name() {
    let world = World::new();
    let params = world.path("params.yaml");
    let text = format!(
        "/**/other: {{ros__parameters: {{scene: {:?}}}}}",
        scene("free_body")
    );
    fs::write(&params, text).unwrap();
    let params = format!("params_file:={}", params.display());
    let arguments = ["node:=propagator", "name:=other", &params];
    let launched = compose(&world, "node", &arguments);
    let observer = world.ros_node("observer");
    let scenes = observer
        .subscription::<Scene>("/other/scene", &Qos::latched(1))
        .unwrap();
    let node = start(&world, &launched.commands[0]);
    within(
        Duration::from_secs(20),
        "the scene of the other node",
        || scenes.take().unwrap().map(|_| ()),
    );
    node.stop().expect(0);
}

/// A parameter file for a node.
fn parameters(node: &str, values: Value) -> Value {
    json!({node: {"ros__parameters": values}})
}

#[test]
fn arguments_become_parameters_of_their_types_and_those_left_out_do_not() {
    let world = World::new();
    let launched = compose(&world, "lgvi", &["scene:=1", "plan:=false"]);
    assert_eq!(
        launched.parameters,
        [[parameters("/lgvi_propagator", json!({"scene": "1"}))]]
    );

    let arguments = ["bag:=b", "rate:=0.5", "clock:=true", "autostart:=false"];
    let launched = compose(&world, "replay", &arguments);
    let expected = json!({"autostart": false, "bag": "b", "rate": 0.5, "clock": true});
    assert_eq!(
        launched.parameters,
        [[parameters("/lgvi_player", expected)]]
    );
}

#[test]
fn rviz_is_started_with_our_layout() {
    let world = World::new();
    let prefix = world.path("prefix");
    let index = prefix.join("share/ament_index/resource_index/packages");
    let program = prefix.join("lib/rviz2/rviz2");
    fs::create_dir_all(&index).unwrap();
    fs::write(index.join("rviz2"), "").unwrap();
    fs::create_dir_all(program.parent().unwrap()).unwrap();
    fs::write(&program, "").unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    let arguments = ["bag:=b", "rviz:=true"];
    let launched = composed_in(&world, &file("replay"), &arguments, &prefix);
    let [rviz, _player] = launched.commands.as_slice() else {
        panic!("{:?}", launched.commands);
    };
    assert_eq!(rviz[..2], [program.to_str().unwrap(), "-d"]);
    assert!(FilePath::new(&rviz[2]).is_file(), "{rviz:?}");
}

#[test]
fn every_argument_is_described_in_the_file_and_in_the_readme() {
    let world = World::new();
    let readme = fs::read_to_string(root().join("launch_scripts/README.md")).unwrap();
    for name in FILES {
        for (argument, description) in compose(&world, name, &[]).arguments {
            assert!(!description.is_empty(), "{name}: {argument}");
            assert!(
                readme.contains(&format!("| `{argument}` |")),
                "{name}: {argument} is not in the README's tables"
            );
        }
    }
}
