//! Flying in step with the clock on the wall.

use std::time::{Duration, Instant};

use lgvi_tests::{Summary, World, scene};

#[test]
fn a_real_time_flight_takes_its_time_and_loses_nothing() {
    let world = World::new();
    let start = Instant::now();
    let flight = world.start_flight(
        &scene("inclination_change"),
        "flight",
        &["--real-time-factor", "1"],
    );
    let summary: Summary = flight.finish().expect(0).json();
    assert!(
        start.elapsed() >= Duration::from_millis(902),
        "{:?}",
        start.elapsed()
    );
    assert!(summary.flight.unwrap().seconds >= 0.902);
    assert_eq!(summary.lost, Some(0));
    world.verify_agrees(&world.path("flight"), 1001);
}
