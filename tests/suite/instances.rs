//! Two nodes of one name.

use std::process::Command;

use lgvi_tests::{Process, Signal, World, assert_gone, await_node, binary, scene};

const NAME: &str = "/lgvi_propagator";

/// A propagator that waits for subscribers for ever.
fn propagator(world: &World) -> Process {
    let scene = format!("scene:={}", scene("free_body").display());
    world.node("propagator", &[&scene, "await_subscribers:=9"])
}

/// The same, on a host of its own: it shares no memory with the others.
fn propagator_elsewhere(world: &World, host: &str) -> Process {
    let mut command: Command = world.command(&binary("lgvi_propagator"));
    let root = world.path("shm").join(host);
    std::fs::create_dir_all(&root).unwrap();
    command
        .env("LGVI_SHM_ROOT", root)
        .args(["--supervised", "--ros-args"]);
    let scene = format!("scene:={}", scene("free_body").display());
    command.args(["-p", &scene, "-p", "await_subscribers:=9"]);
    world.start(host, command)
}

#[test]
fn on_one_host_the_second_is_refused_at_once_and_the_first_goes_on() {
    let world = World::new();
    let mut first = propagator(&world);
    first.await_ready();
    let process = format!("process {}", first.pid());
    let second = propagator(&world).finish().expect(2);
    second.says(&[
        NAME,
        "runs in domain",
        &process,
        "__node:=NAME",
        "__ns:=/NAMESPACE",
    ]);
    assert!(first.runs());
    first.stop().expect(0);
    assert_eq!(world.locks(), Vec::<std::path::PathBuf>::new());
}

#[test]
fn after_a_killed_one_the_next_starts_at_once() {
    let world = World::new();
    let first = propagator(&world);
    first.await_ready();
    first.signal(Signal::SIGKILL);
    assert_eq!(first.finish().code, None);
    let mut second = propagator(&world);
    second.await_ready();
    // By then it has discovered others: what is left of the first is not taken for a node.
    assert_eq!(world.operator("lgvi_propagator").state(), "active");
    assert!(second.runs());
    second.stop().expect(0);
}

#[test]
fn across_hosts_the_newcomer_ends_and_the_first_warns_and_goes_on() {
    let world = World::new();
    let observer = world.ros_node("observer");
    let mut first = propagator_elsewhere(&world, "first");
    first.await_ready();
    await_node(&observer, NAME);
    let second = propagator_elsewhere(&world, "second").finish().expect(2);
    second.says(&[
        NAME,
        "runs in domain",
        "participant",
        "127.0.0.1",
        "__node:=NAME",
    ]);
    first.await_stderr("another node named /lgvi_propagator has appeared");
    assert!(first.runs());
    first.stop().expect(0);
    assert_gone(&observer, NAME);
}

#[test]
fn of_two_that_start_at_once_one_goes_on() {
    let world = World::new();
    let mut both = [
        propagator_elsewhere(&world, "first"),
        propagator_elsewhere(&world, "second"),
    ];
    let ended = lgvi_tests::eventually("the end of one", || {
        both.iter_mut().position(|node| !node.runs())
    });
    let [first, second] = both;
    let (ended, mut other) = if ended == 0 {
        (first, second)
    } else {
        (second, first)
    };
    ended.finish().expect(2).says(&["runs in domain"]);
    assert!(other.runs());
    other.stop().expect(0);
}

/// Nodes of rclpy, rclcpp and others do not end: ours does, where it comes later.
#[test]
fn a_stranger_of_the_same_name_counts_too() {
    let world = World::new();
    let stranger = world.ros_node("lgvi_propagator");
    await_node(&world.ros_node("observer"), NAME);
    propagator(&world)
        .finish()
        .expect(2)
        .says(&["runs in domain"]);
    drop(stranger);
    let mut first = propagator(&world);
    first.await_ready();
    let _stranger = world.ros_node("lgvi_propagator");
    first.await_stderr("another node named");
    assert!(first.runs());
    first.stop().expect(0);
}
