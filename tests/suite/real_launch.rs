//! Flights and replays under `launch` itself, as `ros2 launch` runs it.

use std::env;
use std::os::unix::process::CommandExt;
use std::path::Path;

use lgvi_middleware::ros::Qos;
use lgvi_msgs::msg::SystemState;
use lgvi_tests::{Process, World, binary, eventually, scene};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::launch_file::file;

/// Launches a file of the repository, in a process group of its own; its programs are found on the PATH.
fn launch(world: &World, name: &str, arguments: &[&str]) -> Process {
    let programs = binary("lgvi").parent().unwrap().to_owned();
    let others = env::var_os("PATH").unwrap_or_default();
    let paths = [programs].into_iter().chain(env::split_paths(&others));
    let mut command = world.ros_command("ros2_launch.py", &[]);
    command
        .env("PATH", env::join_paths(paths).unwrap())
        .arg(file(name))
        .args(arguments)
        .process_group(0);
    world.start("ros2_launch.py", command)
}

/// Launches a recorded flight, and waits until it has been flown.
fn fly(world: &World, bag: &Path) -> Process {
    let observer = world.ros_node("observer");
    let states = observer
        .subscription::<SystemState>("/lgvi_propagator/state", &Qos::latched(200))
        .unwrap();
    let scene = format!("scene:={}", scene("inclination_change").display());
    let bag = format!("bag:={}", bag.display());
    let launched = launch(world, "lgvi", &[&scene, &bag, "real_time_factor:=0"]);
    eventually("the flight's last state", || {
        let sample = states.take().unwrap()?;
        (sample.message.step == 1000).then_some(())
    });
    launched
}

#[test]
fn a_launched_flight_that_is_interrupted_ends_with_code_0() {
    let world = World::new();
    let bag = world.path("flight");
    let launched = fly(&world, &bag);
    // As a terminal does it at Ctrl-C.
    kill(Pid::from_raw(-launched.pid()), Signal::SIGINT).unwrap();
    let printed = launched.finish().expect(0).stdout;
    assert!(
        printed.contains("user interrupted with ctrl-c"),
        "{printed}"
    );
    assert!(!printed.contains("[ERROR]"), "{printed}");
    world.verify_agrees(&bag, 1001);
}

#[test]
fn the_death_of_a_node_ends_the_launch_and_closes_the_bag() {
    let world = World::new();
    let bag = world.path("flight");
    let launched = fly(&world, &bag);
    let propagator = world.find_process("__node:=lgvi_propagator").unwrap();
    kill(Pid::from_raw(propagator), Signal::SIGKILL).unwrap();
    // `launch` reports a node's death, but takes what follows from it for an ordinary end.
    let printed = launched.finish().expect(0).stdout;
    for part in ["exit code -9", "shutting down launched system"] {
        assert!(printed.contains(part), "{part} is not in {printed}");
    }
    assert_eq!(printed.matches("process has died").count(), 1, "{printed}");
    world.verify_agrees(&bag, 1001);
}

#[test]
fn a_launched_replay_ends_with_its_player() {
    let world = World::new();
    let (_, bag) = world.fly(&scene("inclination_change"), "flight");
    let bag = format!("bag:={}", bag.display());
    let arguments = [bag.as_str(), "rate:=0", "await_subscribers:=0"];
    launch(&world, "replay", &arguments).finish().expect(0);
}

#[test]
fn unusable_arguments_are_refused() {
    let world = World::new();
    for (name, arguments, expected) in [
        ("lgvi", &["bag:=b"][..], "missing required argument 'scene'"),
        ("lgvi", &["scene:=s", "plan:=maybe"], "maybe"),
        (
            "lgvi",
            &["scene:=s", "params_file:=/nowhere.yaml"],
            "/nowhere.yaml",
        ),
        ("node", &["node:=pilot"], "pilot"),
        ("replay", &["bag:=b", "autostart:=perhaps"], "perhaps"),
    ] {
        let printed = launch(&world, name, arguments).finish().expect(1).stdout;
        assert!(printed.contains(expected), "{printed}");
    }
}
