//! When sensors read, and for whom: what is read depends on the step alone.

use super::*;

const ZERO: [f64; 3] = [0.0; 3];

/// A tumbling craft in orbit under thrust, with an IMU every 3 steps, one that is 7 steps late, and a receiver every 5.
fn flown() -> Run {
    let sensors = sensor("imu", "early", "period = 0.3")
        + &sensor("imu", "late", "period = 0.4\ndelay = 0.7\nframe = \"arm\"")
        + &sensor("gnss", "gnss", "period = 0.5");
    let start = place([10.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.1, -0.2]);
    let craft = body("craft", &start, &sensors);
    let rest = format!(
        "{craft}{}[gravity.central]\ngm = 10.0\n",
        arm([0.0, 1.0, 0.0])
    );
    let mut flown = Run::new(&run(0.1, &rest));
    flown.command(0, [0.1, 0.2, 0.0], [0.0, 0.01, 0.0], "craft");
    flown
}

/// With when they come.
fn of(sensor: usize, all: &[(u64, Reading)]) -> Vec<(u64, Reading)> {
    let all = all.iter().filter(|(_, reading)| reading.sensor == sensor);
    all.copied().collect()
}

#[test]
fn readings_come_at_their_periods_and_after_their_delays() {
    let mut flown = flown();
    let begun: Vec<_> = flown.begin().iter().map(|reading| reading.sensor).collect();
    assert_eq!(begun, [0, 2]);
    let all = flown.steps(40);
    let times = |sensor| {
        let all = of(sensor, &all);
        let all = all.iter().map(|(step, reading)| (*step, reading.step));
        all.collect::<Vec<_>>()
    };
    let expected = |period: u64, delay: u64| {
        let first = if delay > 0 { 0 } else { period };
        let steps = (first..=40 - delay).step_by(period as usize);
        steps.map(|step| (step + delay, step)).collect::<Vec<_>>()
    };
    assert_eq!(times(0), expected(3, 0));
    assert_eq!(times(1), expected(4, 7));
    assert_eq!(times(2), expected(5, 0));
}

#[test]
fn a_late_listener_and_one_among_others_get_the_same_bits() {
    let mut flown = flown();
    flown.begin();
    let complete = flown.steps(100);
    for (listened, from) in [
        ([true, false, false], 0),
        ([false, true, false], 17),
        ([true, false, true], 44),
    ] {
        let mut other = self::flown();
        (0..3).for_each(|sensor| other.listen(sensor, false));
        other.begin();
        assert_eq!(other.steps(from), []);
        for (sensor, listens) in listened.into_iter().enumerate() {
            other.listen(sensor, listens);
        }
        let all = other.steps(100 - from);
        for (sensor, listens) in listened.into_iter().enumerate() {
            let (found, expected) = (of(sensor, &all), of(sensor, &complete));
            if !listens {
                assert_eq!(found, []);
                continue;
            }
            // The period that has begun before is not read.
            let missing = expected.len() - found.len();
            assert_eq!(found, expected[missing..]);
            let every = flown.scene.sensors[sensor].every;
            assert!(found[0].1.step <= from + 2 * every, "{found:?}");
        }
    }
}

/// The states may be set in the middle of a period: it begins anew.
#[test]
fn no_period_reaches_back_beyond_a_change_of_the_states() {
    let mut flown = flown();
    flown.begin();
    flown.steps(7);
    let jump = lgvi_msgs::msg::BodyState {
        name: "craft".into(),
        position: [0.0, 20.0, 0.0],
        attitude: [0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0],
        angular_momentum: [0.0, 0.0, 2.5],
        ..Default::default()
    };
    let states = crate::SetStates::of_message(&flown.scene, &[jump]).unwrap();
    flown.flight.set_states(&states).unwrap();
    assert_eq!(flown.begin(), []);
    let all = flown.steps(2);
    let [(9, reading)] = of(0, &all)[..] else {
        panic!("{all:?}")
    };
    let Truth::Inertial { rate, force, time } = reading.truth else {
        panic!("{reading:?}")
    };
    assert_eq!(time, 0.2);
    assert!(
        (rate.z - 1.0).abs() < 0.01 && force.norm() < 0.2,
        "{rate} {force}"
    );
    // Reset: what was read and not yet published belongs to another flight.
    flown.flight.reset(&flown.scene).unwrap();
    let again: Vec<_> = flown.begin().iter().map(|reading| reading.step).collect();
    assert_eq!(again, [0, 0]);
    assert!(flown.steps(6).iter().all(|(_, reading)| reading.step > 0));
}

/// A step at which the flight waits is read again for who has come late.
#[test]
fn what_is_read_again_has_the_same_bits() {
    let mut flown = flown();
    let first = flown.begin();
    flown.sensors.read(&flown.flight);
    assert_eq!(flown.publish(), first);
    flown.steps(59);
    let here: Vec<_> = flown.step();
    flown.sensors.read(&flown.flight);
    assert_eq!(flown.publish(), here);
    assert_eq!(here.len(), 2);
    let next = flown.steps(40);
    let mut other = self::flown();
    other.begin();
    other.steps(60);
    assert_eq!(next, other.steps(40));
}

#[test]
fn nothing_is_read_where_nobody_listens_and_nothing_is_allocated() {
    let mut flown = flown();
    flown.begin();
    let taken = allocation_counter::measure(|| {
        for _ in 0..1000 {
            flown.sensors.depart(&flown.flight);
            flown.flight.advance().unwrap();
            flown.sensors.arrive(&flown.flight);
            while flown.sensors.take().is_some() {}
        }
    });
    assert_eq!(taken, allocation_counter::AllocationInfo::default());
    (0..3).for_each(|sensor| flown.listen(sensor, false));
    flown.steps(10);
    assert_eq!(flown.steps(1000), []);
    let still = body("craft", &place(ZERO, ZERO, ZERO), "");
    assert!(Run::new(&run(0.1, &still)).sensors.is_empty());
}
