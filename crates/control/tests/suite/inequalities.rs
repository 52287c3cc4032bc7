//! Inequalities on states compared with their geometry, and their derivatives compared with automatic differentiation.

use std::sync::Arc;

use lgvi_control::Constraint;
use lgvi_control::constraint::{
    AngularRate, Coordinates, Corridor, FrameMotion, FramePose, KeepInSphere, KeepOutCone,
    KeepOutEllipsoid, KeepOutSphere, LineOfSight, Moving, Plume, Speed, StateConstraint,
};
use lgvi_dynamics::{BodyState, Inertia};
use lgvi_lie::exp;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use num_dual::DualNum;

use crate::automatic::{
    Moved, Number, constant, derivatives, dot, minus, norm, product, random_state, rows,
};

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

fn in_frame(constraint: impl StateConstraint, poses: &[FrameMotion]) -> Constraint {
    Constraint::state(Moving::new(constraint, poses.to_vec(), 1.0).expect("a frame"))
}

fn written(rng: &mut fastrand::Rng) -> Vec<Written> {
    let mut unit = || Vector3::from_fn(|_, _| rng.f64() - 0.5).normalize();
    let (axis, direction, apex) = (unit(), unit(), unit());
    let (half_angle, radius) = (0.7, 0.9);
    // In a frame, the cones are about axes that are turned with it.
    let rotation = exp(&(2.0 * unit()));
    let origin = unit();
    let (apex_there, axis_there) = (origin + rotation * apex, rotation * axis);
    let direction_there = rotation * direction;
    let (velocity, turn) = (unit(), 0.8 * unit());
    let pose = FramePose { origin, rotation };
    let poses = [FrameMotion {
        pose,
        velocity,
        turn,
    }];
    let tilted = exp(&(2.0 * unit()));
    let semi_axes = Vector3::new(0.5, 0.9, 1.4);
    let matrix = {
        let turn = exp(&unit());
        turn * Matrix3::from_diagonal(&Vector3::new(1.0, 1.3, 1.8)) * turn.transpose()
    };
    let inertia = Inertia::new(0.5 * (matrix + matrix.transpose())).expect("inertia");
    let inverse = *inertia.inverse();
    let ellipsoid = KeepOutEllipsoid::new(apex, semi_axes, tilted).expect("an ellipsoid");
    let sight = LineOfSight::new(axis, apex, half_angle).expect("a line of sight");
    // Random states are on both sides of this distance.
    let (reach, plume_angle) = (1.4, 1.3);
    let plume = Plume::new(axis, apex, plume_angle, reach).expect("a plume");
    let rate = AngularRate::new(0.7, &inertia).expect("a rate");
    let depth = move |s: &Moved, center: Vector3<f64>, axes: Matrix3<f64>| {
        let arm = product(
            &rows(&axes.transpose()),
            minus(s.position, constant(&center)),
        );
        let arm: [Number; 3] = std::array::from_fn(|i| arm[i] / semi_axes[i]);
        -dot(arm, arm) + 1.0
    };
    let keep_in = KeepInSphere::new(apex, radius).expect("a sphere");
    let far = move |s: &Moved, center: Vector3<f64>| {
        let arm = minus(s.position, constant(&center));
        dot(arm, arm) - radius * radius
    };
    let cosine = move |s: &Moved, point: Vector3<f64>| {
        let arm = minus(constant(&point), s.position);
        dot(product(&s.attitude, constant(&axis)), arm) / norm(arm)
    };
    vec![
        (
            Constraint::state(rate),
            Box::new(move |s| {
                let rate = product(&rows(&inverse), s.angular_momentum);
                dot(rate, rate) - 0.49
            }),
        ),
        (
            Constraint::state(rate.about(direction).expect("an axis")),
            Box::new(move |s| {
                let rate = product(&rows(&inverse), s.angular_momentum);
                let about = dot(rate, constant(&direction));
                about * about - 0.49
            }),
        ),
        (
            Constraint::state(Speed::new(0.3, 2.0).expect("a speed")),
            Box::new(move |s| dot(s.linear_momentum, s.linear_momentum) - 0.36),
        ),
        (
            in_frame(Speed::new(0.3, 2.0).expect("a speed"), &poses),
            // In the axes of the frame: `2 (Rᵀ (v − v_f) − (Rᵀ ω) × r)`, `r = Rᵀ (x − x_f)`.
            Box::new(move |s| {
                let back = rows(&rotation.transpose());
                let arm = product(&back, minus(s.position, constant(&origin)));
                let about = rotation.transpose() * turn;
                let carried = [0, 1, 2].map(|i| {
                    let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                    (arm[k] * about[j] - arm[j] * about[k]) * 2.0
                });
                let own = minus(s.linear_momentum, constant(&(2.0 * velocity)));
                let seen = minus(product(&back, own), carried);
                dot(seen, seen) - 0.36
            }),
        ),
        (Constraint::state(keep_in), Box::new(move |s| far(s, apex))),
        (
            in_frame(keep_in, &poses),
            Box::new(move |s| far(s, apex_there)),
        ),
        (
            Constraint::state(ellipsoid),
            Box::new(move |s| depth(s, apex, tilted)),
        ),
        (
            in_frame(ellipsoid, &poses),
            Box::new(move |s| depth(s, apex_there, rotation * tilted)),
        ),
        (
            Constraint::state(sight),
            Box::new(move |s| -cosine(s, apex) + half_angle.cos()),
        ),
        (
            in_frame(sight, &poses),
            Box::new(move |s| -cosine(s, apex_there) + half_angle.cos()),
        ),
        (
            Constraint::state(plume),
            Box::new(move |s| {
                let angle = (cosine(s, apex) - plume_angle.cos()) / plume_angle.sin();
                let near = norm(minus(constant(&apex), s.position)) / -reach + 1.0;
                let root = (angle * angle + near * near + 1e-12).sqrt();
                angle + near - root
            }),
        ),
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
            let (gradient_found, hessian_found) = all_derivatives(&*found, &state);
            let error = (gradient_found - scale * gradient).amax();
            assert!(
                error <= 1e-11 * gradient_found.amax(),
                "{constraint:?}: {error:e}"
            );
            let error = (hessian_found - scale * hessian).amax();
            assert!(
                error <= 1e-11 * hessian_found.amax(),
                "{constraint:?}: {error:e}"
            );
        }
    }
}

/// The derivatives of a constraint by all twelve coordinates.
fn all_derivatives(
    constraint: &dyn StateConstraint,
    state: &BodyState,
) -> (SVector<f64, 12>, SMatrix<f64, 12, 12>) {
    let mut gradient = SVector::<f64, 12>::zeros();
    let mut hessian = SMatrix::<f64, 12, 12>::zeros();
    let (first, twice) = constraint.derivatives(state);
    let from = match constraint.coordinates() {
        Coordinates::Position | Coordinates::Pose | Coordinates::Translation => 0,
        Coordinates::LinearMomentum => 3,
        Coordinates::Attitude => 6,
        Coordinates::AngularMomentum => 9,
    };
    gradient.fixed_rows_mut::<3>(from).copy_from(&first);
    hessian.fixed_view_mut::<3, 3>(from, from).copy_from(&twice);
    let second = match constraint.coordinates() {
        Coordinates::Pose => Some(6),
        Coordinates::Translation => Some(3),
        _ => None,
    };
    let by_second = constraint.by_second(state);
    assert_eq!(by_second.is_some(), second.is_some());
    if let (Some(found), Some(to)) = (by_second, second) {
        gradient.fixed_rows_mut::<3>(to).copy_from(&found.gradient);
        for (row, column, block) in [
            (to, to, found.hessian),
            (0, to, found.mixed),
            (to, 0, found.mixed.transpose()),
        ] {
            hessian
                .fixed_view_mut::<3, 3>(row, column)
                .copy_from(&block);
        }
    }
    (gradient, hessian)
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

#[test]
fn excesses_are_angles_and_parts_of_limits() {
    let mut state = random_state(&mut fastrand::Rng::with_seed(4));
    state.attitude = Matrix3::identity();
    let at = |angle: f64| state.position + 3.0 * Vector3::new(angle.cos(), angle.sin(), 0.0);
    let sight = |angle: f64| LineOfSight::new(Vector3::x(), at(angle), 0.5).expect("a sight");
    for angle in [0.1, 0.4999, 0.7, 2.5] {
        let sight = sight(angle);
        assert!((sight.excess(sight.value(&state)) - (angle - 0.5)).abs() < 1e-12);
    }
    let inertia = Inertia::principal([2.0, 3.0, 4.0]).expect("inertia");
    state.angular_momentum = Vector3::new(2.0, 6.0, 12.0);
    let rate = AngularRate::new(2.0, &inertia).expect("a rate");
    let excess = |rate: AngularRate| rate.excess(rate.value(&state));
    assert!((excess(rate) - (14.0_f64.sqrt() / 2.0 - 1.0)).abs() < 1e-12);
    let about = rate.about(Vector3::z() * -7.0).expect("an axis");
    assert!((excess(about) - 0.5).abs() < 1e-12);
    let semi_axes = Vector3::new(1.0, 2.0, 3.0);
    let quarter = exp(&(std::f64::consts::FRAC_PI_2 * Vector3::z()));
    let ellipsoid = KeepOutEllipsoid::new(Vector3::zeros(), semi_axes, quarter);
    let ellipsoid = ellipsoid.expect("an ellipsoid");
    // Its second axis is along −x.
    state.position = Vector3::new(1.5, 0.0, 0.0);
    assert!((ellipsoid.excess(ellipsoid.value(&state)) - 0.25).abs() < 1e-12);
    let keep_in = KeepInSphere::new(Vector3::zeros(), 1.2).expect("a sphere");
    assert!((keep_in.excess(keep_in.value(&state)) - 0.25).abs() < 1e-12);
}

/// A plume forbids what is both near and in its angle; at its point and far away nothing overflows.
#[test]
fn a_plume_is_near_and_in_its_angle() {
    let plume = Plume::new(Vector3::x(), Vector3::zeros(), 0.5, 2.0).expect("a plume");
    let at = |angle: f64, distance: f64| BodyState {
        position: -distance * Vector3::new(angle.cos(), angle.sin(), 0.0),
        attitude: Matrix3::identity(),
        ..start()
    };
    for angle in [0.0, 0.1, 0.49, 0.51, 1.0, 3.0] {
        for distance in [0.01, 1.0, 1.99, 2.01, 100.0] {
            let g = plume.value(&at(angle, distance));
            let inside = angle < 0.5 && distance < 2.0;
            assert_eq!(g > 0.0, inside, "{angle} {distance}: {g}");
        }
    }
    let (gradient, hessian) = all_derivatives(&plume, &at(0.0, 0.0));
    assert!(gradient.norm().is_finite() && hessian.norm().is_finite());
}
