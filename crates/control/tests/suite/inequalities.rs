//! Inequalities on states compared with their geometry, and their derivatives compared with automatic differentiation.

use std::sync::Arc;

use lgvi_control::constraint::{
    Corridor, FramePose, KeepOutCone, KeepOutSphere, Moving, StateConstraint,
};
use lgvi_control::{Constraint, Place};
use lgvi_dynamics::BodyState;
use lgvi_lie::exp;
use nalgebra::{Matrix3, SVector, Vector3};
use num_dual::DualNum;

use crate::automatic::{Moved, Number, constant, derivatives, dot, minus, product, random_state};

fn start() -> BodyState {
    random_state(&mut fastrand::Rng::with_seed(1))
}

/// The constraint adapted to a transfer that starts and ends at [`start`].
fn between_ends(constraint: &Constraint) -> Arc<dyn StateConstraint> {
    let Constraint::State(constraint) = constraint else {
        panic!("{constraint:?}");
    };
    let place = start().position;
    constraint
        .between(&place, Some(&place))
        .unwrap_or_else(|| constraint.clone())
}

/// A state constraint and an independent formula for it in differentiating arithmetic, up to a positive factor.
type Written = (Constraint, Box<dyn Fn(&Moved) -> Number>);

fn in_frame(constraint: impl StateConstraint, poses: &[FramePose]) -> Constraint {
    Constraint::state(Moving::new(constraint, poses, 1.0).expect("a frame"))
}

fn written(rng: &mut fastrand::Rng) -> [Written; 5] {
    let mut unit = || Vector3::from_fn(|_, _| rng.f64() - 0.5).normalize();
    let (axis, direction, apex) = (unit(), unit(), unit());
    let (half_angle, radius) = (0.7, 0.9);
    // In a frame, the cones are about axes that are turned with it.
    let rotation = exp(&(2.0 * unit()));
    let origin = unit();
    let (apex_there, axis_there) = (origin + rotation * apex, rotation * axis);
    let direction_there = rotation * direction;
    let poses = vec![FramePose { origin, rotation }];
    [
        (
            Constraint::state(KeepOutCone::new(axis, direction, half_angle).expect("a cone")),
            Box::new(move |s| {
                dot(product(&s.attitude, constant(&axis)), constant(&direction)) - half_angle.cos()
            }),
        ),
        (
            Constraint::state(KeepOutSphere::new(apex, radius).expect("a sphere")),
            Box::new(move |s| {
                let arm = minus(s.position, constant(&apex));
                -dot(arm, arm) + radius * radius
            }),
        ),
        (
            Constraint::state(Corridor::new(apex, axis, half_angle).expect("a corridor")),
            Box::new(move |s| {
                let arm = minus(s.position, constant(&apex));
                let epsilon = 1e-12 * (start().position - apex).norm();
                let rounded = (dot(arm, arm) + epsilon * epsilon).sqrt();
                (rounded - epsilon) * half_angle.cos() - dot(arm, constant(&axis))
            }),
        ),
        (
            in_frame(
                Corridor::new(apex, axis, half_angle).expect("a corridor"),
                &poses,
            ),
            Box::new(move |s| {
                let arm = minus(s.position, constant(&apex_there));
                let epsilon = 1e-12 * (start().position - apex_there).norm();
                let rounded = (dot(arm, arm) + epsilon * epsilon).sqrt();
                (rounded - epsilon) * half_angle.cos() - dot(arm, constant(&axis_there))
            }),
        ),
        (
            in_frame(
                KeepOutCone::new(axis, direction, half_angle).expect("a cone"),
                &poses,
            ),
            Box::new(move |s| {
                let turned = product(&s.attitude, constant(&axis));
                dot(turned, constant(&direction_there)) - half_angle.cos()
            }),
        ),
    ]
}

#[test]
fn state_inequalities_and_both_derivatives_are_those_of_automatic_differentiation() {
    let mut rng = fastrand::Rng::with_seed(9);
    for _ in 0..20 {
        let state = random_state(&mut rng);
        for (constraint, f) in written(&mut rng) {
            let found = between_ends(&constraint);
            let (value, gradient, hessian) = derivatives(&state, f);
            let scale = found.value(&state) / value;
            assert!(scale > 0.0, "{constraint:?}");
            let from = match found.place() {
                Place::Position => 0,
                Place::Attitude => 6,
            };
            let (by_place, twice) = found.derivatives(&state);
            let mut all = SVector::<f64, 12>::zeros();
            all.fixed_rows_mut::<3>(from).copy_from(&by_place);
            let error = (all - scale * gradient).amax();
            assert!(error <= 1e-12 * all.amax(), "{constraint:?}: {error:e}");
            let expected = scale * hessian.fixed_view::<3, 3>(from, from);
            let error = (twice - expected).amax();
            assert!(error <= 1e-12 * twice.amax(), "{constraint:?}: {error:e}");
            assert!((twice - twice.transpose()).amax() <= 1e-15 * twice.amax());
            let rest = hessian.norm_squared() - expected.norm_squared() / (scale * scale);
            assert!(rest.abs() < 1e-12 * hessian.norm_squared());
        }
    }
}

#[test]
fn violations_are_relative_to_the_limit_to_first_order() {
    let at = |position: Vector3<f64>, attitude: Matrix3<f64>| BodyState {
        position,
        linear_momentum: Vector3::zeros(),
        attitude,
        angular_momentum: Vector3::zeros(),
    };
    let sphere = KeepOutSphere::new(Vector3::zeros(), 2.0).expect("a sphere");
    let found = sphere.value(&at(Vector3::x() * 1.998, Matrix3::identity()));
    assert!((found - 1e-3).abs() < 1e-6);

    let cone = KeepOutCone::new(Vector3::x(), Vector3::x(), 0.3).expect("a cone");
    let turned = exp(&(0.299 * Vector3::z()));
    let found = cone.value(&at(Vector3::zeros(), turned));
    assert!((found - 1e-3).abs() < 1e-5);
}

#[test]
fn a_corridor_is_smooth_and_right_at_its_apex() {
    let apex = Vector3::new(1.0, 2.0, 3.0);
    let corridor = Corridor::new(apex, Vector3::z(), 0.4).expect("a corridor");
    let g = between_ends(&Constraint::state(corridor));
    let at = |offset: Vector3<f64>| BodyState {
        position: apex + offset,
        ..random_state(&mut fastrand::Rng::with_seed(2))
    };
    assert_eq!(g.value(&at(Vector3::zeros())), 0.0);
    let (gradient, hessian) = g.derivatives(&at(Vector3::zeros()));
    assert!(gradient.dot(&Vector3::z()) < 0.0 && hessian.norm().is_finite());
    for distance in [1e-6, 1e-3, 1.0, 10.0] {
        let side = |angle: f64| distance * Vector3::new(angle.sin(), 0.0, angle.cos());
        assert!(g.value(&at(side(0.39))) < 0.0);
        assert!(g.value(&at(side(0.41))) > 0.0);
        assert!(g.value(&at(-side(0.0))) > 0.0);
    }
}
