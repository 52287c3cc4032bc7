//! The player does what its options and services say.

use std::time::{Duration, Instant};

use lgvi_bag::{Durability, Qos as Recorded, Topic};
use lgvi_middleware::ros::{Qos, Subscription};
use lgvi_msgs::builtin_interfaces::{self, Time};
use lgvi_msgs::msg::{BodyState, SystemState};
use lgvi_msgs::rosbag2_interfaces::srv::{
    Burst, BurstRequest, GetRate, GetRateRequest, IsPaused, IsPausedRequest, Pause, PauseRequest,
    PlayNext, PlayNextRequest, Resume, ResumeRequest, Seek, SeekRequest, SetRate, SetRateRequest,
    Stop, StopRequest, TogglePaused, TogglePausedRequest,
};
use lgvi_msgs::rosgraph_msgs::Clock;
use lgvi_msgs::std_msgs::Header;
use lgvi_msgs::{RosMessage, cdr, stamp};
use lgvi_tests::{Operator, Record, Recording, World, eventually};

/// What is counted, in `sec`.
type Number = builtin_interfaces::Duration;

/// When the bags begin (ns).
const START: u64 = 1_000_000_000_000_000_000;

/// Messages of `/numbers`, from 0 on.
const COUNT: i32 = 100;

/// Between two of them (ns).
const STEP: u64 = 10_000_000;

fn topic(name: &str, durability: Durability) -> Topic {
    Topic {
        name: name.into(),
        type_name: Number::TYPE_NAME.into(),
        type_hash: Number::TYPE_HASH.into(),
        definition: Number::DEFINITION.into(),
        definition_encoding: lgvi_bag::ROS2MSG.into(),
        qos: Recorded {
            durability,
            depth: 1,
            ..Recorded::default()
        },
    }
}

fn record(topic: &str, number: i32, step: u64) -> Record {
    let message = Number {
        sec: number,
        nanosec: 0,
    };
    let time = START + u64::try_from(number).unwrap() * step;
    Record {
        topic: topic.into(),
        log_time: time,
        publish_time: time,
        sequence: 0,
        data: cdr::encode(&message).unwrap(),
    }
}

/// Numbers every so many nanoseconds; `/latched` has 0 and 40.
fn numbers(step: u64) -> Recording {
    let mut records = Vec::new();
    for number in 0..COUNT {
        if [0, 40].contains(&number) {
            records.push(record("/latched", number, step));
        }
        records.push(record("/numbers", number, step));
    }
    Recording {
        topics: vec![
            topic("/numbers", Durability::Volatile),
            topic("/latched", Durability::TransientLocal),
        ],
        records,
    }
}

/// A bag of numbers, and who listens to it.
struct Listener {
    world: World,
    bag: String,
    numbers: Subscription<Number>,
    latched: Subscription<Number>,
    clock: Subscription<Clock>,
}

impl Listener {
    #[track_caller]
    fn new(world: World, bag: &Recording, numbers: &str) -> Self {
        let path = world.path("bag");
        bag.write(&path);
        let observer = world.ros_node("observer");
        let qos = Qos::latched(5000);
        Self {
            bag: path.to_str().unwrap().into(),
            numbers: observer.subscription(numbers, &qos).unwrap(),
            latched: observer.subscription("/latched", &qos).unwrap(),
            clock: observer.subscription("/clock", &qos).unwrap(),
            world,
        }
    }

    /// `lgvi play` with options, to its end.
    fn play(&self, options: &[&str]) {
        let line = ["play", &self.bag, "--await-subscribers", "1"];
        let line = line.into_iter().chain(options.iter().copied());
        self.world.lgvi(line).finish().expect(0);
    }

    fn numbers(&self) -> Vec<i32> {
        taken(&self.numbers)
    }

    fn latched(&self) -> Vec<i32> {
        taken(&self.latched)
    }

    /// Times on `/clock` since the start (ms), without what a pause repeats.
    fn clock(&self) -> Vec<i64> {
        let mut times: Vec<i64> = std::iter::from_fn(|| self.clock.take().unwrap())
            .map(|sample| {
                let time = stamp::from_message(&sample.message.clock).unwrap();
                (time - i64::try_from(START).unwrap()) / 1_000_000
            })
            .collect();
        times.dedup();
        times
    }
}

fn taken(subscription: &Subscription<Number>) -> Vec<i32> {
    std::iter::from_fn(|| subscription.take().unwrap())
        .map(|sample| sample.message.sec)
        .collect()
}

fn burst(player: &Operator, num_messages: u64) -> u64 {
    let request = BurstRequest { num_messages };
    player.call::<Burst>("burst", &request).actually_burst
}

fn play_next(player: &Operator) -> bool {
    let request = PlayNextRequest::default();
    player.call::<PlayNext>("play_next", &request).success
}

fn seek(player: &Operator, milliseconds: i64) -> bool {
    let time = i64::try_from(START).unwrap() + milliseconds * 1_000_000;
    let time: Time = stamp::to_message(time).unwrap();
    player.call::<Seek>("seek", &SeekRequest { time }).success
}

fn is_paused(player: &Operator) -> bool {
    let request = IsPausedRequest::default();
    player.call::<IsPaused>("is_paused", &request).paused
}

fn set_rate(player: &Operator, rate: f64) -> bool {
    let request = SetRateRequest { rate };
    player.call::<SetRate>("set_rate", &request).success
}

fn rate(player: &Operator) -> f64 {
    let request = GetRateRequest::default();
    player.call::<GetRate>("get_rate", &request).rate
}

#[test]
fn range_topics_and_remapping_choose_exactly_the_messages() {
    let listener = Listener::new(World::new(), &numbers(STEP), "/counted");
    let remap = ["--rate", "0", "--remap", "/numbers:=/counted"];
    let play = |options: &[&str]| listener.play(&[&remap, options].concat());

    play(&["--start-offset", "0.2", "--duration", "0.3"]);
    assert_eq!(listener.numbers(), Vec::from_iter(20..=50));
    assert_eq!(listener.latched(), [0, 40], "0 is from before the range");

    play(&["--until", "0.105", "--topics", "/numbers"]);
    assert_eq!(listener.numbers(), Vec::from_iter(0..=10));
    assert!(listener.latched().is_empty());

    play(&["--start-offset", "0.9", "--exclude-regex", "^/latch"]);
    assert_eq!(listener.numbers(), Vec::from_iter(90..COUNT));

    play(&["--regex", "hed$", "--topics", "/nothing"]);
    assert_eq!(listener.latched(), [0, 40]);
    assert!(listener.numbers().is_empty());
    assert!(listener.clock().is_empty(), "nobody has asked for /clock");
}

#[test]
fn a_paused_replay_is_led_step_by_step_to_and_fro() {
    let listener = Listener::new(World::new(), &numbers(STEP), "/numbers");
    let bag = format!("bag:={}", listener.bag);
    let parameters = [
        &bag,
        "start_paused:=true",
        "clock:=true",
        "await_subscribers:=1",
    ];
    let process = listener.world.node("player", &parameters);
    process.await_ready();
    let player = listener.world.operator("lgvi_player");

    assert!(is_paused(&player));
    eventually("the first messages", || {
        (burst(&player, 3) == 3).then_some(())
    });
    assert!(play_next(&player));
    assert!(seek(&player, 500) && play_next(&player));
    assert!(seek(&player, 100) && play_next(&player));
    assert!(!seek(&player, 1000), "that is after the end");
    assert!(play_next(&player));
    assert!(seek(&player, -5000), "that is the start");
    assert_eq!(burst(&player, 0), 102, "all: with the latched ones");
    assert_eq!(burst(&player, 1), 0, "that is the end");
    assert!(seek(&player, 980));
    assert_eq!(rate(&player), 1.0);
    assert!(!set_rate(&player, 0.0) && !set_rate(&player, -1.0) && !set_rate(&player, f64::NAN));
    assert!(set_rate(&player, 1000.0));
    assert_eq!(rate(&player), 1000.0);
    player.call::<TogglePaused>("toggle_paused", &TogglePausedRequest::default());
    process.finish().expect(0);

    // A burst of three has the latched one, too.
    let mut expected = vec![0, 1, 2, 50, 10, 11];
    expected.extend(0..COUNT);
    expected.extend([98, 99]);
    assert_eq!(listener.numbers(), expected);
    assert_eq!(listener.latched(), [0, 40, 0, 0, 40, 40]);
    let mut expected = vec![0, 10, 20, 500, 100, 110];
    expected.extend((0..COUNT).map(|number| i64::from(number) * 10));
    expected.extend([980, 990]);
    assert_eq!(listener.clock(), expected);
}

#[test]
fn a_loop_plays_everything_again_until_it_is_stopped() {
    let listener = Listener::new(World::new(), &numbers(STEP), "/numbers");
    let bag = format!("bag:={}", listener.bag);
    let parameters = [
        &bag,
        "loop:=true",
        "clock:=true",
        "rate:=5",
        "await_subscribers:=1",
    ];
    let process = listener.world.node("player", &parameters);
    let player = listener.world.operator("lgvi_player");
    let mut found = Vec::new();
    eventually("two rounds", || {
        found.extend(listener.numbers());
        (found.len() > 2 * COUNT as usize).then_some(())
    });
    player.call::<Pause>("pause", &PauseRequest::default());
    assert!(is_paused(&player));
    player.call::<Resume>("resume", &ResumeRequest::default());
    player.call::<Stop>("stop", &StopRequest::default());
    process.finish().expect(0);

    let round = 0..COUNT;
    let expected: Vec<i32> = round.clone().chain(round).chain([0]).collect();
    assert_eq!(found[..=2 * COUNT as usize], expected);
    assert_eq!(listener.latched()[..4], [0, 40, 0, 40]);
    let clock = listener.clock();
    let rounds: Vec<&[i64]> = clock.split_inclusive(|&time| time == 990).collect();
    for round in &rounds[..2] {
        assert_eq!(round[0], 0, "{clock:?}");
        assert_eq!(round.last(), Some(&990), "{clock:?}");
        assert!(round.is_sorted(), "{clock:?}");
    }
}

#[test]
fn the_rate_is_followed() {
    // An hour and a half in a tenth of a second.
    let listener = Listener::new(World::new(), &numbers(60_000_000_000), "/numbers");
    listener.play(&["--rate", "60000"]);
    assert_eq!(listener.numbers(), Vec::from_iter(0..COUNT));

    let listener = Listener::new(World::new(), &numbers(STEP), "/numbers");
    let start = Instant::now();
    listener.play(&["--rate", "0.5", "--clock", "--clock-frequency", "400"]);
    assert!(start.elapsed() >= Duration::from_millis(1980));
    assert_eq!(listener.numbers(), Vec::from_iter(0..COUNT));
    let clock = listener.clock();
    assert!(
        clock.is_sorted() && clock.iter().any(|time| time % 10 != 0),
        "it goes on between messages: {clock:?}"
    );
    assert_eq!((clock[0], clock.last()), (0, Some(&990)));
}

#[test]
fn what_cannot_be_played_is_refused_or_named() {
    let world = World::new();
    let refused = |name: &str, bag: &Recording, options: &[&str], code, fragments: &[&str]| {
        let path = world.path(name);
        bag.write(&path);
        let line = ["play", path.to_str().unwrap(), "--rate", "0"];
        let line = line.into_iter().chain(options.iter().copied());
        world.lgvi(line).finish().expect(code).says(fragments);
    };
    let whole = numbers(STEP);
    refused(
        "a",
        &whole,
        &["--topics", "/nothing"],
        2,
        &[
            "/nothing: not in the bag",
            "none of the bag's topics",
            "/numbers, /latched",
        ],
    );
    refused(
        "b",
        &whole,
        &["--start-offset", "5"],
        2,
        &["start_offset is 5 s"],
    );
    refused(
        "c",
        &whole,
        &["--regex", "a("],
        2,
        &["regex", "unclosed group"],
    );
    refused(
        "d",
        &whole,
        &["--remap", "numbers"],
        2,
        &["numbers", "from:=to"],
    );

    let mut renamed = numbers(STEP);
    renamed.topics[0].name = "/no name".into();
    for record in &mut renamed.records {
        record.topic = record.topic.replace("numbers", "no name");
    }
    refused("e", &renamed, &[], 0, &["/no name is left out"]);
    let only = ["--topics", "/no name"];
    let nothing = [
        "/no name is left out",
        "none of the bag's topics can be played",
    ];
    refused("f", &renamed, &only, 2, &nothing);

    let mut untyped = numbers(STEP);
    untyped.topics[0].type_name = "Number".into();
    refused("g", &untyped, &[], 0, &["/numbers is left out", "Number"]);

    let mut timed = numbers(STEP);
    timed.topics[0].name = "/clock".into();
    for record in &mut timed.records {
        record.topic = record.topic.replace("numbers", "clock");
    }
    refused(
        "h",
        &timed,
        &["--clock"],
        0,
        &["/clock of the bag is not played"],
    );

    let mut late = numbers(STEP);
    let last = (1 << 31) * 1_000_000_000 - 1;
    late.records.last_mut().unwrap().log_time = last;
    refused("i", &late, &["--clock"], 0, &[]);
    late.records.last_mut().unwrap().log_time = last + 1;
    let named = [
        "/numbers at 2147483648000000000 ns",
        "/clock takes times up to",
    ];
    refused("j", &late, &["--clock"], 2, &named);
    refused("k", &late, &[], 0, &[]);
    refused("l", &late, &["--clock", "--duration", "1"], 0, &[]);
}

#[test]
fn a_strangers_bag_of_a_strangers_type_is_played_to_a_stranger() {
    let world = World::new();
    let bag = world.path("foreign");
    let path = bag.to_str().unwrap();
    let writer = world.python("foreign_bag.py", &["write", path, "200"]);
    writer.finish().expect(0);
    let listener = world.python("foreign_bag.py", &["listen", "/readings", "200"]);
    let line = [
        "play",
        path,
        "--rate",
        "0",
        "--await-subscribers",
        "1",
        "--remap",
        "/robot/readings:=/readings",
    ];
    let player = world.lgvi(line);
    let heard = listener.finish().expect(0).stdout;
    player.finish().expect(0);
    let heard: Vec<serde_json::Value> = heard
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let thirds = |count: u64| (0..count).map(|third| third as f64 / 3.0);
    let expected: Vec<serde_json::Value> = (0..200)
        .map(|number| {
            let values: Vec<f64> = thirds(number % 4).collect();
            serde_json::json!({"number": number, "unit": "m/s", "values": values})
        })
        .collect();
    assert_eq!(heard, expected);
}

#[test]
fn ros_2_leads_the_player_as_it_leads_its_own() {
    let listener = Listener::new(World::new(), &numbers(STEP), "/numbers");
    let bag = format!("bag:={}", listener.bag);
    let parameters = [&*bag, "start_paused:=true", "await_subscribers:=1"];
    let process = listener.world.node("player", &parameters);
    process.await_ready();
    let start = START.to_string();
    let client = ["/lgvi_player", &start];
    let client = listener.world.ros_python("ros2_player_client.py", &client);
    let answers: serde_json::Value = client.finish().expect(0).json();
    process.finish().expect(0);
    let expected = serde_json::json!({
        "is_paused": true, "burst": 4, "play_next": true, "seek": true, "seek_beyond": false,
        "set_rate": true, "set_rate_0": false, "get_rate": 2.0,
    });
    assert_eq!(answers, expected);
    assert_eq!(listener.numbers(), [0, 1, 2, 3, 70]);
}

#[test]
fn states_of_more_bodies_than_the_first_go_over_shared_memory_and_those_of_another_definition_do_not()
 {
    let world = World::new();
    let state = "/lgvi_propagator/state";
    let records = (0..60).map(|number: u64| {
        let body = BodyState {
            name: "body".into(),
            attitude: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            ..BodyState::default()
        };
        let header = Header {
            frame_id: "inertial".into(),
            ..Header::default()
        };
        let message = SystemState {
            header,
            sequence: number,
            step: number,
            bodies: vec![body; 1 + usize::try_from(number).unwrap() / 20],
            ..SystemState::default()
        };
        Record {
            topic: state.into(),
            log_time: START + number * STEP,
            publish_time: START,
            sequence: 0,
            data: cdr::encode(&message).unwrap(),
        }
    });
    let mut bag = Recording {
        topics: vec![Topic {
            type_name: SystemState::TYPE_NAME.into(),
            type_hash: SystemState::TYPE_HASH.into(),
            definition: SystemState::DEFINITION.into(),
            ..topic(state, Durability::Volatile)
        }],
        records: records.collect(),
    };
    bag.write(&world.path("bag"));
    let output = format!("output:={}", world.path("copy").display());
    let recorder = world.node("recorder", &[&output]);
    recorder.await_ready();
    let path = format!("bag:={}", world.path("bag").display());
    let player = world.node("player", &[&path, "rate:=0", "await_subscribers:=1"]);
    player.finish().expect(0);
    recorder.stop().expect(0);
    let copy = Recording::read(&world.path("copy"));
    let payloads = |bag: &Recording| Vec::from_iter(bag.on(state).map(|one| one.data.clone()));
    assert!(payloads(&copy) == payloads(&bag), "{:?}", copy.counts());

    bag.topics[0].type_hash = format!("RIHS01_{}", "0".repeat(64));
    bag.write(&world.path("other"));
    let other = world.path("other");
    let played = world.lgvi(["play", other.to_str().unwrap(), "--rate", "0"]);
    played
        .finish()
        .expect(0)
        .says(&[state, "does not go over shared memory"]);
}
