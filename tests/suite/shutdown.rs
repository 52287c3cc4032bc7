//! Ends before the end: by the user, and by force.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use lgvi_tests::{Process, Recording, Signal, Summary, World, eventually, scene, within};
use nix::sys::signal::kill;
use nix::unistd::Pid;

const STATE: &str = "/lgvi_propagator/state";

/// How long the nodes have to end when `lgvi run` has been killed.
const FAREWELL: Duration = Duration::from_secs(5);

/// A flight that would last 18 s, on its way.
fn flight_under_way(world: &World) -> Process {
    let arguments = ["--real-time-factor", "0.05"];
    let flight = world.start_flight(&scene("inclination_change"), "flight", &arguments);
    world.await_step(30);
    assert_eq!(world.processes().len(), 4, "{:?}", world.processes());
    assert_ne!(
        world.shared_memory(),
        Vec::<PathBuf>::new(),
        "shared memory is elsewhere"
    );
    flight
}

/// The bag is closed, readable, and its states are those of the flight so far.
#[track_caller]
fn holds_part_of_a_flight(world: &World, bag: &Path) -> u64 {
    assert!(bag.join("metadata.yaml").exists(), "the bag is not closed");
    let states = Recording::read(bag).on(STATE).count() as u64;
    assert!((30..1001).contains(&states), "{states} states");
    world.verify_agrees(bag, states);
    states
}

#[test]
fn ctrl_c_ends_a_flight_in_order() {
    ends_a_flight_in_order(Signal::SIGINT);
}

#[test]
fn a_terminal_that_is_closed_ends_a_flight_in_order() {
    ends_a_flight_in_order(Signal::SIGHUP);
}

#[track_caller]
fn ends_a_flight_in_order(signal: Signal) {
    let world = World::new();
    let flight = flight_under_way(&world);
    flight.signal(signal);
    let finished = flight.finish().expect(130);
    assert_eq!(world.processes(), []);
    assert_eq!(world.shared_memory(), Vec::<PathBuf>::new());
    let summary: Summary = finished.json();
    let states = holds_part_of_a_flight(&world, &world.path("flight"));
    assert_eq!((summary.recorded[STATE], summary.lost), (states, Some(0)));
    assert_eq!(summary.lost_unknown, None);
    assert_eq!(summary.bag, Some(world.path("flight")));
}

#[test]
fn nodes_whose_lgvi_run_was_killed_close_the_bag_and_end() {
    let world = World::new();
    let flight = flight_under_way(&world);
    flight.signal(Signal::SIGKILL);
    within(FAREWELL, "the end of all nodes", || {
        // The killed process is a zombie, and gone from here, until it is waited for.
        world.processes().is_empty().then_some(())
    });
    assert_eq!(flight.finish().code, None);
    assert_eq!(world.shared_memory(), Vec::<PathBuf>::new());
    holds_part_of_a_flight(&world, &world.path("flight"));
}

/// Kills one node of a flight under way; `lgvi run` must say which, end the others and fail.
#[track_caller]
fn kill_in_flight(world: &World, node: &str) -> Summary {
    let flight = flight_under_way(world);
    if node == "planner" {
        // By then the plan has been acknowledged, and the planner has said so, however busy the machine.
        world.await_step(300);
    }
    let pid = world.find_process(&format!("node {node}")).unwrap();
    kill(Pid::from_raw(pid), Signal::SIGKILL).unwrap();
    let summary: Summary = flight.finish().expect(1).json();
    let message = &summary.failure.as_ref().unwrap().message;
    let hint = match node {
        "recorder" => format!(
            "; what was recorded can be got back with lgvi recover {}",
            world.path("flight").display()
        ),
        _ => String::new(),
    };
    assert_eq!(
        *message,
        format!("{node}: ended before the flight was over: killed by SIGKILL{hint}")
    );
    assert_eq!(world.processes(), []);
    summary
}

#[track_caller]
fn does_not_know_what_was_lost(summary: &Summary, why: &str) {
    assert_eq!(summary.lost, None);
    assert_eq!(summary.lost_unknown.as_deref(), Some(why));
}

#[test]
fn a_killed_propagator_or_planner_is_named_and_the_bag_is_closed() {
    for node in ["propagator", "planner"] {
        let world = World::new();
        let summary = kill_in_flight(&world, node);
        assert_eq!(summary.bag, Some(world.path("flight")));
        if node == "propagator" {
            let why = "the propagator has not said what it published";
            does_not_know_what_was_lost(&summary, why);
        } else {
            // It had published its plan, and said so.
            assert_eq!(summary.lost, Some(0));
        }
        holds_part_of_a_flight(&world, &world.path("flight"));
    }
}

#[test]
fn a_killed_recorder_is_named_and_there_is_no_bag_to_be_taken_for_one() {
    let world = World::new();
    let summary = kill_in_flight(&world, "recorder");
    assert_eq!(summary.bag, None);
    does_not_know_what_was_lost(&summary, "the recorder has not closed the bag");
    let bag = world.path("flight");
    let verdict = world.lgvi(["verify".as_ref(), bag.as_os_str()]).finish();
    verdict
        .expect(2)
        .says(&[bag.to_str().unwrap(), "truncated"]);
}

#[test]
fn a_flight_after_a_killed_one_finds_its_place_clean() {
    let world = World::new();
    kill_in_flight(&world, "propagator");
    world.fly(&scene("free_body"), "next");
    assert_eq!(world.shared_memory(), Vec::<PathBuf>::new());
}

#[test]
fn every_node_ends_on_every_signal() {
    let world = World::new();
    for signal in [Signal::SIGINT, Signal::SIGTERM, Signal::SIGHUP] {
        let output = format!("output:={}", world.path(signal.as_str()).display());
        let scene = format!("scene:={}", scene("inclination_change").display());
        let nodes = [
            world.node("recorder", &[&output]),
            world.node("propagator", &[&scene, "await_subscribers:=2"]),
            world.node("planner", &[&scene]),
        ];
        for node in &nodes {
            node.await_ready();
        }
        for node in nodes {
            node.signal(signal);
            node.finish().expect(0);
        }
        let bag = format!("bag:={}", world.path(signal.as_str()).display());
        let player = world.node("player", &[&bag, "await_subscribers:=9"]);
        player.await_ready();
        player.signal(signal);
        player.finish().expect(0);
    }
    eventually("nothing in shared memory", || {
        world.shared_memory().is_empty().then_some(())
    });
}

/// As `nohup` starts it.
#[test]
fn a_hangup_that_is_ignored_stays_so() {
    let world = World::new();
    let bag = world.path("bag");
    let mut command = world.command(Path::new("sh"));
    let recorder = lgvi_tests::binary("lgvi_recorder");
    command
        .args(["-c", "trap '' HUP; exec \"$@\"", "sh"])
        .arg(recorder)
        .args(["--supervised", "--ros-args", "-p"])
        .arg(format!("output:={}", bag.display()));
    let recorder = world.start("recorder", command);
    recorder.await_ready();
    let status = fs::read_to_string(format!("/proc/{}/status", recorder.pid())).unwrap();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = u64::from_str_radix(ignored.unwrap().trim(), 16).unwrap();
    assert_eq!(ignored >> (Signal::SIGHUP as u32 - 1) & 1, 1, "{status}");
    recorder.signal(Signal::SIGHUP);
    recorder.stop().expect(0);
    assert!(bag.join("metadata.yaml").exists());
}
