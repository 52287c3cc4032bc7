//! Simulated time: flights that give it, and flights that follow it.

use std::path::Path;
use std::thread;
use std::time::Duration;

use lgvi_middleware::ros::{Qos, RosNode, ServiceClient, Subscription};
use lgvi_msgs::nav_msgs::Odometry;
use lgvi_msgs::rosgraph_msgs::Clock;
use lgvi_msgs::stamp;
use lgvi_msgs::std_srvs::srv::{SetBool, SetBoolRequest};
use lgvi_tests::{PATIENCE, Process, Recording, World, binary, edited, eventually, root};

/// The epoch of scenes that name none (ns since the UNIX epoch).
const J2000: i64 = 946_728_000_000_000_000;

/// In nanoseconds.
const MILLISECOND: i64 = 1_000_000;

/// A step of the flights.
const STEP: i64 = 10 * MILLISECOND;

/// Where a flight is for twenty steps it rests.
const HOLD: Duration = Duration::from_millis(200);

/// A body whose state goes out at each of its steps.
fn free_body(world: &World) -> String {
    let scene = edited(world, "free_body", &[("ros_every = 100", "ros_every = 1")]);
    parameter("scene", &scene)
}

fn parameter(name: &str, path: &Path) -> String {
    format!("{name}:={}", path.display())
}

/// A propagator of another name.
fn propagator(world: &World, name: &str, arguments: &[&str]) -> Process {
    let mut command = world.command(&binary("lgvi_propagator"));
    command.args(["--supervised", "--ros-args", "-r"]);
    command.arg(format!("__node:={name}")).args(arguments);
    let propagator = world.start(name, command);
    propagator.await_ready();
    propagator
}

/// Where a flight is.
struct Watch {
    odometry: Subscription<Odometry>,
    time: i64,
}

impl Watch {
    fn new(observer: &RosNode, propagator: &str) -> Self {
        let topic = format!("/{propagator}/odometry/body");
        let odometry = observer.subscription(&topic, &Qos::reliable(1000)).unwrap();
        assert!(odometry.wait_for_publishers(1, PATIENCE));
        Self { odometry, time: 0 }
    }

    /// Simulated time since the epoch (ns).
    fn now(&mut self) -> i64 {
        while let Some(sample) = self.odometry.take().unwrap() {
            self.time = stamp::from_message(&sample.message.header.stamp).unwrap() - J2000;
        }
        self.time
    }

    /// Waits until the flight is past a time.
    #[track_caller]
    fn await_past(&mut self, time: i64) {
        let awaited = format!("{} ns of {}", time, self.odometry.topic());
        eventually(&awaited, || (self.now() > time).then_some(()));
    }

    /// Waits until the flight is at a time, and stays there.
    #[track_caller]
    fn await_rest(&mut self, time: i64) {
        let awaited = format!("{} at {time} ns", self.odometry.topic());
        eventually(&awaited, || (self.now() == time).then_some(()));
        thread::sleep(HOLD);
        assert_eq!(self.now(), time, "{awaited}");
    }
}

/// Pauses a flight, or has it go on; its simulated time then (ns).
fn pause(client: &ServiceClient<SetBool>, data: bool) -> i64 {
    let answer = client.call(&SetBoolRequest { data }, PATIENCE).unwrap();
    assert!(answer.success, "{}", answer.message);
    let words = answer.message.split_whitespace();
    let step: i64 = words.last().unwrap().parse().unwrap();
    step * STEP
}

#[test]
fn a_flight_keeps_step_with_another_ones_time_and_stops_with_it() {
    let world = World::new();
    let scene = free_body(&world);
    let source = propagator(&world, "source", &["-p", &scene, "-p", "clock:=true"]);
    let arguments = [
        "-p",
        &scene,
        "-p",
        "use_sim_time:=true",
        "-r",
        "__ns:=/other",
    ];
    let follower = propagator(&world, "follower", &arguments);
    let observer = world.ros_node("observer");
    let mut ahead = Watch::new(&observer, "source");
    let mut behind = Watch::new(&observer, "other/follower");
    ahead.await_past(0);
    behind.await_past(0);
    let client = observer.service_client("/source/pause").unwrap();
    for _ in 0..2 {
        let stopped = pause(&client, true);
        ahead.await_rest(stopped);
        behind.await_rest(stopped);
        pause(&client, false);
        ahead.await_past(stopped + 200 * MILLISECOND);
        behind.await_past(stopped + 200 * MILLISECOND);
    }
    follower.stop().expect(0);
    source.stop().expect(0);
}

#[test]
fn a_replayed_flights_time_leads_another_flight_through_the_same_states() {
    let world = World::new();
    let origin = root().join("bags/inclination_change");
    let copy = world.path("copy");
    let output = parameter("output", &copy);
    let topics = "topics:=[/follower/scene=lgvi_msgs/msg/Scene, \
                  /follower/flown_control=lgvi_msgs/msg/ControlSequence]";
    let states = "states:=[/follower/state]";
    let recorder = world.node("recorder", &[&output, topics, states, "log_time:=stamp"]);
    recorder.await_ready();
    let scene = parameter("scene", &lgvi_tests::scene("inclination_change"));
    let controls = "~/control_sequence:=/lgvi_propagator/flown_control";
    let arguments = ["-p", &scene, "-p", "use_sim_time:=true", "-r", controls];
    let follower = propagator(&world, "follower", &arguments);
    let observer = world.ros_node("observer");
    let flown = "/follower/flown_control";
    let flown = observer.subscription::<lgvi_msgs::msg::ControlSequence>(flown, &Qos::latched(1));
    assert!(flown.unwrap().wait_for_publishers(1, PATIENCE));

    let bag = parameter("bag", &origin);
    let player = world.node("player", &[&bag, "clock:=true", "rate:=0.5"]);
    let report = follower.await_flown();
    assert_eq!(report.steps, 1000);
    assert!(report.seconds > 1.0, "{} s of 1.8 s", report.seconds);
    player.finish().expect(0);
    follower.stop().expect(0);
    recorder.stop().expect(0);
    world.verify_agrees(&copy, 1001);
    let states = |bag: &Path, topic| -> Vec<lgvi_msgs::msg::SystemState> {
        Recording::read(bag).messages(topic)
    };
    let (first, second) = (
        states(&origin, "/lgvi_propagator/state"),
        states(&copy, "/follower/state"),
    );
    assert!(first.iter().zip(&second).all(|(a, b)| a.bodies == b.bodies));
}

#[test]
fn a_ros_2_node_has_the_flights_time() {
    let world = World::new();
    let scene = free_body(&world);
    let source = propagator(&world, "source", &["-p", &scene, "-p", "clock:=true"]);
    let observer = world.ros_node("observer");
    let mut flight = Watch::new(&observer, "source");
    let peer = world.ros_python("ros2_clock_peer.py", &[]);
    let client = observer.service_client("/source/pause").unwrap();
    eventually("the time of the peer", || {
        (peer.stdout().lines().count() >= 20).then_some(())
    });
    let stopped = pause(&client, true);
    flight.await_rest(stopped);
    let latest = || {
        let time: i64 = peer.stdout().lines().last()?.parse().ok()?;
        Some(time - J2000)
    };
    eventually("the time of the pause", || {
        (latest() == Some(stopped)).then_some(())
    });
    // One that comes late to a paused flight is told the time too.
    let late = world.ros_python("ros2_clock_peer.py", &[]);
    let paused = (J2000 + stopped).to_string();
    eventually("the time of the latecomer", || {
        (late.stdout().lines().last() == Some(&paused)).then_some(())
    });
    drop((peer, late));
    source.stop().expect(0);
}

#[test]
fn a_flight_follows_a_strangers_time_and_outlives_it_going_back() {
    let world = World::new();
    let scene = free_body(&world);
    let follower = propagator(
        &world,
        "follower",
        &["-p", &scene, "-p", "use_sim_time:=true"],
    );
    follower.await_stderr("waiting for /clock");
    let observer = world.ros_node("observer");
    let mut flight = Watch::new(&observer, "follower");
    let mut stranger = world.python("cyclone_clock_peer.py", &[]);
    stranger.await_stderr("matched");
    let mut tell = |time: i64| stranger.tell(&(J2000 + time).to_string());
    tell(505 * MILLISECOND);
    flight.await_rest(500 * MILLISECOND);
    tell(100 * MILLISECOND);
    follower.await_stderr("/clock jumped back by 0.405 s to 946728000.1 s");
    let client = observer.service_client("/follower/pause").unwrap();
    pause(&client, true);
    pause(&client, false);
    flight.await_rest(500 * MILLISECOND);
    tell(700 * MILLISECOND);
    flight.await_rest(700 * MILLISECOND);
    tell(0);
    follower.stop().expect(0);
}

#[test]
fn the_end_of_a_flight_is_the_last_that_is_told_of_its_time() {
    let world = World::new();
    let observer = world.ros_node("observer");
    let clock = observer
        .subscription::<Clock>("/clock", &Qos::sensor(10_000))
        .unwrap();
    let scene = parameter("scene", &lgvi_tests::scene("free_body"));
    let arguments = [
        "-p",
        &scene,
        "-p",
        "clock:=true",
        "-p",
        "real_time_factor:=40.0",
    ];
    let source = propagator(&world, "source", &arguments);
    source.await_flown();
    source.stop().expect(0);
    let times: Vec<i64> = std::iter::from_fn(|| clock.take().unwrap())
        .map(|sample| stamp::from_message(&sample.message.clock).unwrap() - J2000)
        .collect();
    assert!(times.windows(2).all(|pair| pair[0] <= pair[1]), "{times:?}");
    assert_eq!(times.last(), Some(&(100_000 * MILLISECOND)), "{times:?}");
    // At most every 10 ms of 2.5 s.
    assert!((10..=251).contains(&times.len()), "{}", times.len());
}

#[test]
fn a_node_that_would_follow_itself_is_refused() {
    let world = World::new();
    let scene = parameter("scene", &lgvi_tests::scene("free_body"));
    let bag = parameter("bag", &root().join("bags/inclination_change"));
    for (kind, own) in [("propagator", &scene), ("player", &bag)] {
        let node = world.node(kind, &[own, "clock:=true", "use_sim_time:=true"]);
        let refused = node.finish().expect(2);
        refused.says(&["\"clock\" and \"use_sim_time\" are both true, expected one at most"]);
    }
}
