//! The scene of the README's first command: planned, flown, recorded.

use std::collections::BTreeMap;

use lgvi_msgs::cdr;
use lgvi_msgs::msg::SystemState;
use lgvi_tests::{Recording, World, optimal_cost, scene};
use serde::Deserialize;

const STATE: &str = "/lgvi_propagator/state";

#[test]
fn it_arrives_at_the_reference_cost_and_every_message_is_recorded() {
    let world = World::new();
    let (summary, bag) = world.fly(&scene("inclination_change"), "flight");

    let reference = optimal_cost("C_i", 1000);
    let plan = summary.plan.unwrap();
    let flight = summary.flight.unwrap();
    for cost in [plan.cost, flight.cost.unwrap()] {
        assert!(
            (cost / reference - 1.0).abs() < 1e-9,
            "cost {cost}, reference {reference}"
        );
    }
    let miss = flight.miss.unwrap();
    assert!(miss.norm <= 1e-12, "{miss:?}");
    assert_eq!((flight.steps, flight.refused), (1000, 0));

    // Each resolution tells of where it begins, too, and the outcome is told last.
    let told = summary.published["/lgvi_planner/progress"];
    assert!(told >= u64::from(plan.iterations) + 2, "{told}");
    let expected = BTreeMap::from([
        ("/lgvi_planner/control_sequence", 1),
        ("/lgvi_planner/markers", 1),
        ("/lgvi_planner/planned_path", 1),
        ("/lgvi_planner/progress", told),
        ("/lgvi_propagator/flown_control", 1),
        ("/lgvi_propagator/invariants", 101),
        ("/lgvi_propagator/markers", 1),
        ("/lgvi_propagator/odometry/spacecraft", 101),
        ("/lgvi_propagator/scene", 1),
        (STATE, 1001),
        ("/tf", 101),
    ]);
    let recorded = summary
        .recorded
        .iter()
        .map(|(topic, count)| (topic.as_str(), *count))
        .collect();
    assert_eq!(expected, recorded);
    assert_eq!(expected, Recording::read(&bag).counts());
    let mut published = summary.published;
    published.retain(|_, messages| *messages > 0);
    assert_eq!(published, summary.recorded);
    world.verify_agrees(&bag, 1001);
}

/// A message as `check_bag.py` prints it.
#[derive(Deserialize)]
struct Line {
    topic: String,
    time: u64,
    message: SystemState,
}

#[test]
fn readers_in_python_find_the_same_messages_to_the_last_bit() {
    let world = World::new();
    let (_, bag) = world.fly(&scene("inclination_change"), "flight");
    let recording = Recording::read(&bag);
    let path = bag.to_str().unwrap();

    let summary: serde_json::Value = world
        .python("check_bag.py", &[path])
        .finish()
        .expect(0)
        .json();
    assert_eq!(summary["counts"], serde_json::json!(recording.counts()));

    let dump = world
        .python("check_bag.py", &[path, "--dump", STATE])
        .finish()
        .expect(0);
    let lines: Vec<Line> = dump
        .stdout
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(lines.len(), 1001);
    for (line, record) in lines.iter().zip(recording.on(STATE)) {
        assert_eq!((line.topic.as_str(), line.time), (STATE, record.log_time));
        assert_eq!(
            cdr::encode(&line.message).unwrap(),
            record.data,
            "state at {} ns",
            line.time
        );
    }
}
