//! Inequalities against their geometry, their derivatives against automatic differentiation.

use lgvi_dynamics::{BodyState, Load};
use lgvi_lie::exp;
use nalgebra::{Matrix3, SVector, Vector3, Vector6};
use num_dual::DualNum;

use super::*;
use crate::problem::automatic::{
    Moved, Number, constant, derivatives, dot, minus, product, random_state,
};
use crate::problem::{Actuation, Terminal, TerminalSet};

fn compile(constraint: Constraint, actuation: &Actuation) -> InequalitySet {
    let target = Terminal::try_from(start()).expect("a state");
    InequalitySet::new(
        &[constraint],
        actuation,
        &start(),
        &TerminalSet::from(&target),
    )
}

fn start() -> BodyState {
    random_state(&mut fastrand::Rng::with_seed(1))
}

fn full() -> Actuation {
    Actuation::full(&Matrix3::identity(), &Matrix3::identity()).expect("weights")
}

/// The constraints on the state, and what they are in any arithmetic, up to a positive factor.
type Written = (Constraint, Box<dyn Fn(&Moved) -> Number>);

fn written(rng: &mut fastrand::Rng) -> [Written; 3] {
    let mut unit = || Vector3::from_fn(|_, _| rng.f64() - 0.5).normalize();
    let (axis, direction, apex) = (unit(), unit(), unit());
    let (half_angle, radius) = (0.7, 0.9);
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
    ]
}

#[test]
fn state_inequalities_and_both_derivatives_are_those_of_automatic_differentiation() {
    let mut rng = fastrand::Rng::with_seed(9);
    for _ in 0..20 {
        let state = random_state(&mut rng);
        for (constraint, f) in written(&mut rng) {
            let found = &compile(constraint.clone(), &full()).state[0];
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
    let found = compile(Constraint::state(sphere), &full()).state[0]
        .value(&at(Vector3::x() * 1.998, Matrix3::identity()));
    assert!((found - 1e-3).abs() < 1e-6);

    let cone = KeepOutCone::new(Vector3::x(), Vector3::x(), 0.3).expect("a cone");
    let turned = exp(&(0.299 * Vector3::z()));
    let found =
        compile(Constraint::state(cone), &full()).state[0].value(&at(Vector3::zeros(), turned));
    assert!((found - 1e-3).abs() < 1e-5);
}

#[test]
fn a_corridor_is_smooth_and_right_at_its_apex() {
    let apex = Vector3::new(1.0, 2.0, 3.0);
    let corridor = Corridor::new(apex, Vector3::z(), 0.4).expect("a corridor");
    let found = compile(Constraint::state(corridor), &full());
    let g = &found.state[0];
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
fn command_inequalities_are_the_limits_on_what_the_actuators_do() {
    let mut rng = fastrand::Rng::with_seed(4);
    let mut column = || (std::array::from_fn(|_| rng.f64() - 0.5), 1.0);
    let columns = [column(), column(), column(), column()];
    let actuation = Actuation::actuators(&columns).expect("actuators");
    let limit = Vector3::new(0.5, 0.25, 0.125);
    type Inside<'a> = Box<dyn Fn(&Vector6<f64>, &Load) -> bool + 'a>;
    let within = |v: &Vector3<f64>| (0..3).all(|i| v[i].abs() <= limit[i]);
    let kinds: [(Constraint, usize, Inside); 5] = [
        (all(0.5), 8, Box::new(|w, _| w.amax() <= 0.5)),
        (
            components(Place::Position, limit),
            6,
            Box::new(|_, load| within(&load.force)),
        ),
        (
            components(Place::Attitude, limit),
            6,
            Box::new(|_, load| within(&load.moment)),
        ),
        (
            norm(Place::Position, 0.5),
            1,
            Box::new(|_, load| load.force.norm() <= 0.5),
        ),
        (
            norm(Place::Attitude, 0.25),
            1,
            Box::new(|_, load| load.moment.norm() <= 0.25),
        ),
    ];
    for (constraint, count, inside) in kinds {
        let rows = compile(constraint.clone(), &actuation).command;
        assert_eq!(rows.len(), count);
        for _ in 0..100 {
            let w = Vector6::from_fn(|i, _| if i < 4 { 1.6 * (rng.f64() - 0.5) } else { 0.0 });
            let load = actuation.load(&w);
            assert_eq!(
                rows.iter().all(|row| row.value(&w) <= 0.0),
                inside(&w, &load),
                "{constraint:?}"
            );
            let v = Vector6::from_fn(|_, _| rng.f64() - 0.5);
            for row in &rows {
                let shifted =
                    row.value(&w) + row.gradient(&w).dot(&v) + 0.5 * v.dot(&(row.hessian() * v));
                assert!((row.value(&(w + v)) - shifted).abs() < 1e-13);
            }
        }
    }
}

#[test]
fn limits_that_are_infinite_or_out_of_reach_are_none() {
    let moments = Actuation::actuators(&[([0.0, 0.0, 0.0, 1.0, 0.0, 0.0], 1.0)]).expect("one");
    let limit = Vector3::new(1.0, f64::INFINITY, 1.0);
    let forces = components(Place::Position, limit);
    assert_eq!(compile(forces.clone(), &full()).command.len(), 4);
    assert!(compile(forces, &moments).is_empty());
    assert!(compile(norm(Place::Position, 1.0), &moments).is_empty());
    let torques = components(Place::Attitude, limit);
    assert_eq!(compile(torques, &moments).command.len(), 2);
}

fn all(limit: f64) -> Constraint {
    Constraint::commands(CommandLimit::new([limit; 6]).expect("limits"))
}

fn components(place: Place, limit: Vector3<f64>) -> Constraint {
    Constraint::commands(ComponentLimit::new(place, limit).expect("limits"))
}

fn norm(place: Place, limit: f64) -> Constraint {
    Constraint::commands(NormLimit::new(place, limit).expect("a limit"))
}
