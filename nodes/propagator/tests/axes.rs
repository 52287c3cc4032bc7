//! Controls that are held in the axes of the inertial frame, or of another body, against exact laws of motion.

#![allow(clippy::unwrap_used)]

use lgvi_dynamics::BodyState;
use lgvi_msgs::geometry_msgs::Vector3 as Components;
use lgvi_msgs::msg::ControlSequence;
use lgvi_propagator::{Controls, Flight};
use lgvi_scene::Scene;
use nalgebra::Vector3;

/// Angular velocity of the turntable about z (rad/s).
const SPIN: f64 = 1.5;

/// Duration of the flights (s).
const T: f64 = 2.0;

const FORCE: [f64; 3] = [0.3, -0.2, 0.1];
const MOMENT: [f64; 3] = [0.2, 0.5, -0.4];

fn scene(steps: u64) -> Scene {
    let text = format!(
        r#"
        title = "A tumbling body and a turntable"
        [units]
        length = "2 m"
        [run]
        duration = {T}
        steps = {steps}
        integrator = "lgvi"
        [[bodies]]
        name = "body"
        mass = 1.5
        inertia = [1.0, 2.0, 2.5]
        position = [0, 0, 0]
        velocity = [0, 0, 0]
        attitude = {{ w = 0.8, x = 0.6, y = 0, z = 0 }}
        angular_velocity = [1.0, 0.5, -0.75]
        [[bodies]]
        name = "turntable"
        mass = 1.0
        inertia = [1.0, 1.0, 1.0]
        position = [9, 0, 0]
        velocity = [0, 0, 0]
        attitude = {{ w = 1, x = 0, y = 0, z = 0 }}
        angular_velocity = [0, 0, {SPIN}]
        "#
    );
    Scene::parse("test", &text).unwrap()
}

/// The states of the body (SI) at the beginning and the end of a flight with force and moment in the axes of `frame`.
fn fly(steps: u64, frame: &str) -> [BodyState; 2] {
    let scene = scene(steps);
    let mut message = ControlSequence {
        body: "body".into(),
        step_size: T,
        force: vec![components(FORCE)],
        moment: vec![components(MOMENT)],
        moment_in_frame: true,
        ..Default::default()
    };
    message.header.frame_id = frame.into();
    let mut flight = Flight::new(&scene).unwrap();
    let state = |flight: &Flight| scene.units.state_to_si(&flight.states()[0]);
    let start = state(&flight);
    let controls = Controls::of_message(&scene, &message).unwrap();
    flight.accept(controls).unwrap();
    for _ in 0..steps {
        flight.advance().unwrap();
    }
    [start, state(&flight)]
}

fn components([x, y, z]: [f64; 3]) -> Components {
    Components { x, y, z }
}

/// How far the changes of linear momentum and of angular momentum in inertial axes are from these.
fn errors([start, end]: &[BodyState; 2], impulse: [f64; 3], twist: [f64; 3]) -> [f64; 2] {
    let angular = |state: &BodyState| state.attitude * state.angular_momentum;
    [
        (end.linear_momentum - start.linear_momentum - Vector3::from(impulse)).norm(),
        (angular(end) - angular(start) - Vector3::from(twist)).norm(),
    ]
}

/// Angular momentum in inertial axes then grows in proportion to the time, however the body tumbles. The moment turns in the
/// body from step to step, so the error is of the order of the step.
#[test]
fn what_is_held_in_the_inertial_frame_changes_the_momenta_in_proportion_to_the_time() {
    let law = [FORCE, MOMENT].map(|vector| vector.map(|component| component * T));
    for frame in ["", "inertial"] {
        let [coarse, fine] = [500, 1000].map(|steps| errors(&fly(steps, frame), law[0], law[1]));
        assert!(coarse[0] < 1e-13 && fine[0] < 1e-13, "{coarse:?}");
        assert!(fine[1] < 1e-3, "{fine:?}");
        let ratio = coarse[1] / fine[1];
        assert!((1.9..4.2).contains(&ratio), "{coarse:?}, {fine:?}");
    }
}

/// In axes that turn uniformly about z, the integrals of force and moment are known.
#[test]
fn what_is_held_in_the_axes_of_another_body_turns_with_that_body() {
    let (sin, cos) = (SPIN * T).sin_cos();
    let integral = |[x, y, z]: [f64; 3]| {
        [
            (x * sin - y * (1.0 - cos)) / SPIN,
            (x * (1.0 - cos) + y * sin) / SPIN,
            z * T,
        ]
    };
    let law = [integral(FORCE), integral(MOMENT)];
    let [coarse, fine] = [500, 1000].map(|steps| errors(&fly(steps, "turntable"), law[0], law[1]));
    for (coarse, fine) in coarse.into_iter().zip(fine) {
        assert!(
            fine < 3e-3 && (1.9..4.2).contains(&(coarse / fine)),
            "{coarse}, {fine}"
        );
    }
}

#[test]
fn moments_that_do_not_fit_and_unknown_frames_are_refused_with_what_is_expected() {
    let scene = scene(10);
    let refused = |spoil: fn(&mut ControlSequence)| {
        let mut message = ControlSequence {
            body: "body".into(),
            step_size: T,
            force: vec![components(FORCE)],
            moment: vec![components(MOMENT)],
            moment_in_frame: true,
            ..Default::default()
        };
        spoil(&mut message);
        let error = Controls::of_message(&scene, &message).unwrap_err();
        error.to_string()
    };
    assert_eq!(
        refused(|message| message.thrust.push(1.0)),
        "`thrust` has length 1 beside `force`, expected only one of `force`, `wheel_torque` and `thrust`"
    );
    assert_eq!(
        refused(|message| message.moment[0].y = f64::NAN),
        "`moment[0]` is [0.2, NaN, -0.4], expected three finite numbers"
    );
    assert_eq!(
        refused(|message| message.header.frame_id = "moon".into()),
        "`header.frame_id` is \"moon\", expected one of inertial, body, turntable"
    );
    // With a moment in the axes of the body, the force cannot be in those of another.
    assert_eq!(
        refused(|message| {
            message.header.frame_id = "turntable".into();
            message.moment_in_frame = false;
        }),
        "`header.frame_id` is \"turntable\", expected one of inertial, body"
    );
}
