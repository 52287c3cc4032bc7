//! What is played of a bag, and what is refused.

use lgvi_tests::{Recording, World};

use super::{COUNT, Listener, STEP, numbers};

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
