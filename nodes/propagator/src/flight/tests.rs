use lgvi_msgs::geometry_msgs;
use lgvi_msgs::msg::ControlSequence;
use nalgebra::Vector3;

use super::*;

pub(crate) fn scene() -> Scene {
    let text = r#"
        title = "A ball"
        [units]
        length = "2 m"
        [run]
        duration = 1.0
        steps = 10
        integrator = "lie_euler"
        [[bodies]]
        name = "ball"
        mass = 1.0
        inertia = [1, 1, 1]
        position = [0, 0, 0]
        velocity = [0, 0, 0]
        attitude = { w = 1, x = 0, y = 0, z = 0 }
        angular_velocity = [0, 0, 0]
    "#;
    Scene::parse("test", text).unwrap()
}

fn push(first_step: u64, force: f64, times: usize) -> ControlSequence {
    let force = geometry_msgs::Vector3 {
        x: force,
        ..Default::default()
    };
    ControlSequence {
        body: "ball".into(),
        first_step,
        step_size: 0.1,
        force: vec![force; times],
        moment: vec![Default::default(); times],
        ..Default::default()
    }
}

fn controls(first_step: u64, force: f64, times: usize) -> Controls {
    Controls::of_message(&scene(), &push(first_step, force, times)).unwrap()
}

/// Momentum gained in each of ten steps, in units of h × scene force.
fn momentum_gains(flight: &mut Flight) -> Vec<f64> {
    let momentum = |flight: &Flight| flight.states()[0].linear_momentum.x;
    (flight.step()..10)
        .map(|_| {
            let before = momentum(flight);
            flight.advance().unwrap();
            ((momentum(flight) - before) / 0.1).round()
        })
        .collect()
}

#[test]
fn a_sequence_acts_from_its_first_step_for_its_length_in_si() {
    let mut flight = Flight::new(&scene()).unwrap();
    flight.accept(controls(2, 6.0, 3)).unwrap();
    assert!(flight.commanded(0));
    let expected = [0.0, 0.0, 3.0, 3.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(momentum_gains(&mut flight), expected);
    assert_eq!(flight.loads()[0].force, Vector3::zeros());
}

#[test]
fn a_push_acts_beside_sequences_and_other_pushes() {
    let mut flight = Flight::new(&scene()).unwrap();
    flight.accept(controls(1, 2.0, 4)).unwrap();
    let along_x = |force| Load {
        force: Vector3::new(force, 0.0, 0.0),
        ..Load::default()
    };
    flight.push(0, along_x(5.0), 3);
    flight.push(0, along_x(7.0), 2);
    flight.push(1, along_x(9.0), 2);
    let expected = [12.0, 13.0, 6.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(momentum_gains(&mut flight), expected);
    flight.push(0, along_x(5.0), u64::MAX);
    flight.reset(&scene()).unwrap();
    assert_eq!(momentum_gains(&mut flight), [0.0; 10]);
}

/// Commanded forces, at most the thrust and as long as there is propellant; pushes use none.
#[test]
fn an_engine_exerts_what_is_commanded() {
    let text = format!(
        "{}\n[bodies.engine]\nthrust = 2.0\nexhaust_velocity = 10.0\n[bodies.propellant]\nmass = 0.05\n",
        scene().text
    );
    let scene = Scene::parse("test", &text).unwrap();
    let mut flight = Flight::new(&scene).unwrap();
    flight.accept(controls(0, 6.0, 4)).unwrap();
    let wind = Load {
        force: Vector3::new(5.0, 0.0, 0.0),
        ..Load::default()
    };
    flight.push(0, wind, 5);
    let mut found = Vec::new();
    for step in 0..5 {
        assert_eq!(flight.exhausted().next(), (step > 2).then_some(0));
        flight.advance().unwrap();
        found.push((
            flight.loads()[0].force.x,
            flight.system().bodies()[0].mass(),
        ));
    }
    let expected = [
        (7.0, 0.98),
        (7.0, 0.96),
        (6.0, 0.95),
        (5.0, 0.95),
        (5.0, 0.95),
    ];
    for (found, expected) in found.iter().zip(expected) {
        let off = (found.0 - expected.0).abs() + (found.1 - expected.1).abs();
        assert!(off < 1e-12, "{found:?} for {expected:?}");
    }
}

#[test]
fn an_interval_may_last_several_steps() {
    let mut message = push(1, 2.0, 2);
    message.step_size = 0.3;
    message.force[1].x = 4.0;
    let mut flight = Flight::new(&scene()).unwrap();
    flight
        .accept(Controls::of_message(&scene(), &message).unwrap())
        .unwrap();
    assert_eq!(flight.sequence_end(0), Some(7));
    let expected = [0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 0.0, 0.0, 0.0];
    assert_eq!(momentum_gains(&mut flight), expected);
}

#[test]
fn forces_in_the_frame_of_the_body_turn_with_it() {
    let scene = scene();
    let mut flight = Flight::new(&scene).unwrap();
    // A quarter turn about z: the x axis of the body points along y.
    let turned = lgvi_msgs::msg::BodyState {
        name: "ball".into(),
        attitude: [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        ..Default::default()
    };
    let turned = SetStates::of_message(&scene, &[turned]).unwrap();
    flight.set_states(&turned).unwrap();
    let mut message = push(0, 2.0, 1);
    message.header.frame_id = "ball".into();
    let controls = Controls::of_message(&scene, &message).unwrap();
    flight.accept(controls).unwrap();
    flight.advance().unwrap();
    assert_eq!(flight.loads()[0].force, Vector3::new(0.0, 1.0, 0.0));
}

#[test]
fn a_later_sequence_takes_over_at_its_first_step() {
    let mut flight = Flight::new(&scene()).unwrap();
    flight.accept(controls(0, 2.0, 10)).unwrap();
    flight.accept(controls(8, 8.0, 10)).unwrap();
    assert!(flight.has_sequence_from(0, 8));
    flight.accept(controls(4, 4.0, 3)).unwrap();
    let begins = [0, 4, 5, 8].map(|step| flight.has_sequence_from(0, step));
    assert_eq!(begins, [true, true, false, false]);
    let expected = [1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 0.0, 0.0, 0.0];
    assert_eq!(momentum_gains(&mut flight), expected);
}

/// Of a body that is set, spinning about z by so much in SI.
fn spinning(scene: &Scene, angular_momentum: f64) -> SetStates {
    let mut message = lgvi_msgs::msg::BodyState {
        name: "ball".into(),
        attitude: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        ..Default::default()
    };
    message.angular_momentum[2] = angular_momentum;
    SetStates::of_message(scene, &[message]).unwrap()
}

/// A turn of more than 1 rad a step cannot be made, nor can one that leaves the range of numbers.
#[test]
fn states_from_which_no_step_can_be_made_are_told_apart() {
    let scene = scene();
    let mut flight = Flight::new(&scene).unwrap();
    flight.accept(controls(0, 6.0, 3)).unwrap();
    let before = flight.states().to_vec();
    for (angular_momentum, part) in [
        (1e3, "no step can be made from these states: ball: "),
        (1e200, "no step can be made from these states: ball: "),
    ] {
        let error = flight
            .try_states(&scene, &spinning(&scene, angular_momentum))
            .unwrap_err()
            .to_string();
        assert!(error.starts_with(part), "{error}");
    }
    let flown = spinning(&scene, 4.0);
    flight.try_states(&scene, &flown).unwrap();
    assert_eq!((flight.states(), flight.step()), (&*before, 0));
    flight.set_states(&flown).unwrap();
    flight.advance().unwrap();
}

#[test]
fn a_sequence_in_the_past_is_refused() {
    let mut flight = Flight::new(&scene()).unwrap();
    flight.advance().unwrap();
    let refused = flight.accept(controls(0, 1.0, 10));
    assert_eq!(
        refused,
        Err(ControlError::Late {
            first_step: 0,
            step: 1
        })
    );
    flight.accept(controls(1, 1.0, 1)).unwrap();
}

#[test]
fn a_sequence_that_begins_when_the_flight_is_over_is_refused() {
    let mut flight = Flight::new(&scene()).unwrap();
    for first_step in [10, u64::MAX] {
        let refused = flight.admit(controls(first_step, 1.0, 10));
        let expected = ControlError::Beyond {
            first_step,
            steps: 10,
        };
        assert_eq!(refused, Err(expected));
    }
    assert!(!flight.commanded(0));
    flight.admit(controls(9, 1.0, 10)).unwrap();
    assert_eq!(flight.sequence_end(0), Some(19));
}

#[test]
fn a_sequence_without_end_ends_after_all_steps() {
    let mut flight = Flight::new(&scene()).unwrap();
    flight.accept(controls(u64::MAX, 1.0, 10)).unwrap();
    assert_eq!(flight.sequence_end(0), Some(u64::MAX));
}

#[test]
fn no_more_sequences_wait_than_there_is_room_for() {
    let mut flight = Flight::new(&Scene {
        steps: 1000,
        ..scene()
    })
    .unwrap();
    for first_step in 0..SEQUENCES as u64 {
        flight.admit(controls(first_step, 1.0, 1)).unwrap();
    }
    let next = SEQUENCES as u64;
    let refused = flight.admit(controls(next, 1.0, 1));
    assert_eq!(refused, Err(ControlError::TooMany { limit: SEQUENCES }));
    flight.admit(controls(next - 1, 1.0, 1)).unwrap();
    flight.advance().unwrap();
    flight.admit(controls(next, 1.0, 1)).unwrap();
}

#[test]
fn what_waits_takes_no_more_memory_than_is_allowed() {
    let mut flight = Flight::new(&Scene {
        steps: 1000,
        ..scene()
    })
    .unwrap();
    let long = Arc::new(Controls {
        loads: vec![Load::default(); 1_000_000],
        ..controls(0, 1.0, 1)
    });
    let fit = MEMORY / long.size();
    let at = |first_step: usize| Controls {
        first_step: first_step as u64,
        ..Controls::clone(&long)
    };
    for first_step in 0..fit {
        flight.admit(at(first_step)).unwrap();
    }
    let refused = flight.admit(at(fit));
    let expected = ControlError::TooLarge {
        size: long.size(),
        kept: fit * long.size(),
        limit: MEMORY,
    };
    assert_eq!(refused, Err(expected));
    flight.admit(at(fit - 1)).unwrap();
}

#[test]
fn wrong_sequences_are_refused_with_field_and_value() {
    let check = |spoil: fn(&mut ControlSequence)| {
        let mut message = push(0, 1.0, 3);
        spoil(&mut message);
        Controls::of_message(&scene(), &message)
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        check(|m| m.body = "moon".into()),
        "`body` is \"moon\", expected one of ball"
    );
    assert_eq!(
        check(|m| m.step_size = 0.25),
        "`step_size` is 0.25 s, expected the scene's step 0.1 s or a whole number of them"
    );
    assert!(check(|m| m.step_size = f64::NAN).contains("NaN"));
    assert!(check(|m| (m.force, m.moment) = Default::default()).contains("empty"));
    assert_eq!(
        check(|m| m.moment.truncate(2)),
        "3 elements in `force` and 2 in `moment`, expected the same number"
    );
    assert_eq!(
        check(|m| m.moment[2].y = f64::INFINITY),
        "`moment[2]` is [0.0, inf, 0.0], expected three finite numbers"
    );
    assert_eq!(
        check(|m| m.header.frame_id = "moon".into()),
        "`header.frame_id` is \"moon\", expected one of inertial, ball"
    );
    let text = check(|m| m.header.stamp.nanosec = 1_000_000_000);
    assert!(text.starts_with("`header.stamp`: "), "{text}");
}
