use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use nalgebra::{Matrix3, Vector3};

use super::*;
use crate::constraint::{CommandLimit, ComponentLimit, NormLimit, Place};
use crate::{Actuation, Constraint};

fn transfer(actuation: Actuation, motion: Motion, constraints: &[Constraint]) -> Transfer {
    let state = BodyState {
        position: Vector3::x(),
        linear_momentum: Vector3::zeros(),
        attitude: Matrix3::identity(),
        angular_momentum: Vector3::zeros(),
    };
    let inertia = Inertia::principal([1.0; 3]).expect("inertia");
    let body = RigidBody::new(1.0, inertia, Vec::new()).expect("a body");
    let field = Central { gm: 0.0 };
    Transfer::new(body, field, 0.1, 10, state, state, actuation)
        .expect("a transfer")
        .with_motion(motion)
        .with_constraints(constraints)
}

fn loads(force: [f64; 3], moment: [f64; 3]) -> Actuation {
    let weight = |diagonal: [f64; 3]| Matrix3::from_diagonal(&diagonal.into());
    Actuation::full(&weight(force), &weight(moment)).expect("weights")
}

fn components(place: Place, limits: [f64; 3]) -> Constraint {
    Constraint::commands(ComponentLimit::new(place, limits.into()).expect("limits"))
}

fn norm(place: Place, limit: f64) -> Constraint {
    Constraint::commands(NormLimit::new(place, limit).expect("a limit"))
}

fn close(found: Result<f64, FinalTimeError>, expected: f64) {
    let found = found.expect("a bound");
    assert!(
        (found / expected - 1.0).abs() < 1e-12,
        "{found} for {expected}"
    );
}

#[test]
fn the_greatest_cost_of_components_and_norms_is_exact() {
    let boxed = [components(Place::Attitude, [1.0, 2.0, 3.0])];
    let weights = loads([1.0; 3], [2.0, 1.0, 5.0]);
    close(rate(&transfer(weights, Motion::Rotation, &boxed)), 25.5);
    let ball = [norm(Place::Position, 3.0)];
    close(
        rate(&transfer(
            loads([2.0; 3], [1.0; 3]),
            Motion::Translation,
            &ball,
        )),
        9.0,
    );
    let both = [ball[0].clone(), boxed[0].clone()];
    let weights = loads([2.0; 3], [2.0, 1.0, 5.0]);
    close(rate(&transfer(weights, Motion::Full, &both)), 34.5);
    // A wide norm beside narrow components changes nothing.
    let wide = [norm(Place::Attitude, 100.0), boxed[0].clone()];
    let weights = loads([1.0; 3], [2.0, 1.0, 5.0]);
    close(rate(&transfer(weights, Motion::Rotation, &wide)), 25.5);
}

#[test]
fn no_commands_within_the_limits_cost_more() {
    let coupled = Matrix3::new(2.0, 0.8, 0.1, 0.8, 1.0, -0.3, 0.1, -0.3, 4.0);
    let actuation = Actuation::full(&coupled, &coupled).expect("weights");
    let limit = Vector3::new(1.0, 2.0, 0.5);
    for constraint in [
        components(Place::Attitude, limit.into()),
        norm(Place::Attitude, 0.5),
    ] {
        let ball = matches!(&constraint, Constraint::Commands(c) if c.name() == "moment_norm");
        let bound = rate(&transfer(
            actuation.clone(),
            Motion::Rotation,
            &[constraint],
        ))
        .expect("a bound");
        let mut greatest = 0.0_f64;
        for i in 0..40 {
            for j in 0..40 {
                let (a, b) = (f64::from(i) * 0.16, f64::from(j) * 0.16);
                let u = Vector3::new(a.cos() * b.cos(), a.sin() * b.cos(), b.sin());
                let u = if ball {
                    0.5 * u
                } else {
                    u.map(f64::signum).component_mul(&limit)
                };
                greatest = greatest.max(0.5 * u.dot(&(coupled * u)));
            }
        }
        assert!(
            greatest <= bound && bound <= 1.2 * greatest,
            "{bound} for {greatest}"
        );
    }
}

#[test]
fn thrusters_of_one_side_are_limited_and_skew_actuators_by_their_loads() {
    let column = |x: f64, y: f64| ([x, y, 0.0, 0.0, 0.0, 0.0], 1.0);
    let actuation = Actuation::actuators(&[column(1.0, 0.0), column(-1.0, 0.0)]).expect("two");
    let limit = CommandLimit::new(&[2.0, 3.0]).expect("limits").one_sided();
    let limits = [Constraint::commands(limit)];
    close(rate(&transfer(actuation, Motion::Full, &limits)), 6.5);
    // |w_1 + w_2| ≤ 2 and |w_1 − w_2| ≤ 2: at most w = (2, 0).
    let skew = Actuation::actuators(&[column(1.0, 1.0), column(1.0, -1.0)]).expect("two");
    let limits = [components(Place::Position, [2.0, 2.0, f64::INFINITY])];
    close(rate(&transfer(skew, Motion::Translation, &limits)), 2.0);
}

#[test]
fn the_first_command_without_a_limit_is_named() {
    let unlimited = |motion, constraints: &[Constraint]| match rate(&transfer(
        loads([1.0; 3], [1.0; 3]),
        motion,
        constraints,
    )) {
        Err(FinalTimeError::Unlimited { command }) => command,
        other => panic!("{other:?}"),
    };
    assert_eq!(unlimited(Motion::Rotation, &[]), 3);
    assert_eq!(unlimited(Motion::Full, &[norm(Place::Position, 1.0)]), 3);
    let open = [components(Place::Attitude, [1.0, f64::INFINITY, 1.0])];
    assert_eq!(unlimited(Motion::Rotation, &open), 4);
    // Limits on one side only.
    let limit = CommandLimit::new(&[f64::INFINITY; 6])
        .expect("limits")
        .one_sided();
    assert_eq!(
        unlimited(Motion::Translation, &[Constraint::commands(limit)]),
        0
    );
}
