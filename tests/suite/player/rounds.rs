//! How fast a bag is played, and how often.

use std::time::{Duration, Instant};

use lgvi_msgs::rosbag2_interfaces::srv::{Pause, PauseRequest, Resume, ResumeRequest};
use lgvi_tests::World;

use super::{COUNT, Listener, START, STEP, is_paused, numbers, stop};

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
fn a_loop_plays_everything_again_until_it_is_stopped() {
    let listener = Listener::new(World::new(), &numbers(STEP), "/numbers");
    let process = listener.node(&["loop:=true", "clock:=true", "rate:=5"]);
    let player = listener.world.operator("lgvi_player");
    let mut found = Vec::new();
    listener.await_numbers(&mut found, 2 * COUNT as usize + 1);
    player.call::<Pause>("pause", &PauseRequest::default());
    assert!(is_paused(&player));
    player.call::<Resume>("resume", &ResumeRequest::default());
    stop(&player);
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
fn a_range_is_played_again_with_what_late_joiners_would_have_got() {
    let listener = Listener::new(World::new(), &numbers(STEP), "/numbers");
    let range = ["start_offset:=0.45", "duration:=0.1"];
    let process = listener.node(&[&range[..], &["loop:=true", "clock:=true", "rate:=2"]].concat());
    let player = listener.world.operator("lgvi_player");
    let mut found = Vec::new();
    listener.await_numbers(&mut found, 34);
    stop(&player);
    process.finish().expect(0);

    let expected: Vec<i32> = (45..=55).cycle().take(34).collect();
    assert_eq!(found[..34], expected);
    assert_eq!(listener.latched()[..3], [40, 40, 40]);
    let clock = listener.clock();
    let mut rounds = clock.split_inclusive(|&time| time == 550);
    for round in rounds.by_ref().take(3) {
        assert!(round.is_sorted() && round[0] == 450, "{clock:?}");
    }
}

/// A message of an older clock stands at the head of many a bag.
#[test]
fn years_without_a_message_are_skipped_and_said() {
    let mut bag = numbers(STEP);
    for record in &mut bag.records {
        if record.log_time == START {
            record.log_time = 0;
        }
    }
    let listener = Listener::new(World::new(), &bag, "/numbers");
    let line = ["play", &listener.bag, "--await-subscribers", "1"];
    let played = listener.world.lgvi(line).finish().expect(0);
    played.says(&["there is no message for 1000000000 s"]);
    assert_eq!(listener.numbers(), Vec::from_iter(0..COUNT));
}
