//! Command inequalities compared with the limits that they express.

use lgvi_dynamics::{Inertia, Load};
use lgvi_lie::exp;
use nalgebra::{Matrix3, Vector3};

use super::*;
use crate::problem::{Actuation, Command, Terminal, TerminalSet};

fn compile(constraint: Constraint, actuation: &Actuation) -> InequalitySet {
    let start = BodyState {
        position: Vector3::zeros(),
        linear_momentum: Vector3::zeros(),
        attitude: Matrix3::identity(),
        angular_momentum: Vector3::zeros(),
    };
    let free = TerminalSet::from(&Terminal::FREE);
    InequalitySet::new(&[constraint], actuation, &start, &free, 10)
}

fn full() -> Actuation {
    Actuation::full(&Matrix3::identity(), &Matrix3::identity()).expect("weights")
}

#[test]
fn command_inequalities_are_the_limits_on_what_the_actuators_do() {
    let mut rng = fastrand::Rng::with_seed(4);
    let mut column = || (std::array::from_fn(|_| rng.f64() - 0.5), 1.0);
    let columns = [column(), column(), column(), column()];
    let actuation = Actuation::actuators(&columns).expect("actuators");
    let limit = Vector3::new(0.5, 0.25, 0.125);
    type Inside<'a> = Box<dyn Fn(&Command, &Load) -> bool + 'a>;
    let within = |v: &Vector3<f64>| (0..3).all(|i| v[i].abs() <= limit[i]);
    let one_sided = CommandLimit::new(&[0.5; 3]).expect("limits").one_sided();
    let kinds: [(Constraint, usize, Inside); 6] = [
        (all(0.5), 8, Box::new(|w, _| w.amax() <= 0.5)),
        (
            Constraint::commands(one_sided),
            7,
            Box::new(|w, _| w.min() >= 0.0 && w.rows(0, 3).max() <= 0.5),
        ),
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
            let w = Command::from_fn(|i, _| if i < 4 { 1.6 * (rng.f64() - 0.5) } else { 0.0 });
            let load = actuation.load(&w);
            assert_eq!(
                rows.iter().all(|row| row.value(&w) <= 0.0),
                inside(&w, &load),
                "{constraint:?}"
            );
            let v = Command::from_fn(|_, _| rng.f64() - 0.5);
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
    Constraint::commands(CommandLimit::new(&[limit; 6]).expect("limits"))
}

fn components(place: Place, limit: Vector3<f64>) -> Constraint {
    Constraint::commands(ComponentLimit::new(place, limit).expect("limits"))
}

fn norm(place: Place, limit: f64) -> Constraint {
    Constraint::commands(NormLimit::new(place, limit).expect("a limit"))
}

/// Only a row that forbids a single command to be negative makes it one-sided.
#[test]
fn one_sided_commands_have_a_row_of_their_own() {
    let [own, other] = [0, 1].map(|i| (std::array::from_fn(|j| f64::from(u8::from(i == j))), 1.0));
    let actuation = Actuation::actuators(&[own, other]).expect("actuators");
    let limit = CommandLimit::new(&[0.5; 2]).expect("limits").one_sided();
    let limit = Constraint::commands(limit);
    let of = |constraint: Constraint| compile(constraint, &actuation).one_sided();
    assert_eq!(of(limit.clone())[..3], [true, true, false]);
    let priced = limit.clone().priced(1.0).expect("a price");
    assert!(!of(priced).contains(&true));
    let mut set = compile(limit, &actuation);
    let sum = -Command::from_fn(|i, _| if i < 2 { 1.0 } else { 0.0 });
    set.command = vec![CommandInequality::linear(sum, 0.0)];
    assert!(!set.one_sided().contains(&true));
}

#[test]
fn a_constraint_that_moves_keeps_its_price_later() {
    let sphere = KeepOutSphere::new(Vector3::x(), 0.5).expect("a sphere");
    let pose = |k: i32| FramePose {
        origin: f64::from(k) * Vector3::x(),
        rotation: Matrix3::identity(),
    };
    let poses: Vec<_> = (0..4).map(pose).collect();
    let moving = Moving::new(sphere, poses, 1.0).expect("a sphere that moves");
    let hard = Constraint::state(moving.clone());
    let priced = hard.clone().priced(3.0).expect("a price");
    let moved = Some(Constraint::state(moving.later(2.0)));
    assert_eq!(hard.later(4, 0.5), moved);
    let later = priced.later(4, 0.5).expect("a constraint");
    assert_eq!(
        (later.price(), Some(later.bare())),
        (Some(3.0), moved.as_ref())
    );
    assert_eq!(all(1.0).later(4, 0.5), Some(all(1.0)));
    let during = priced.during(3..9).expect("steps");
    let later = during.later(4, 0.5).expect("a constraint");
    assert_eq!((later.steps(), later.price()), (Some(0..5), Some(3.0)));
    assert_eq!(Some(later.bare()), moved.as_ref());
    assert_eq!(during.later(9, 0.5), None);
    let both = during.clone().during(5..20).expect("steps");
    assert_eq!((both.steps(), both.price()), (Some(5..9), Some(3.0)));
    let error = during.during(9..12).expect_err("no step");
    assert_eq!(error.name, "steps");
}

/// What the region says of a state, in words that are not those of `g`.
fn allows(region: &Region, state: &BodyState) -> bool {
    let (x, turn) = (&state.position, &state.attitude);
    let seen = |axis: &Vector3<f64>, point: &Vector3<f64>| (turn * axis).angle(&(point - x));
    match region {
        Region::OutsideEllipsoid {
            center,
            semi_axes,
            axes,
        } => {
            let arm = axes.transpose() * (x - center);
            arm.component_div(semi_axes).norm() >= 1.0
        }
        Region::InsideSphere { center, radius } => (x - center).norm() <= *radius,
        Region::Corridor {
            apex,
            axis,
            half_angle,
        } => (x - apex).angle(axis) <= *half_angle,
        Region::OutsideCone {
            axis,
            direction,
            half_angle,
        } => (turn * axis).angle(direction) >= *half_angle,
        Region::InSight {
            axis,
            point,
            half_angle,
        } => seen(axis, point) <= *half_angle,
        Region::OutsidePlume {
            axis,
            point,
            half_angle,
            distance,
        } => seen(axis, point) >= *half_angle || (point - x).norm() >= *distance,
        // For a body whose mass and moments of inertia are 1.
        Region::AngularRate { axis: None, limit } => state.angular_momentum.norm() <= *limit,
        Region::AngularRate {
            axis: Some(axis),
            limit,
        } => state.angular_momentum.dot(axis).abs() <= *limit,
        Region::Speed { frame, limit } => {
            let arm = x - frame.pose.origin;
            let there = frame.velocity + frame.turn.cross(&arm);
            (state.linear_momentum - there).norm() <= *limit
        }
    }
}

/// Constraints on states of every kind, with some numbers.
fn of_states(vector: &mut impl FnMut() -> Vector3<f64>) -> Vec<(Constraint, Constraint)> {
    let inertia = Inertia::new(Matrix3::identity()).expect("moments of inertia");
    let poses: Vec<_> = (0..4)
        .map(|_| FrameMotion {
            pose: FramePose {
                origin: vector(),
                rotation: exp(&vector()),
            },
            velocity: 0.3 * vector(),
            turn: 0.3 * vector(),
        })
        .collect();
    let mut both = Vec::new();
    macro_rules! kinds {
        ($($constraint:expr),* $(,)?) => {
            $(
                let constraint = $constraint.expect("a constraint");
                let moving = Moving::new(constraint, poses.clone(), 1.0).expect("one that moves");
                both.push((Constraint::state(constraint), Constraint::state(moving)));
            )*
        };
    }
    kinds!(
        KeepOutSphere::new(vector(), 0.8),
        KeepInSphere::new(vector(), 1.2),
        KeepOutEllipsoid::new(vector(), Vector3::new(0.5, 1.0, 1.5), exp(&vector())),
        Corridor::new(vector(), vector(), 0.9),
        KeepOutCone::new(vector(), vector(), 1.2),
        LineOfSight::new(vector(), vector(), 1.2),
        Plume::new(vector(), vector(), 1.4, 1.5),
        AngularRate::new(0.8, &inertia),
        AngularRate::new(0.5, &inertia).and_then(|rate| rate.about(vector())),
        Speed::new(0.8, 1.0),
    );
    both
}

/// The region has a state if and only if `g` allows it: of a frame at rest, and of one that moves, at its ends of intervals.
#[test]
fn regions_are_the_states_that_constraints_allow() {
    let mut rng = fastrand::Rng::with_seed(9);
    let mut vector = move || Vector3::from_fn(|_, _| 2.0 * rng.f64() - 1.0);
    for (fixed, moving) in of_states(&mut vector) {
        let mut counts = [0; 2];
        for trial in 0..400 {
            let state = BodyState {
                position: vector(),
                linear_momentum: vector(),
                attitude: exp(&(3.0 * vector())),
                angular_momentum: vector(),
            };
            let time = f64::from(trial % 4);
            for (constraint, time) in [(&fixed, f64::INFINITY), (&moving, time)] {
                let Constraint::State(of_state) = constraint else {
                    panic!("{constraint:?}");
                };
                let placed = of_state.at(time);
                let g = placed.as_ref().unwrap_or(of_state).value(&state);
                let region = constraint.region_at(time).expect("a region");
                // The rounded edge of a plume.
                if g.abs() < 1e-5 {
                    continue;
                }
                assert_eq!(allows(&region, &state), g < 0.0, "{constraint:?}: {g}");
                counts[usize::from(g < 0.0)] += 1;
            }
        }
        assert!(
            counts.iter().all(|count| *count > 20),
            "{fixed:?}: {counts:?}"
        );
        let soft = moving.clone().priced(1.0).expect("a price");
        assert_eq!(soft.region_at(2.0), moving.region_at(2.0));
        if !matches!(fixed.region(), Some(Region::Speed { .. })) {
            assert_eq!(moving.region(), fixed.region());
        }
    }
    assert_eq!(all(1.0).region(), None);
}
