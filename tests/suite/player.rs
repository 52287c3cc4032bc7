//! The player does what its options and services say.

mod chosen;
mod foreign;
mod led;
mod offered;
mod rounds;
mod shared;

use lgvi_bag::{Qos as Recorded, Topic};
use lgvi_middleware::ros::{Qos, Subscription};
use lgvi_msgs::builtin_interfaces::{self, Time};
use lgvi_msgs::rosbag2_interfaces::srv::{
    Burst, BurstRequest, GetRate, GetRateRequest, IsPaused, IsPausedRequest, PlayNext,
    PlayNextRequest, Seek, SeekRequest, SetRate, SetRateRequest, Stop, StopRequest,
};
use lgvi_msgs::rosgraph_msgs::Clock;
use lgvi_msgs::{RosMessage, cdr, stamp};
use lgvi_tests::{Operator, Process, Record, Recording, World, eventually};

/// What is counted, in `sec`.
type Number = builtin_interfaces::Duration;

/// When the bags begin (ns).
const START: u64 = 1_000_000_000_000_000_000;

/// Messages of `/numbers`, from 0 on.
const COUNT: i32 = 100;

/// Between two of them (ns).
const STEP: u64 = 10_000_000;

fn topic(name: &str, durable: bool) -> Topic {
    Topic {
        name: name.into(),
        type_name: Number::TYPE_NAME.into(),
        type_hash: Number::TYPE_HASH.into(),
        definition: Number::DEFINITION.into(),
        definition_encoding: lgvi_bag::ROS2MSG.into(),
        qos: Recorded {
            durable,
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
        topics: vec![topic("/numbers", false), topic("/latched", true)],
        records,
    }
}

/// The bag of a world, played as fast as possible into a recorder.
#[track_caller]
fn recorded_again(world: &World) -> Recording {
    let output = format!("output:={}", world.path("copy").display());
    let recorder = world.node("recorder", &[&output]);
    recorder.await_ready();
    let path = format!("bag:={}", world.path("bag").display());
    let player = world.node("player", &[&path, "rate:=0", "await_subscribers:=1"]);
    player.finish().expect(0);
    recorder.stop().expect(0);
    Recording::read(&world.path("copy"))
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
        let latched = Qos::latched(5000);
        let stream = Qos::reliable(5000);
        Self {
            bag: path.to_str().unwrap().into(),
            numbers: observer.subscription(numbers, &stream).unwrap(),
            latched: observer.subscription("/latched", &latched).unwrap(),
            clock: observer.subscription("/clock", &stream).unwrap(),
            world,
        }
    }

    /// `lgvi play` with options, to its end.
    fn play(&self, options: &[&str]) {
        let line = ["play", &self.bag, "--await-subscribers", "1"];
        let line = line.into_iter().chain(options.iter().copied());
        self.world.lgvi(line).finish().expect(0);
    }

    /// The node with parameters besides the bag and the one subscriber that it awaits.
    fn node(&self, parameters: &[&str]) -> Process {
        let bag = format!("bag:={}", self.bag);
        let given = [&*bag, "await_subscribers:=1"];
        self.world.node("player", &[&given, parameters].concat())
    }

    fn numbers(&self) -> Vec<i32> {
        taken(&self.numbers)
    }

    fn latched(&self) -> Vec<i32> {
        taken(&self.latched)
    }

    /// What has come, with what comes until so many are there.
    #[track_caller]
    fn await_numbers(&self, found: &mut Vec<i32>, count: usize) {
        eventually(&format!("{count} numbers"), || {
            found.extend(self.numbers());
            (found.len() >= count).then_some(())
        });
    }

    /// Times on `/clock` since the start (ms), without what a pause repeats.
    fn clock(&self) -> Vec<i64> {
        let mut times = times(&self.clock);
        times.dedup();
        times
    }
}

fn taken(subscription: &Subscription<Number>) -> Vec<i32> {
    std::iter::from_fn(|| subscription.take().unwrap())
        .map(|sample| sample.message.sec)
        .collect()
}

/// Times since the start (ms).
fn times(clock: &Subscription<Clock>) -> Vec<i64> {
    std::iter::from_fn(|| clock.take().unwrap())
        .map(|sample| {
            let time = stamp::from_message(&sample.message.clock).unwrap();
            (time - i64::try_from(START).unwrap()) / 1_000_000
        })
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

fn stop(player: &Operator) {
    player.call::<Stop>("stop", &StopRequest::default());
}
