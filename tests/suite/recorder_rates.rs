//! The recorder under high rates: what is published is recorded, or counted as lost.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use lgvi_bag::BagReader;
use lgvi_common::Event;
use lgvi_middleware::shm::{Delivery, ShmNode, ShmOptions};
use lgvi_msgs::shm::{BodySample, Name, StateHeader};
use lgvi_tests::{Finished, PATIENCE, Recording, Summary, World, eventually};

const STATE: &str = "/lgvi_propagator/state";
const BODIES: usize = 5;
const RATE: u32 = 10_000;

/// A scene of five bodies that tumble, ten thousand steps a second.
fn scene(world: &World, seconds: u32) -> PathBuf {
    let mut text = format!(
        "title = \"Tumbling bodies\"\n[run]\nduration = {seconds}.0\nsteps = {}\nintegrator = \"lgvi\"\n\
         [publish]\nstate_every = 1\nros_every = 1000\n",
        seconds * RATE
    );
    for body in 0..BODIES {
        write!(
            text,
            "[[bodies]]\nname = \"body{body}\"\nmass = 1.0\ninertia = [1.0, 2.0, 3.0]\n\
             position = [{body}.0, 0.0, 0.0]\nvelocity = [0.0, 0.0, 0.0]\n\
             attitude = {{ w = 1, x = 0, y = 0, z = 0 }}\nangular_velocity = [1.0, 0.5, -0.75]\n"
        )
        .unwrap();
    }
    let path = world.path("bodies.toml");
    std::fs::write(&path, text).unwrap();
    path
}

/// What the bag's metadata says of itself, 0 where it says nothing.
fn said(bag: &Path, key: &str) -> f64 {
    let bag = BagReader::open(bag).unwrap();
    let value = bag.custom().get(key);
    value.map_or(0.0, |value| value.parse().unwrap())
}

/// Sequence numbers missing between those of a topic.
fn gaps(bag: &Path, topic: &str) -> u64 {
    let sequences: Vec<u32> = Recording::read(bag)
        .on(topic)
        .map(|record| record.sequence)
        .collect();
    let pairs = sequences.windows(2);
    pairs
        .map(|pair| u64::from(pair[1].checked_sub(pair[0] + 1).expect("their order")))
        .sum()
}

/// How often a flight that waits for nobody may lose something on a machine that is busy with others.
const TRIES: u32 = 3;

#[test]
fn ten_thousand_states_of_five_bodies_a_second_are_recorded() {
    let world = World::new();
    let scene = scene(&world, 3);
    let published = u64::from(3 * RATE + 1);

    let (summary, bag) = world.fly(&scene, "lossless");
    assert_eq!(summary.recorded[STATE], published);
    assert_eq!((said(&bag, "lost"), gaps(&bag, STATE)), (0.0, 0));
    assert!(BagReader::open(&bag).unwrap().custom()["software"].starts_with("lgvi_recorder "));
    assert_eq!(BagReader::open(&bag).unwrap().custom()["scene"], "bodies");

    let losses: Vec<u64> = (0..TRIES)
        .map(|attempt| fly_paced(&world, &scene, &format!("paced_{attempt}"), published))
        .take_while(|lost| *lost > 0)
        .collect();
    assert!(losses.len() < TRIES as usize, "{losses:?} states lost");
}

/// A flight at the pace of the clock; how many of its states are lost, of which all are counted.
fn fly_paced(world: &World, scene: &Path, name: &str, published: u64) -> u64 {
    let flight = world.start_flight(scene, name, &["--real-time-factor", "1", "--no-plot"]);
    let flown = flight.finish();
    let summary: Summary = flown.json();
    let bag = world.path(name);
    assert_eq!(summary.published[STATE], published);
    let lost = gaps(&bag, STATE);
    assert_eq!(said(&bag, &format!("lost:{STATE}")), lost as f64);
    assert_eq!(summary.recorded[STATE] + lost, published);
    assert_eq!(flown.code, Some(i32::from(lost > 0)));
    lost
}

#[test]
fn what_a_burst_loses_is_counted_to_the_last_state() {
    let world = World::new();
    let bag = world.path("bag");
    let options = ShmOptions {
        domain_id: world.environment().domain_id,
        root: Some(world.path("shm")),
    };
    let shm = ShmNode::new("/burst", &options).unwrap();
    let mut publisher = shm
        .state_publisher(STATE, BODIES, Delivery::DropNewest)
        .unwrap();
    let output = format!("output:={}", bag.display());
    let recorder = world.node("recorder", &[&output, "topics:=[]"]);
    recorder.await_ready();
    assert!(publisher.wait_for_subscribers(1, PATIENCE).unwrap());

    let mut published = 0;
    let mut send = || {
        let header = StateHeader {
            sequence: published,
            step: published,
            ..StateHeader::default()
        };
        let body = BodySample {
            name: Name::try_from("body").unwrap(),
            ..BodySample::default()
        };
        published += 1;
        publisher.send(header, &[body; BODIES]).unwrap().refused as u64
    };
    let (start, mut refused) = (Instant::now(), 0);
    while refused < 100 {
        assert!(start.elapsed() < PATIENCE, "nothing is refused");
        refused += send();
    }
    // The state that shows the last gap needs room.
    eventually("room for a state", || {
        let again = send();
        refused += again;
        (again == 0).then_some(())
    });
    recorder.await_stderr(" messages have been lost so far");
    let finished = recorder.stop().expect(0);
    finished.says(&[&format!(", {refused} lost")]);

    let recorded = Recording::read(&bag).on(STATE).count() as u64;
    assert_eq!(recorded + refused, published);
    assert_eq!(gaps(&bag, STATE), refused);
    assert_eq!(said(&bag, "lost"), refused as f64);
    assert_eq!(said(&bag, &format!("lost:{STATE}")), refused as f64);
    assert_eq!(closing(&finished).0, refused);
}

/// What a recorder has said at its end: messages lost, how often it has waited, and for how long.
fn closing(recorder: &Finished) -> (u64, u64, f64) {
    let events = recorder.stdout.lines();
    let mut events = events.filter_map(|line| serde_json::from_str(line).ok());
    let last = events.find_map(|event| match event {
        Event::Recorded {
            lost,
            waits,
            waited,
            ..
        } => Some((lost, waits, waited)),
        _ => None,
    });
    last.expect("the recorder's report")
}

#[test]
fn a_recorder_that_cannot_write_fast_enough_is_waited_for_and_says_so() {
    let world = World::new();
    let bag = world.path("bag");
    let output = format!("output:={}", bag.display());
    // Room for one message: receiving waits for writing whenever two come at once.
    let recorder = world.node("recorder", &[&output, "max_cache_size:=1"]);
    recorder.await_ready();
    let scene = format!("scene:={}", scene(&world, 1).display());
    let fast = ["real_time_factor:=0.0", "await_subscribers:=1"];
    let propagator = world.node("propagator", &[&scene, fast[0], fast[1]]);
    propagator.await_flown();
    propagator.stop().expect(0);
    let finished = recorder.stop().expect(0);
    finished.says(&["writing does not keep up"]);

    assert_eq!(Recording::read(&bag).on(STATE).count() as u32, RATE + 1);
    let (lost, waits, waited) = closing(&finished);
    assert_eq!((lost, said(&bag, "lost")), (0, 0.0));
    assert!(waits > 0 && waited > 0.0, "{waits} waits, {waited} s");
    assert!((said(&bag, "waited") - waited).abs() < 1e-6);
}
