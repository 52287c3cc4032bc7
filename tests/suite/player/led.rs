//! The player is led by its services.

use std::time::Duration;

use lgvi_bag::{BagOptions, BagReader};
use lgvi_msgs::rosbag2_interfaces::srv::{TogglePaused, TogglePausedRequest};
use lgvi_tests::{World, eventually};

use super::{
    COUNT, Listener, START, STEP, burst, is_paused, numbers, play_next, rate, seek, set_rate, stop,
};

#[test]
fn a_paused_replay_is_led_step_by_step_to_and_fro() {
    let listener = Listener::new(World::new(), &numbers(STEP), "/numbers");
    let process = listener.node(&["start_paused:=true", "clock:=true"]);
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
fn ros_2_leads_the_player_as_it_leads_its_own() {
    let listener = Listener::new(World::new(), &numbers(STEP), "/numbers");
    let process = listener.node(&["start_paused:=true"]);
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
fn a_replay_that_runs_goes_on_where_it_is_sent() {
    let listener = Listener::new(World::new(), &numbers(STEP), "/numbers");
    // Five seconds.
    let process = listener.node(&["clock:=true", "rate:=0.2"]);
    let player = listener.world.operator("lgvi_player");
    let mut found = Vec::new();
    listener.await_numbers(&mut found, 3);
    assert!(seek(&player, 900) && !is_paused(&player));
    eventually("the end", || {
        found.extend(listener.numbers());
        (found.last() == Some(&99)).then_some(())
    });
    process.finish().expect(0);

    let played = found.len() - 10;
    let expected: Vec<i32> = (0..).take(played).chain(90..COUNT).collect();
    assert_eq!(found, expected);
    let clock = listener.clock();
    assert!(clock.is_sorted() && clock.contains(&900), "{clock:?}");
    let expected: &[i32] = if played > 40 { &[0, 40, 40] } else { &[0, 40] };
    assert_eq!(listener.latched(), expected);
}

#[test]
fn a_split_bag_is_sought_as_one_that_is_not() {
    let listener = Listener::new(World::new(), &numbers(STEP), "/numbers");
    let split = listener.world.path("split");
    let options = BagOptions {
        max_duration: Some(Duration::from_millis(150)),
        ..BagOptions::default()
    };
    numbers(STEP).write_as(&split, options);
    let bag = BagReader::open(&split).unwrap();
    assert!(bag.files().count() > 5 && bag.repeats()["/latched"] > 3);
    let listener = Listener {
        bag: split.to_str().unwrap().into(),
        ..listener
    };
    let process = listener.node(&["start_paused:=true"]);
    let player = listener.world.operator("lgvi_player");
    eventually("the first message", || {
        (burst(&player, 2) == 2).then_some(())
    });
    assert!(seek(&player, 700) && burst(&player, 20) == 20);
    assert!(seek(&player, 100) && burst(&player, 20) == 20);
    assert!(seek(&player, 0) && burst(&player, 0) == 102);
    stop(&player);
    process.finish().expect(0);

    let expected: Vec<i32> = [0].into_iter().chain(70..90).chain(10..30).collect();
    let numbers = listener.numbers();
    assert_eq!(numbers[..41], expected);
    assert_eq!(numbers[41..], Vec::from_iter(0..COUNT));
    assert_eq!(listener.latched(), [0, 40, 0, 0, 40]);
}

#[test]
fn a_replay_is_stopped_though_nobody_listens_yet() {
    let world = World::new();
    let bag = world.path("bag");
    numbers(STEP).write(&bag);
    let bag = format!("bag:={}", bag.display());
    let process = world.node("player", &[&bag, "await_subscribers:=1"]);
    process.await_ready();
    let player = world.operator("lgvi_player");
    player.await_state("active");
    assert!(!seek(&player, 100), "subscribers are awaited");
    stop(&player);
    process.finish().expect(0).says(&["played 0 messages"]);
}
