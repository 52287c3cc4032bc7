//! `lgvi verify`: which flight, which fields, and how long it takes.

use std::path::Path;

use lgvi_msgs::cdr;
use lgvi_msgs::msg::{Intervention, SystemState};
use lgvi_tests::{Finished, Record, Recording, World, reference_bag};
use serde_json::{Value, json};

const STATE: &str = "/lgvi_propagator/state";
const INTERVENTION: &str = "/lgvi_propagator/intervention";

fn run(world: &World, bag: &Path, words: &[&str], code: i32) -> Finished {
    let line = [words[0], bag.to_str().unwrap()];
    let line = line.iter().chain(&words[1..]);
    world.lgvi(line).finish().expect(code)
}

/// The first difference, as JSON has it.
fn difference(world: &World, bag: &Path, words: &[&str]) -> Value {
    let words = [&["verify", "--json"], words].concat();
    let verdict: Value = run(world, bag, &words, 1).json();
    verdict["difference"].clone()
}

/// A bag, the same with another number in one state, and both in one under two names.
fn two_flights(world: &World) -> [std::path::PathBuf; 2] {
    let mut flight = Recording::read(&reference_bag("inclination_change"));
    let mut other = flight.clone();
    other.edit(STATE, 300, |state: &mut SystemState| {
        state.bodies[0].position[1] = f64::NAN;
    });
    for topic in &mut other.topics {
        topic.name.insert_str(0, "/z");
    }
    for record in &mut other.records {
        record.topic.insert_str(0, "/z");
    }
    let paths = ["one", "both"].map(|name| world.path(name));
    flight.write(&paths[0]);
    flight.topics.append(&mut other.topics);
    flight.records.append(&mut other.records);
    flight.records.sort_by_key(|record| record.log_time);
    flight.write(&paths[1]);
    paths
}

#[test]
fn of_several_flights_one_is_chosen() {
    let world = World::new();
    let [one, both] = two_flights(&world);
    let names = ["/lgvi_propagator", "/z/lgvi_propagator"];
    let picture = both.join("flight.svg");
    for tool in ["verify", "plot", "report"] {
        let unchosen = run(&world, &both, &[tool], 2);
        unchosen.says(&["2 flights", "--flight", names[0], names[1]]);
        let unknown = run(&world, &both, &[tool, "--flight", "/moon"], 2);
        unknown.says(&["no flight of /moon", names[0], names[1]]);
        run(&world, &one, &[tool, "--flight", names[0]], 0);
        run(&world, &both, &[tool, "--flight", names[0]], 0);
    }
    let drawn = std::fs::read(&picture).unwrap();
    assert_eq!(drawn, std::fs::read(one.join("flight.svg")).unwrap());
    let refused = run(&world, &both, &["plot", "--flight", names[1]], 2);
    refused.says(&["/z/lgvi_propagator/state", "not finite"]);

    let found = difference(&world, &both, &["--flight", names[1]]);
    assert_eq!(found["step"], 300);
    assert_eq!(found["field"], "position[1]");
    assert_eq!(found["recorded"], "NaN");
    assert!(found["computed"].is_f64(), "{found}");
}

#[test]
fn a_header_that_is_another_is_found() {
    let world = World::new();
    let flight = Recording::read(&reference_bag("inclination_change"));
    let expected = flight.messages::<SystemState>(STATE)[300].header.clone();
    type Change = fn(&mut SystemState);
    let cases: [(&str, Change, Value, Value); 3] = [
        (
            "header.stamp.sec",
            |state| state.header.stamp.sec = 12_345,
            json!(12_345),
            json!(expected.stamp.sec),
        ),
        (
            "header.stamp.nanosec",
            |state| state.header.stamp.nanosec = 1_000_000_000,
            json!(1_000_000_000),
            json!(expected.stamp.nanosec),
        ),
        (
            "header.frame_id",
            |state| state.header.frame_id = "elsewhere".into(),
            json!("elsewhere"),
            json!(expected.frame_id),
        ),
    ];
    for (field, change, recorded, computed) in cases {
        let mut altered = flight.clone();
        altered.edit(STATE, 300, change);
        let bag = world.path(field);
        altered.write(&bag);
        let body = "the system's";
        assert_eq!(
            difference(&world, &bag, &[]),
            json!({"step": 300, "body": body, "field": field, "recorded": recorded, "computed": computed})
        );
        let said = run(&world, &bag, &["verify"], 1).stdout;
        assert!(
            said.contains(&format!("(state 301): {body} {field} is {recorded}")),
            "{said}"
        );
    }
}

/// The first states of a flight, over and over, each time after a reset.
fn often_reset(count: u64) -> Recording {
    let mut flight = Recording::read(&reference_bag("interventions"));
    let states = flight.messages::<SystemState>(STATE);
    let states = [0, 1].map(|step| states.iter().find(|state| state.step == step).unwrap());
    let scene = flight.records.iter();
    let scene = scene.filter(|record| record.topic.ends_with("/scene"));
    let mut records: Vec<_> = scene.cloned().collect();
    let mut add = |topic: &str, sequence: u64, time: u64, data: Vec<u8>| {
        records.push(Record {
            topic: topic.into(),
            log_time: time,
            publish_time: time,
            sequence: sequence.try_into().unwrap(),
            data,
        });
    };
    for course in 0..count {
        for (number, state) in (2 * course..).zip(states) {
            let state = SystemState {
                sequence: number,
                ..state.clone()
            };
            // Stamps tell the time: all first states come before all second ones.
            let time = 1_000_000_000_000_000_000 + state.step;
            add(STATE, number, time, cdr::encode(&state).unwrap());
        }
        let reset = Intervention {
            kind: Intervention::RESET,
            ..Intervention::default()
        };
        let time = 1_000_000_000_000_000_000;
        add(INTERVENTION, course, time, cdr::encode(&reset).unwrap());
    }
    records.sort_by_key(|record| record.log_time);
    flight.records = records;
    flight
}

#[test]
fn a_flight_of_many_resets_is_verified() {
    let world = World::new();
    let mut flight = often_reset(4_000);
    let bag = world.path("bag");
    flight.write(&bag);
    let verify = |bag: &Path, code: i32| -> Value {
        let arguments = ["verify".as_ref(), bag.as_os_str(), "--json".as_ref()];
        world.lgvi(arguments).finish().expect(code).json()
    };
    let verdict = verify(&bag, 0);
    assert_eq!(verdict["states"], 8_000);
    assert_eq!(verdict["interventions"], 4_000);

    flight.edit(STATE, 7_999, |state: &mut SystemState| {
        state.bodies[0].attitude[4] = 0.5;
    });
    let altered = world.path("altered");
    flight.write(&altered);
    let verdict = verify(&altered, 1);
    assert_eq!(verdict["states"], 8_000);
    assert_eq!(verdict["difference"]["field"], "attitude[4]");
}

/// A recorder that did not keep up, as rosbag2's at 1 kHz.
#[test]
fn a_record_that_lost_states_is_compared_as_far_as_it_goes() {
    let world = World::new();
    let missing = |sequence: u64| sequence % 13 == 3 || (500..600).contains(&sequence);
    for bag in ["free_body", "inclination_change", "interventions"] {
        let mut flight = Recording::read(&reference_bag(bag));
        let states = flight.messages::<SystemState>(STATE);
        let kept = |state: &SystemState| {
            // Where a course begins, a missing state would leave open where an intervention was.
            let steps = states
                .windows(2)
                .map(|pair| (pair[1].sequence, pair[1].step > pair[0].step));
            let turns: Vec<u64> = steps
                .filter(|(_, on)| !on)
                .map(|(sequence, _)| sequence)
                .collect();
            let is_turn = turns
                .iter()
                .any(|turn| (turn - 1..=*turn).contains(&state.sequence));
            is_turn || !missing(state.sequence)
        };
        let last = states
            .iter()
            .filter(|state| kept(state))
            .map(|state| state.sequence)
            .max();
        let lost = states
            .iter()
            .filter(|state| !kept(state) && Some(state.sequence) < last)
            .count();
        flight.records.retain(|record| {
            record.topic != STATE || kept(&cdr::decode::<SystemState>(&record.data).unwrap())
        });
        assert!(lost > 0, "{bag}");
        let path = world.path(bag);
        flight.write(&path);
        let verdict: Value = run(&world, &path, &["verify", "--json"], 0).json();
        assert_eq!(verdict["missing"], lost, "{bag}");
        assert_eq!(verdict["difference"], Value::Null, "{bag}");
        let text = run(&world, &path, &["verify"], 0);
        let [states, missing] = ["states", "missing"].map(|key| verdict[key].as_u64().unwrap());
        let recorded = format!("{states} of {} states are recorded", states + missing);
        for part in ["the record is incomplete", &recorded, "agree bit for bit"] {
            assert!(text.stdout.contains(part), "{}", text.stdout);
        }
    }
}

/// A recorder that was stopped for a while has lost states, and what was published meanwhile.
#[test]
fn a_record_that_lacks_controls_after_a_gap_is_incomplete() {
    const FLOWN: &str = "/lgvi_propagator/flown_control";
    let world = World::new();
    let whole = Recording::read(&reference_bag("inclination_change")).without(FLOWN);
    let mut stopped = whole.clone();
    stopped.records.retain(|record| {
        let step = |record: &Record| cdr::decode::<SystemState>(&record.data).unwrap().step;
        record.topic != STATE || !(1..50).contains(&step(record))
    });
    let cases = [
        (whole, "differs", "differs at step 1 (state 2)"),
        (stopped, "incomplete", "incomplete: what is missing may"),
    ];
    for (recording, outcome, told) in cases {
        let path = world.path(outcome);
        recording.write(&path);
        let verdict: Value = run(&world, &path, &["verify", "--json"], 1).json();
        assert_eq!(verdict["outcome"], outcome);
        let said = run(&world, &path, &["verify"], 1).stdout;
        assert!(said.contains(told), "{said}");
        let gap = said.contains("the record is incomplete: 49 states are missing");
        assert_eq!(gap, outcome == "incomplete", "{said}");
    }
}
