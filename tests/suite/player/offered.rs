//! Topics are offered as they were recorded, and late joiners get what they would have got.

use std::collections::BTreeMap;

use lgvi_bag::{History, Qos as Recorded};
use lgvi_middleware::ros::{Qos, Subscription};
use lgvi_msgs::rosgraph_msgs::Clock;
use lgvi_tests::{PATIENCE, Recording, World, eventually};

use super::{
    Listener, Number, STEP, burst, numbers, record, recorded_again, seek, stop, taken, times, topic,
};

/// A bag of three latched topics of fifteen messages each at the first times: of one that keeps five, of one that keeps
/// all, and of one of which nobody knows; and of numbers.
fn latched() -> Recording {
    let mut bag = numbers(STEP);
    for (name, history, depth) in [
        ("/five", History::KeepLast, 5),
        ("/all", History::KeepAll, 0),
        ("/unknown", History::Unknown, 0),
    ] {
        let mut topic = topic(name, true);
        topic.qos.history = history;
        topic.qos.depth = depth;
        bag.topics.push(topic);
        let records = (0..15).map(|number| record(name, number, STEP));
        bag.records.extend(records);
    }
    bag.records.sort_by_key(|record| record.log_time);
    bag
}

#[test]
fn late_joiners_get_what_the_publishers_kept() {
    let listener = Listener::new(World::new(), &latched(), "/numbers");
    let bag = format!("bag:={}", listener.bag);
    let process = listener.world.node("player", &[&bag, "start_paused:=true"]);
    let player = listener.world.operator("lgvi_player");
    eventually("the place", || seek(&player, 500).then_some(()));
    let late = listener.world.ros_node("late");
    let topics = ["/five", "/all", "/unknown"];
    let late = topics.map(|topic| late.subscription(topic, &Qos::latched(100)).unwrap());
    let mut heard = [const { Vec::new() }; 3];
    eventually("the last of each", || {
        for (heard, late) in heard.iter_mut().zip(&late) {
            heard.extend(taken(late));
        }
        heard
            .iter()
            .all(|heard| heard.last() == Some(&14))
            .then_some(())
    });
    stop(&player);
    process.finish().expect(0);
    let expected = [10, 0, 0].map(|first| Vec::from_iter(first..15));
    assert_eq!(heard, expected);
}

#[test]
fn late_joiners_hear_nothing_of_the_past_of_volatile_topics_and_of_the_clock() {
    let listener = Listener::new(World::new(), &numbers(STEP), "/numbers");
    let process = listener.node(&["start_paused:=true", "clock:=true"]);
    let player = listener.world.operator("lgvi_player");
    eventually("the first messages", || {
        (burst(&player, 30) == 30).then_some(())
    });
    assert!(seek(&player, 900) && seek(&player, 100));
    let late = listener.world.ros_node("late");
    let clock: Subscription<Clock> = late.subscription("/clock", &Qos::reliable(100)).unwrap();
    let numbers: Subscription<Number> = late.subscription("/numbers", &Qos::reliable(100)).unwrap();
    assert!(clock.wait_for_publishers(1, PATIENCE) && numbers.wait_for_publishers(1, PATIENCE));
    let mut heard = Vec::new();
    eventually("the time that stands", || {
        heard.extend(times(&clock));
        (heard.len() > 1).then_some(())
    });
    assert!(heard.iter().all(|&time| time == 100), "{heard:?}");
    assert_eq!(burst(&player, 3), 3);
    let mut heard = Vec::new();
    eventually("the numbers from now on", || {
        heard.extend(taken(&numbers));
        (heard.last() == Some(&12)).then_some(())
    });
    assert_eq!(heard, [10, 11, 12]);
    stop(&player);
    process.finish().expect(0);
    // Who listens from the beginning on hears all.
    let expected: Vec<i64> = (0..30).map(|number| number * 10).collect();
    let clock = listener.clock();
    assert_eq!(clock[..29], expected[..29], "{clock:?}");
    assert!(clock.ends_with(&[900, 100, 110, 120]), "{clock:?}");
}

#[test]
fn a_replay_that_is_recorded_again_has_the_quality_of_service_of_its_origin() {
    let world = World::new();
    let mut bag = numbers(STEP);
    for (name, reliable, durable) in [
        ("/reliable", true, false),
        ("/kept", true, true),
        ("/sensor", false, false),
    ] {
        let mut topic = topic(name, durable);
        topic.qos.reliable = reliable;
        bag.topics.push(topic);
        bag.records
            .extend((0..100).map(|number| record(name, number, STEP)));
    }
    bag.records.sort_by_key(|record| record.log_time);
    bag.write(&world.path("bag"));
    let copy = recorded_again(&world);
    let offered = |recording: &Recording| -> BTreeMap<String, (bool, bool)> {
        let topics = recording.topics.iter();
        let own = topics.filter(|topic| topic.type_name.ends_with("/Duration"));
        let offered = own.map(|topic| {
            let Recorded {
                reliable, durable, ..
            } = topic.qos;
            (topic.name.clone(), (reliable, durable))
        });
        offered.collect()
    };
    assert_eq!(offered(&copy), offered(&bag));
    let sent = |recording: &Recording, topic| {
        let sent = recording.on(topic).map(|record| record.data.clone());
        Vec::from_iter(sent)
    };
    for topic in ["/reliable", "/kept", "/numbers", "/latched"] {
        assert!(sent(&copy, topic) == sent(&bag, topic), "{topic}");
    }
}
