//! The derivatives of steps compared with automatic differentiation of an independent implementation from potentials.

pub(crate) mod composed;
mod gyrostat;
pub(crate) mod model;

use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{BodyState, Method, Simulation, System};
use nalgebra::{SMatrix, SVector};
use num_dual::HyperDual64;

use self::composed::Composed;
use self::model::{Scene, State, scenes, scenes_in_air, scheme};
use super::{
    Curvature, DecoupledCommands, DecouplingError, DiscreteDynamics, KickDriftKick, Linearization,
};
use crate::Actuation;
use crate::problem::Dynamics;

fn random<const N: usize>(rng: &mut fastrand::Rng, scale: f64) -> SVector<f64, N> {
    SVector::from_fn(|_, _| scale * (2.0 * rng.f64() - 1.0))
}

/// Asserts that `found` agrees with `expected` to 1e-12 of its largest entry.
fn assert_close<const R: usize, const C: usize>(
    found: &SMatrix<f64, R, C>,
    expected: &SMatrix<f64, R, C>,
    what: &str,
) {
    let error = (found - expected).amax();
    assert!(
        error <= 1e-12 * expected.amax(),
        "{what}: off by {error:e} of {:e}",
        expected.amax()
    );
}

/// First derivatives of a step, and second derivatives of `λ·Φ`, by all `X` state coordinates and `U` commands.
fn differentiated<const X: usize, const U: usize>(
    lambda: &SVector<f64, X>,
    step: impl Fn([HyperDual64; X], [HyperDual64; U]) -> [HyperDual64; X],
) -> Composed<X, U> {
    let mut composed = Composed::<X, U>::zeros();
    for i in 0..X + U {
        for j in i..X + U {
            let part = |index: usize| {
                let one = |axis: usize| f64::from(u8::from(axis == index));
                HyperDual64::new(0.0, one(i), one(j), 0.0)
            };
            let end = step(
                std::array::from_fn(part),
                std::array::from_fn(|c| part(X + c)),
            );
            let column = SVector::<f64, X>::from_fn(|row, _| end[row].eps1);
            let curved = SVector::<f64, X>::from_fn(|row, _| end[row].eps1eps2).dot(lambda);
            match (i < X, j < X) {
                (true, true) => {
                    composed.state[(i, j)] = curved;
                    composed.state[(j, i)] = curved;
                }
                (true, false) => composed.mixed[(i, j - X)] = curved,
                (false, _) => {
                    composed.command[(i - X, j - X)] = curved;
                    composed.command[(j - X, i - X)] = curved;
                }
            }
            if i < X {
                composed.a.set_column(i, &column);
            } else {
                composed.b.set_column(i - X, &column);
            }
        }
    }
    composed
}

fn found<const X: usize, const U: usize>(
    steps: &impl DiscreteDynamics<X, U>,
    k: usize,
    state: &BodyState,
    command: &SVector<f64, U>,
    lambda: &SVector<f64, X>,
) -> (BodyState, Composed<X, U>) {
    let (mut first, mut second) = (Linearization::default(), Curvature::default());
    let next = steps.next(k, state, command).unwrap();
    let end = steps.linearize(k, state, command, &mut first).unwrap();
    assert_eq!(next, end);
    let linear = Composed::<X, U>::of(&steps.inputs(), &first, &second);
    let at_once = steps
        .expand(k, state, command, lambda, &mut first, &mut second)
        .unwrap();
    assert_eq!(at_once, end);
    let composed = Composed::<X, U>::of(&steps.inputs(), &first, &second);
    assert_eq!((linear.a, linear.b), (composed.a, composed.b));
    let (by_state, by_command) = first.backward(&steps.inputs(), lambda);
    assert_close(&by_state, &composed.a.tr_mul(lambda), "Aᵀ λ");
    assert_close(&by_command, &composed.b.tr_mul(lambda), "Bᵀ λ");
    (end, composed)
}

fn assert_same<const X: usize, const U: usize>(
    found: &Composed<X, U>,
    expected: &Composed<X, U>,
    what: &str,
) {
    assert_close(&found.a, &expected.a, &format!("{what}, A"));
    assert_close(&found.b, &expected.b, &format!("{what}, B"));
    assert_close(&found.state, &expected.state, &format!("{what}, by state"));
    assert_close(&found.mixed, &expected.mixed, &format!("{what}, mixed"));
    assert_close(
        &found.command,
        &expected.command,
        &format!("{what}, by command"),
    );
}

const SCHEMES: [Dynamics; 2] = [Dynamics::LieEuler, Dynamics::Lgvi];

#[test]
fn full_steps_have_the_derivatives_of_steps_made_of_potentials() {
    let mut rng = fastrand::Rng::with_seed(31);
    for scene in scenes_in_air(&mut rng) {
        for dynamics in SCHEMES {
            let Scene { name, state, .. } = &scene;
            let transfer = scene.transfer(dynamics);
            let steps = KickDriftKick::full(&transfer);
            let (command, lambda) = (random::<6>(&mut rng, 0.5), random::<12>(&mut rng, 1.0));
            let (end, derivatives) = found(&steps, 0, state, &command, &lambda);
            let load = transfer.actuation.matrix().fixed_columns::<6>(0).into();
            let expected = differentiated::<12, 6>(&lambda, |z, v| {
                let moved = State::of(state).moved(z);
                scene
                    .step(dynamics, moved, control(&load, &command, v))
                    .minus(&State::of(&end))
            });
            assert_same(&derivatives, &expected, &format!("{name}, {dynamics:?}"));
        }
    }
}

#[test]
fn forces_that_turn_with_the_body_have_the_derivatives_of_steps_made_of_potentials() {
    let mut rng = fastrand::Rng::with_seed(37);
    for scene in scenes_in_air(&mut rng).iter().step_by(5) {
        let columns: Vec<_> = (0..9)
            .map(|_| (random::<6>(&mut rng, 1.0).into(), 1.0 + rng.f64()))
            .collect();
        let thrusters = Actuation::actuators(&columns).unwrap().fixed_to_body();
        for dynamics in SCHEMES {
            let transfer = scene.transfer_by(thrusters.clone()).with_dynamics(dynamics);
            let steps = KickDriftKick::full(&transfer);
            let (command, lambda) = (random::<9>(&mut rng, 0.5), random::<12>(&mut rng, 1.0));
            let (end, derivatives) = found(&steps, 0, &scene.state, &command, &lambda);
            let load = thrusters.matrix().fixed_columns::<9>(0).into();
            let expected = differentiated::<12, 9>(&lambda, |z, v| {
                let load = control(&load, &command, v);
                let turned = |state: &State<HyperDual64>| {
                    let force = state.rotated([load[0], load[1], load[2]]);
                    std::array::from_fn(|i| if i < 3 { force[i] } else { load[i] })
                };
                let moved = State::of(&scene.state).moved(z);
                let next = scene.step_by(dynamics, moved, turned);
                next.minus(&State::of(&end))
            });
            let what = format!("{}, {dynamics:?}", scene.name);
            assert_same(&derivatives, &expected, &what);
        }
    }
}

/// The other half of the model is set to the free flight before each kick.
#[test]
fn halves_have_the_derivatives_of_steps_made_of_potentials() {
    let mut rng = fastrand::Rng::with_seed(32);
    for scene in scenes_in_air(&mut rng) {
        for dynamics in SCHEMES {
            let transfer = scene.transfer(dynamics);
            let what = format!("{}, {dynamics:?}", scene.name);
            let free = KickDriftKick::<_, 2, 6>::full(&transfer);
            let one = free.next(0, &scene.state, &SVector::zeros()).unwrap();
            let two = free.next(1, &one, &SVector::zeros()).unwrap();
            let history = [one, two].map(|state| State::of(&state));
            // Off the free flight in the planned half, and with an outdated other half.
            let state = free.moved(&one, &random(&mut rng, 0.05));
            let (command, lambda) = (random::<3>(&mut rng, 0.5), random::<6>(&mut rng, 1.0));

            let commands = DecoupledCommands::forces(&transfer.actuation).unwrap();
            let steps = KickDriftKick::translation(&transfer, &commands).unwrap();
            let (end, derivatives) = found(&steps, 1, &state, &command, &lambda);
            assert_eq!(
                (end.attitude, end.angular_momentum),
                (two.attitude, two.angular_momentum)
            );
            let expected = differentiated::<6, 3>(&lambda, |z, v| {
                let z = std::array::from_fn(|i| if i < 6 { z[i] } else { HyperDual64::from(0.0) });
                let mut moved = State::of(&state).moved(z);
                let forces = control(commands.matrix(), &command, v);
                let control = std::array::from_fn(|i| if i < 3 { forces[i] } else { 0.0.into() });
                let [before, after] = scheme(dynamics);
                (moved.r, moved.pi) = (history[0].r, history[0].pi);
                scene.kick(&mut moved, control, before);
                scene.glide(&mut moved);
                (moved.r, moved.pi) = (history[1].r, history[1].pi);
                scene.kick(&mut moved, control, after);
                let all = moved.minus(&State::of(&end));
                std::array::from_fn(|i| all[i])
            });
            assert_same(&derivatives, &expected, &format!("{what}, translation"));

            let commands = DecoupledCommands::moments(&transfer.actuation).unwrap();
            let steps = KickDriftKick::rotation(&transfer, &commands).unwrap();
            let (end, derivatives) = found(&steps, 1, &state, &command, &lambda);
            assert_eq!(
                (end.position, end.linear_momentum),
                (two.position, two.linear_momentum)
            );
            let expected = differentiated::<6, 3>(&lambda, |z, v| {
                let z = std::array::from_fn(|i| {
                    if i < 6 {
                        HyperDual64::from(0.0)
                    } else {
                        z[i - 6]
                    }
                });
                let mut moved = State::of(&state).moved(z);
                let moments = control(commands.matrix(), &command, v);
                let control =
                    std::array::from_fn(|i| if i < 3 { 0.0.into() } else { moments[i - 3] });
                let [before, after] = scheme(dynamics);
                (moved.x, moved.gamma) = (history[0].x, history[0].gamma);
                scene.kick(&mut moved, control, before);
                moved.turn(scene.body.inertia().matrix());
                (moved.x, moved.gamma) = (history[1].x, history[1].gamma);
                scene.kick(&mut moved, control, after);
                let all = moved.minus(&State::of(&end));
                std::array::from_fn(|i| all[i + 6])
            });
            assert_same(&derivatives, &expected, &format!("{what}, rotation"));
        }
    }
}

/// `B (w + v)`.
fn control<const R: usize, const U: usize>(
    columns: &SMatrix<f64, R, U>,
    command: &SVector<f64, U>,
    v: [HyperDual64; U],
) -> [HyperDual64; R] {
    std::array::from_fn(|row| {
        (0..U).fold(HyperDual64::from(0.0), |sum, column| {
            sum + (v[column] + command[column]) * columns[(row, column)]
        })
    })
}

/// The propagator's integrator leads from a plan's controls to the plan's states.
#[test]
fn propagators_fly_the_same_steps() {
    let mut rng = fastrand::Rng::with_seed(33);
    for scene in scenes_in_air(&mut rng) {
        for dynamics in SCHEMES {
            let rotor = Rotor::default();
            let method = match dynamics {
                Dynamics::LieEuler => Method::LieEuler(rotor),
                Dynamics::Lgvi => Method::Lgvi(rotor),
            };
            let transfer = scene.transfer(dynamics);
            let steps = KickDriftKick::full(&transfer);
            let system = System::new(vec![scene.body.clone()], vec![Box::new(scene.field())]);
            let mut flight =
                Simulation::new(system, vec![scene.state], method, transfer.h).unwrap();
            let mut state = scene.state;
            let mut furthest = 0.0_f64;
            for k in 0..5 {
                let command = random::<6>(&mut rng, 0.1);
                state = steps.next(k, &state, &command).unwrap();
                flight
                    .advance(&[transfer.actuation.load(&command.fixed_resize(0.0))])
                    .unwrap();
                let apart = steps.difference(&flight.states()[0], &state).amax();
                furthest = furthest.max(apart);
            }
            assert!(
                furthest < 2e-13,
                "{}, {dynamics:?}: {furthest:e}",
                scene.name
            );
        }
    }
}

#[test]
fn moving_by_the_difference_arrives() {
    let mut rng = fastrand::Rng::with_seed(34);
    let scene = &scenes(&mut rng)[0];
    let transfer = scene.transfer(Dynamics::Lgvi);
    let full = KickDriftKick::<_, 2, 6>::full(&transfer);
    let forces = DecoupledCommands::forces(&transfer.actuation).unwrap();
    let moments = DecoupledCommands::moments(&transfer.actuation).unwrap();
    let translation = KickDriftKick::translation(&transfer, &forces).unwrap();
    let rotation = KickDriftKick::rotation(&transfer, &moments).unwrap();
    for _ in 0..20 {
        let z = random::<12>(&mut rng, 1.0);
        let halves = [0, 6].map(|row| z.fixed_rows::<6>(row).into_owned());
        let there = full.moved(&scene.state, &z);
        assert!((full.difference(&scene.state, &there) - z).amax() < 1e-14);
        let part = translation.moved(&scene.state, &halves[0]);
        assert!((translation.difference(&scene.state, &part) - halves[0]).amax() < 1e-14);
        let whole = rotation.moved(&part, &halves[1]);
        assert!((rotation.difference(&part, &whole) - halves[1]).amax() < 1e-14);
        assert_eq!(whole, there);
    }
}

#[test]
fn a_free_flight_that_turns_too_far_is_an_error_with_its_step() {
    let mut rng = fastrand::Rng::with_seed(36);
    let mut transfer = scenes(&mut rng)[0].transfer(Dynamics::LieEuler);
    let forces = DecoupledCommands::forces(&transfer.actuation).unwrap();
    transfer.initial.angular_momentum *= 100.0;
    let steps = KickDriftKick::translation(&transfer, &forces);
    assert!(matches!(
        steps.err(),
        Some(DecouplingError::Unsolvable { step: 0, source }) if source.turn > 1.0
    ));
    transfer.initial.angular_momentum.fill(0.0);
    transfer.initial.position.fill(0.0);
    transfer.initial.linear_momentum.fill(0.0);
    let steps = KickDriftKick::translation(&transfer, &forces);
    assert!(matches!(
        steps.err(),
        Some(DecouplingError::NotFinite { .. })
    ));
}
