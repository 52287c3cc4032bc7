//! The derivatives of steps against automatic differentiation of steps written anew, from potentials alone.

mod model;

use lgvi_dynamics::BodyState;
use nalgebra::{SMatrix, SVector};
use num_dual::HyperDual64;

use self::model::{Scene, State, scenes};
use super::{Curvature, KickDriftKick, Linearisation, Steps};
use crate::problem::Dynamics;

fn random<const N: usize>(rng: &mut fastrand::Rng, scale: f64) -> SVector<f64, N> {
    SVector::from_fn(|_, _| scale * (2.0 * rng.f64() - 1.0))
}

/// Asserts that `found` is `expected` to 1e-12 of its largest entry.
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

/// First derivatives and those of `λ·Φ` twice by all `X` coordinates of state and `U` commands.
fn differentiated<const X: usize, const U: usize>(
    lambda: &SVector<f64, X>,
    step: impl Fn([HyperDual64; X], [HyperDual64; U]) -> [HyperDual64; X],
) -> (Linearisation<X, U>, Curvature<X, U>) {
    let mut first = Linearisation::<X, U> {
        a: SMatrix::zeros(),
        b: SMatrix::zeros(),
    };
    let mut second = Curvature::<X, U> {
        state: SMatrix::zeros(),
        mixed: SMatrix::zeros(),
        command: SMatrix::zeros(),
    };
    for i in 0..X + U {
        for j in 0..X + U {
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
                (true, true) => second.state[(i, j)] = curved,
                (true, false) => second.mixed[(i, j - X)] = curved,
                (false, true) => continue,
                (false, false) => second.command[(i - X, j - X)] = curved,
            }
            if i < X {
                first.a.set_column(i, &column);
            } else {
                first.b.set_column(i - X, &column);
            }
        }
    }
    (first, second)
}

fn found<const X: usize, const U: usize>(
    steps: &impl Steps<X, U>,
    k: usize,
    state: &BodyState,
    command: &SVector<f64, U>,
    lambda: &SVector<f64, X>,
) -> (BodyState, Linearisation<X, U>, Curvature<X, U>) {
    let unset = f64::NAN;
    let mut first = Linearisation::<X, U> {
        a: SMatrix::repeat(unset),
        b: SMatrix::repeat(unset),
    };
    let mut second = Curvature::<X, U> {
        state: SMatrix::repeat(unset),
        mixed: SMatrix::repeat(unset),
        command: SMatrix::repeat(unset),
    };
    let next = steps.next(k, state, command).unwrap();
    let end = steps.linearise(k, state, command, &mut first).unwrap();
    assert_eq!(next, end);
    steps
        .curvature(k, state, command, lambda, &mut second)
        .unwrap();
    (end, first, second)
}

fn assert_same<const X: usize, const U: usize>(
    found: &(Linearisation<X, U>, Curvature<X, U>),
    expected: &(Linearisation<X, U>, Curvature<X, U>),
    what: &str,
) {
    assert_close(&found.0.a, &expected.0.a, &format!("{what}, A"));
    assert_close(&found.0.b, &expected.0.b, &format!("{what}, B"));
    let [found, expected] = [&found.1, &expected.1];
    assert_eq!(found.state, found.state.transpose(), "{what}");
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
    for scene in scenes(&mut rng) {
        for dynamics in SCHEMES {
            let Scene { name, state, .. } = &scene;
            let transfer = scene.transfer(dynamics);
            let steps = KickDriftKick::full(&transfer);
            let (command, lambda) = (random::<6>(&mut rng, 0.5), random::<12>(&mut rng, 1.0));
            let (end, first, second) = found(&steps, 0, state, &command, &lambda);
            let load = transfer.actuation.matrix();
            let expected = differentiated::<12, 6>(&lambda, |z, v| {
                let control = std::array::from_fn(|row| {
                    (0..6).fold(HyperDual64::from(0.0), |sum, column| {
                        sum + (v[column] + command[column]) * load[(row, column)]
                    })
                });
                let moved = State::moved(state, z);
                scene.step(dynamics, moved, control).minus(&end)
            });
            assert_same(
                &(first, second),
                &expected,
                &format!("{name}, {dynamics:?}"),
            );
        }
    }
}
