//! The model's derivatives by the step size compared with neighboring plans.

use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::{BodyState, Inertia, PointMass, RigidBody};
use lgvi_lie::exp;
use nalgebra::{Matrix3, Vector3};

use super::*;
use crate::newton::Unconstrained;
use crate::problem::FEW;
use crate::solver::class::{Both, Rotation, Translation};
use crate::solver::solve_in_own_units;
use crate::{Actuation, Dynamics, Motion, NewtonSettings, Start};

const N: usize = 20;

/// A spinning body near the center of gravity, in its own units.
fn transfer(h: f64, motion: Motion, dynamics: Dynamics) -> Transfer {
    let inertia = Inertia::principal([0.3, 0.4, 0.6]).unwrap();
    let arm = Vector3::new(0.3, 0.1, -0.2);
    let points = [arm, -arm].map(|position| PointMass {
        mass: 0.5,
        position,
    });
    // Without coupling, a half is planned alone.
    let points = match motion {
        Motion::Full => points.to_vec(),
        _ => Vec::new(),
    };
    let body = RigidBody::new(1.0, inertia, points).unwrap();
    let weight = Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 3.0));
    let state = |x: f64, angle: f64| BodyState {
        position: Vector3::new(x, 0.4 * angle, -0.2),
        linear_momentum: Vector3::new(0.1, 0.8, 0.2),
        attitude: exp(&Vector3::new(0.3, angle, 0.8)),
        angular_momentum: Vector3::new(0.05, -0.2 * angle, 0.3),
    };
    let actuation = Actuation::full(&weight, &weight).unwrap();
    let (from, to) = (state(1.0, -0.5), state(1.3, 0.6));
    Transfer::new(body, Central { gm: 1.0 }, h, N, from, to, actuation)
        .unwrap()
        .with_motion(motion)
        .with_dynamics(dynamics)
}

fn plan(transfer: &Transfer) -> Plan {
    let settings = NewtonSettings::default();
    solve_in_own_units(transfer, Start::Cold, &settings, |_| true).unwrap()
}

/// `dJ/dh` and `d²J/dh²` of a plan by the model.
fn modeled<C, const X: usize, const U: usize>(class: C, transfer: &Transfer) -> [f64; 2]
where
    C: Class<X, U>,
{
    let plan = plan(transfer);
    let mut observe = |_: &crate::Progress| true;
    let solver = Solver::new(class, transfer, &NewtonSettings::default(), &mut observe);
    let by = transfer.h * DIFFERENCE;
    let sides = [-by, by].map(|by| Transfer {
        h: transfer.h + by,
        ..transfer.clone()
    });
    let steps = solver.class.steps(transfer).unwrap();
    let beside = sides
        .each_ref()
        .map(|side| solver.class.steps(side).unwrap());
    let mut problem = solver.problem(transfer, &steps);
    problem.beside = Some(Beside {
        steps: [&beside[0], &beside[1]],
        by,
        attitude: C::OFFSETS[1],
    });
    let mut newton = Newton::new(N, solver.resampled(&plan).unwrap());
    let mut settings = ModelSettings {
        curvature: 1.0,
        augmentation: AUGMENTATIONS[0],
        damping: 0.0,
        gains: None,
    };
    let solved = newton.model_convex(&problem, &mut Unconstrained, &mut settings);
    assert_eq!((solved, settings.curvature), (Ok(()), 1.0));
    newton.model.reduced().unwrap().0
}

#[test]
fn slope_and_curvature_are_those_of_the_least_costs_of_neighboring_step_sizes() {
    let h = 0.08;
    for motion in [Motion::Full, Motion::Translation, Motion::Rotation] {
        for dynamics in [Dynamics::LieEuler, Dynamics::Lgvi] {
            let at = |h: f64| transfer(h, motion, dynamics);
            let [slope, curvature] = match motion {
                Motion::Full => modeled(Both::<FEW>, &at(h)),
                Motion::Translation => {
                    let class = Translation::of(&at(h).actuation).unwrap();
                    modeled(class, &at(h))
                }
                Motion::Rotation => {
                    let class = Rotation::of(&at(h).actuation).unwrap();
                    modeled(class, &at(h))
                }
            };
            let step = 0.01 * h;
            let cost = |times: f64| plan(&at(h + times * step)).cost;
            let here = cost(0.0);
            let odd = |times: f64| cost(times) - cost(-times);
            let even = |times: f64| cost(times) + cost(-times) - 2.0 * here;
            let slopes = [slope, (8.0 * odd(1.0) - odd(2.0)) / (12.0 * step)];
            let curvatures = [
                curvature,
                (16.0 * even(1.0) - even(2.0)) / (12.0 * step * step),
            ];
            println!("{motion:?}, {dynamics:?}: {slopes:?}, {curvatures:?}");
            assert!((slopes[0] / slopes[1] - 1.0).abs() < 1e-6, "{slopes:?}");
            assert!(
                (curvatures[0] / curvatures[1] - 1.0).abs() < 1e-6,
                "{curvatures:?}"
            );
        }
    }
}
