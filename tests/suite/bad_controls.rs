//! Control sequences that cannot be flown.

use lgvi_common::Event;
use lgvi_msgs::geometry_msgs::Vector3;
use lgvi_msgs::msg::ControlSequence;
use lgvi_tests::{Recording, Summary, World, coast, eventually, publish, scene};

const STATE: &str = "/lgvi_propagator/state";

/// A change that spoils a sequence, and what is said about it.
type Case = (fn(&mut ControlSequence), &'static [&'static str]);

const CASES: [Case; 5] = [
    (
        |sequence| sequence.body = "moon".into(),
        &["`body` is \"moon\"", "expected one of spacecraft"],
    ),
    (
        |sequence| sequence.moment[17].y = f64::NAN,
        &[
            "`moment[17]` is [0.0, NaN, 0.0]",
            "expected three finite numbers",
        ],
    ),
    (
        |sequence| sequence.force[999].z = f64::NEG_INFINITY,
        &[
            "`force[999]` is [0.0, 0.0, -inf]",
            "expected three finite numbers",
        ],
    ),
    (
        |sequence| sequence.step_size = 0.001,
        &[
            "`step_size` is 0.001 s",
            "expected the scene's step 0.000902976 s",
        ],
    ),
    (
        |sequence| {
            sequence.moment.pop();
        },
        &["force", "moment", "1000", "999"],
    ),
];

fn spoiled(change: fn(&mut ControlSequence)) -> ControlSequence {
    let mut sequence = coast();
    change(&mut sequence);
    sequence
}

#[test]
fn a_bad_sequence_ends_a_waiting_flight_and_the_bag_is_closed() {
    for (change, fragments) in CASES {
        let world = World::new();
        let flight = world.start_flight(&scene("inclination_change"), "flight", &["--no-planner"]);
        let stranger = world.ros_node("stranger");
        let _publisher = publish(&stranger, &spoiled(change));
        let finished = flight.finish().expect(2);
        finished.says(fragments);
        let summary: Summary = finished.json();
        assert_eq!(summary.failure.unwrap().exit_code, 2);
        let recording = Recording::read(&summary.bag.unwrap());
        assert_eq!(recording.on("/lgvi_propagator/scene").count(), 1);
        assert_eq!(recording.on(STATE).count(), 0);
    }
}

#[test]
fn a_bad_sequence_in_mid_flight_ends_it_and_the_bag_verifies_up_to_there() {
    let world = World::new();
    let arguments = ["--no-planner", "--real-time-factor", "0.05"];
    let flight = world.start_flight(&scene("inclination_change"), "flight", &arguments);
    let stranger = world.ros_node("stranger");
    let _publisher = publish(&stranger, &coast());
    world.await_step(20);
    let (change, fragments) = CASES[0];
    let _bad = publish(&stranger, &spoiled(change));
    let finished = flight.finish().expect(2);
    finished.says(fragments);
    let states = Recording::read(&world.path("flight")).on(STATE).count();
    assert!((20..1001).contains(&states), "{states}");
    world.verify_agrees(&world.path("flight"), states as u64);
}

/// A stream of late sequences is no stream of warnings, and ends no flight.
#[test]
fn late_sequences_are_one_warning_and_counted() {
    let world = World::new();
    let arguments = ["--no-planner", "--real-time-factor", "0.05"];
    let flight = world.start_flight(&scene("inclination_change"), "flight", &arguments);
    flight.await_stderr("waiting at step 0 for a control sequence for spacecraft");
    let stranger = world.ros_node("stranger");
    let _publisher = publish(&stranger, &coast());
    world.await_step(20);
    let _late: Vec<_> = (1..=5)
        .map(|number| {
            let mut late = coast();
            late.force[0].x = f64::from(number);
            publish(&stranger, &late)
        })
        .collect();
    let finished = flight.finish().expect(0);
    let warnings = finished.stderr.matches("too late").count();
    assert!((1..5).contains(&warnings), "{}", finished.stderr);
    let summary: Summary = finished.json();
    assert_eq!(summary.flight.unwrap().late_controls, 5);
}

#[test]
fn a_name_of_a_megabyte_is_logged_in_less_than_a_kilobyte() {
    const CHANGES: [fn(&mut ControlSequence); 3] = [
        |sequence| sequence.body = "a".repeat(1 << 20),
        |sequence| sequence.body = "ä".repeat(1 << 19),
        |sequence| sequence.header.frame_id = "a".repeat(1 << 20),
    ];
    let world = World::new();
    let scene = format!("scene:={}", scene("inclination_change").display());
    let propagator = world.node("propagator", &[&scene]);
    let stranger = world.ros_node("stranger");
    let publishers = CHANGES.map(|change| publish(&stranger, &spoiled(change)));
    let stderr = eventually("three refusals", || {
        let stderr = propagator.stderr();
        let refused = stderr.matches("control sequence refused").count();
        (refused == publishers.len()).then_some(stderr)
    });
    for line in stderr.lines() {
        assert!(line.len() < 1000, "{} bytes: {line}", line.len());
    }
    propagator.stop().expect(0);
}

#[test]
fn a_propagator_of_its_own_refuses_bad_sequences_and_flies_a_good_one() {
    let world = World::new();
    let scene = format!("scene:={}", scene("inclination_change").display());
    let mut propagator = world.node("propagator", &[&scene, "real_time_factor:=0.0"]);
    let stranger = world.ros_node("stranger");
    for (change, fragments) in CASES {
        let _publisher = publish(&stranger, &spoiled(change));
        for fragment in fragments {
            propagator.await_stderr(fragment);
        }
    }
    assert!(propagator.runs());

    let mut good = coast();
    good.force[0] = Vector3 {
        x: 1.0,
        y: 0.0,
        z: 0.0,
    };
    let _publisher = publish(&stranger, &good);
    let published = propagator.await_event("published", |event| match event {
        Event::Published { messages } => Some(messages.clone()),
        _ => None,
    });
    assert_eq!(published["/lgvi_propagator/flown_control"], 1);
    let steps = propagator.await_flown().steps;
    assert_eq!(steps, 1000);
    propagator.stop().expect(0);
}
