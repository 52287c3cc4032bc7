//! The derivative by the step size compared with finite differences.

use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::{Inertia, PointMass, RigidBody};
use nalgebra::{Matrix3, Vector3};

use super::*;
use crate::discrete::tests::model::drag;
use crate::{Actuation, Certificate};

const N: usize = 12;

fn transfer(h: f64, motion: Motion, dynamics: Dynamics) -> Transfer {
    let inertia = Inertia::principal([0.03, 0.08, 0.09]).unwrap();
    let arm = Vector3::new(0.3, 0.1, -0.2);
    let points = [arm, -arm].map(|position| PointMass {
        mass: 0.7,
        position,
    });
    let body = RigidBody::new(1.4, inertia, points.to_vec()).unwrap();
    let weight = Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 3.0));
    let state = BodyState {
        position: Vector3::new(1.0, 0.1, -0.2),
        linear_momentum: Vector3::new(0.1, 1.3, 0.2),
        attitude: lgvi_lie::exp(&Vector3::new(0.3, -0.5, 0.8)),
        angular_momentum: Vector3::new(0.05, -0.04, 0.06),
    };
    let actuation = Actuation::full(&weight, &weight).unwrap();
    Transfer::new(body, Central { gm: 1.0 }, h, N, state, state, actuation)
        .unwrap()
        .with_motion(motion)
        .with_dynamics(dynamics)
}

/// Numbers without a pattern.
fn wave<const D: usize>(seed: usize) -> SVector<f64, D> {
    SVector::from_fn(|i, _| libm::sin((7 * seed + 3 * i) as f64 + 0.4))
}

/// An operation on the steps of any motion.
trait Visit {
    fn visit<S: DiscreteDynamics<X, U>, const X: usize, const U: usize>(
        &mut self,
        steps: &S,
        first: usize,
        narrowed: &dyn Fn(&Command) -> SVector<f64, U>,
    );
}

fn with_steps(transfer: &Transfer, visit: &mut impl Visit) {
    let actuation = &transfer.actuation;
    match transfer.motion {
        Motion::Full => {
            let steps = KickDriftKick::<_, 2, MAX_COMMANDS>::full(transfer);
            visit.visit(&steps, 0, &|w| *w);
        }
        Motion::Translation => {
            let commands = DecoupledCommands::forces(actuation).unwrap();
            let steps = KickDriftKick::translation(transfer, &commands).unwrap();
            visit.visit(&steps, 0, &|w| commands.narrowed(w));
        }
        Motion::Rotation => {
            let commands = DecoupledCommands::moments(actuation).unwrap();
            let steps = KickDriftKick::rotation(transfer, &commands).unwrap();
            visit.visit(&steps, 6, &|w| commands.narrowed(w));
        }
    }
}

/// Flies the plan's commands.
struct Fly<'p>(&'p mut Plan);

impl Visit for Fly<'_> {
    fn visit<S: DiscreteDynamics<X, U>, const X: usize, const U: usize>(
        &mut self,
        steps: &S,
        _: usize,
        narrowed: &dyn Fn(&Command) -> SVector<f64, U>,
    ) {
        let Plan {
            states, commands, ..
        } = &mut *self.0;
        for (k, command) in commands.iter().enumerate() {
            states.push(steps.next(k, &states[k], &narrowed(command)).unwrap());
        }
    }
}

/// `Σ λ · Φ(s, w)` at fixed states, up to a constant.
struct Product<'p>(&'p Plan, f64);

impl Visit for Product<'_> {
    fn visit<S: DiscreteDynamics<X, U>, const X: usize, const U: usize>(
        &mut self,
        steps: &S,
        first: usize,
        narrowed: &dyn Fn(&Command) -> SVector<f64, U>,
    ) {
        let plan = self.0;
        for (k, command) in plan.commands.iter().enumerate() {
            let next = steps.next(k, &plan.states[k], &narrowed(command)).unwrap();
            let z = steps.difference(&plan.states[k + 1], &next);
            self.1 += plan.multipliers[k].fixed_rows::<X>(first).dot(&z);
        }
    }
}

/// For a flight with arbitrary commands and multipliers, the derivative of the Lagrangian agrees with central
/// differences of sixth order.
#[test]
fn the_derivative_of_the_lagrangian_is_that_of_differences() {
    let h = 0.08;
    let column = |i: usize| (wave::<6>(200 + i).into(), 1.0 + i as f64);
    let columns: Vec<_> = (0..8).map(column).collect();
    let thrusters = Actuation::actuators(&columns).unwrap().fixed_to_body();
    for (motion, commanded, planned, actuation, in_air) in [
        (Motion::Full, 0..6, 0..12, None, false),
        (Motion::Full, 0..6, 0..12, None, true),
        (Motion::Full, 0..8, 0..12, Some(&thrusters), false),
        (Motion::Translation, 0..3, 0..6, None, false),
        (Motion::Translation, 0..3, 0..6, None, true),
        (Motion::Rotation, 3..6, 6..12, None, false),
        (Motion::Rotation, 3..6, 6..12, None, true),
    ] {
        for dynamics in [Dynamics::LieEuler, Dynamics::Lgvi] {
            let at = |h: f64| {
                let mut transfer = transfer(h, motion, dynamics);
                if let Some(actuation) = actuation {
                    transfer.actuation.clone_from(actuation);
                }
                if in_air {
                    transfer.body = transfer.body.with_drag(drag());
                }
                transfer
            };
            let command = |k: usize| {
                let wave = 0.05 * wave::<MAX_COMMANDS>(k);
                SVector::from_fn(|i, _| if commanded.contains(&i) { wave[i] } else { 0.0 })
            };
            let multipliers = |k: usize| {
                let wave = wave::<12>(100 + k);
                SVector::from_fn(|i, _| if planned.contains(&i) { wave[i] } else { 0.0 })
            };
            let mut plan = Plan {
                h,
                states: vec![at(h).initial],
                controls: Vec::new(),
                commands: (0..N).map(command).collect(),
                multipliers: (0..N).map(multipliers).collect(),
                feedback: Vec::new(),
                actuator_feedback: Vec::new(),
                sweep: crate::Sweep::default(),
                cost: 0.0,
                paid: 0.0,
                certificate: Certificate::default(),
            };
            with_steps(&at(h), &mut Fly(&mut plan));
            let value = |h: f64| {
                let transfer = at(h);
                let mut product = Product(&plan, 0.0);
                with_steps(&transfer, &mut product);
                let costs = plan.commands.iter().map(|w| transfer.actuation.cost(h, w));
                costs.sum::<f64>() + product.1
            };
            let step = 3e-4;
            let pair = |times: f64| value(h + times * step) - value(h - times * step);
            let difference = (45.0 * pair(1.0) - 9.0 * pair(2.0) + pair(3.0)) / (60.0 * step);
            let exact = by_step(&at(h), &plan).unwrap();
            let error = (exact / difference - 1.0).abs();
            assert!(
                error < 1e-10,
                "{motion:?}, {dynamics:?}: {exact} for {difference}"
            );
        }
    }
}
