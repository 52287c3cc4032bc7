//! A bag that is played is recorded again as it was.

use std::time::{Duration, Instant};

use lgvi_middleware::ros::Qos;
use lgvi_msgs::rosgraph_msgs::Clock;
use lgvi_msgs::stamp;
use lgvi_tests::{Recording, World, scene};

#[test]
fn a_replayed_bag_equals_its_origin_message_by_message() {
    let world = World::new();
    let (_, origin) = world.fly(&scene("inclination_change"), "origin");
    let copy = world.path("copy");

    // What it records it finds by itself.
    let output = format!("output:={}", copy.display());
    let stamps = ["log_time:=stamp", "await_stamp:=true"];
    let recorder = world.node("recorder", &[&output, stamps[0], stamps[1]]);
    recorder.await_ready();
    let bag = format!("bag:={}", origin.display());
    let player = world.node("player", &[&bag, "rate:=0", "await_subscribers:=1"]);
    player.finish().expect(0);
    recorder.stop().expect(0);

    let (played, recorded) = (
        Recording::read(&origin),
        Recording::read(&copy)
            .without("/rosout")
            .without("/parameter_events")
            .without("/lgvi_player/transition_event"),
    );
    assert_eq!(played.counts(), recorded.counts());
    assert!(
        played.contents() == recorded.contents(),
        "other payloads, log times or order"
    );
    for topic in &played.topics {
        let copied = recorded
            .topics
            .iter()
            .find(|other| other.name == topic.name);
        assert_eq!(
            copied.map(|other| other.qos),
            Some(topic.qos),
            "{}",
            topic.name
        );
    }
    world.verify_agrees(&copy, 1001);
}

#[test]
fn a_paced_replay_takes_the_recorded_time_and_tells_it_as_clock() {
    let world = World::new();
    let (_, bag) = world.fly(&scene("inclination_change"), "flight");
    let observer = world.ros_node("observer");
    let clock = observer
        .subscription::<Clock>("/clock", &Qos::reliable(1000))
        .unwrap();
    let start = Instant::now();
    let player = world.lgvi(["play".as_ref(), bag.as_os_str(), "--clock".as_ref()]);
    player.finish().expect(0);
    let elapsed = start.elapsed();
    assert!(
        elapsed >= Duration::from_millis(902),
        "0.903 s were replayed in {elapsed:?}"
    );

    let epoch = 946_728_000_000_000_000;
    let times: Vec<i64> = std::iter::from_fn(|| clock.take().unwrap())
        .map(|sample| stamp::from_message(&sample.message.clock).unwrap() - epoch)
        .collect();
    // The first times are gone before anybody is known to listen.
    assert!((0..200_000_000).contains(&times[0]), "{times:?}");
    // The end of the flight is told whenever it comes.
    let (end, before) = times.split_last().unwrap();
    assert!(
        before
            .windows(2)
            .all(|pair| pair[1] - pair[0] >= 10_000_000),
        "{times:?}"
    );
    assert!(times.len() >= 60 && *end == 902_976_000, "{times:?}");
}
