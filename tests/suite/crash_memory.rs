//! Shared memory that is full, or fills up.

use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::Path;
use std::process::Command;

use lgvi_middleware::shm::{Delivery, ShmError};
use lgvi_msgs::shm::{BodySample, StateHeader};
use lgvi_tests::{Process, Signal, Summary, World, edited, eventually, scene, with_disks};
use nix::sys::signal::kill;
use nix::unistd::Pid;

const SHARED: &str = "/dev/shm";

/// Gives the namespace shared memory of so many bytes.
#[track_caller]
fn limit(bytes: u64) {
    let size = format!("size={bytes}");
    let mut mount = Command::new("mount");
    mount.args(["-t", "tmpfs", "-o", &size, "tmpfs", SHARED]);
    assert!(mount.status().unwrap().success());
}

/// Takes all that is left of it.
#[track_caller]
fn fill() {
    let mut ballast = File::create(Path::new(SHARED).join("ballast")).unwrap();
    let filled = loop {
        if let Err(error) = ballast.write_all(&[1; 4096]) {
            break error;
        }
    };
    assert_eq!(filled.kind(), ErrorKind::StorageFull);
}

/// The flight ends with an error of shared memory.
#[track_caller]
fn fails(flight: Process, fragments: &[&str]) -> Summary {
    let summary: Summary = flight.finish().expect(1).json();
    let failure = summary.failure.as_ref().unwrap();
    for fragment in fragments {
        assert!(failure.message.contains(fragment), "{failure:?}");
    }
    summary
}

#[test]
fn a_flight_without_room_in_shared_memory_says_so() {
    let test = "crash_memory::a_flight_without_room_in_shared_memory_says_so";
    with_disks(test, || {
        limit(1 << 20);
        let world = World::new();
        let flight = world.start_flight(&scene("free_body"), "flight", &["--no-plot"]);
        let needed = "needs 8388608 bytes";
        fails(flight, &["/dev/shm is full", needed, "are free"]);
    });
}

/// While the recorder is stopped the propagator takes more memory with each state.
#[test]
fn a_flight_whose_shared_memory_is_filled_by_others_leaves_a_whole_bag() {
    let test = "crash_memory::a_flight_whose_shared_memory_is_filled_by_others_leaves_a_whole_bag";
    with_disks(test, || {
        limit(64 << 20);
        let world = World::new();
        let changes = [
            ("duration = 100.0", "duration = 1e6"),
            ("steps = 10000", "steps = 100000000"),
        ];
        let scene = edited(&world, "free_body", &changes);
        // Slow enough for the recorder to keep up, so that little memory has been taken.
        let arguments = ["--no-plot", "--real-time-factor", "10"];
        let flight = world.start_flight(&scene, "flight", &arguments);
        let bag = world.path("flight");
        eventually("chunks in the bag", || {
            let length = fs::metadata(bag.join("flight_0.mcap")).ok()?.len();
            (length > 10_000).then_some(())
        });
        let recorder = Pid::from_raw(world.find_process("node recorder").unwrap());
        kill(recorder, Signal::SIGSTOP).unwrap();
        fill();
        eventually("the end of the propagator", || {
            world
                .find_process("node propagator")
                .is_none()
                .then_some(())
        });
        kill(recorder, Signal::SIGCONT).unwrap();
        let summary = fails(
            flight,
            &[
                "propagator: ",
                "/dev/shm is full",
                "/state needs",
                "0 are free",
            ],
        );
        assert_eq!(summary.bag, Some(bag.clone()));
        let checked = world.lgvi(["info".as_ref(), bag.as_os_str(), "--check".as_ref()]);
        let checked = checked.finish().expect(0);
        assert!(checked.stdout.contains("complete"), "{}", checked.stdout);
    });
}

#[test]
fn a_state_that_shared_memory_has_no_room_for_is_an_error() {
    let test = "crash_memory::a_state_that_shared_memory_has_no_room_for_is_an_error";
    with_disks(test, || {
        limit(32 << 20);
        let world = World::new();
        let node = world.shm_node("publisher");
        let mut publisher = node
            .state_publisher("/state", 1, Delivery::DropNewest)
            .unwrap();
        let mut subscriber = node.state_subscriber("/state", 8192).unwrap();
        fill();
        let mut send = || publisher.send(StateHeader::default(), &[BodySample::default()]);
        send().unwrap();
        assert!(subscriber.receive().unwrap().is_some());
        // None is received, so that each takes memory of its own.
        let full = (0..8192).find_map(|_| send().err());
        assert!(matches!(full, Some(ShmError::Full { .. })), "{full:?}");
        // What is received makes room again.
        while subscriber.receive().unwrap().is_some() {}
        send().unwrap();
    });
}
