//! The extremal and its sensitivity compared with automatic differentiation of an independent implementation.

use nalgebra::SVector;
use num_dual::{Dual, Dual64};

use crate::discrete::tests::model::{Scene, State, scenes};
use crate::problem::{Dynamics, Vector12};
use crate::shooting::{integrate, integrate_with_sensitivity};
use crate::{Actuation, Transfer};
use nalgebra::{Matrix3, SMatrix};

/// The solution `λ` of `Aᵀ λ = μ` by elimination with row exchanges, where `A` is the derivative of the step from
/// `state` with any control.
fn multipliers(scene: &Scene, state: &State<Dual64>, mu: [Dual64; 12]) -> [Dual64; 12] {
    let lift = Dual::<Dual64, f64>::from_re;
    let begin = state.map(lift);
    let no_control = [lift(Dual64::from(0.0)); 6];
    let end = scene.step(Dynamics::LieEuler, begin, no_control);
    let end = end.map(|entry| lift(entry.re));
    let mut rows: [[Dual64; 13]; 12] = std::array::from_fn(|column| {
        let unit = |i: usize| f64::from(u8::from(i == column));
        let z = std::array::from_fn(|i| Dual::new(0.0.into(), unit(i).into()));
        let moved = scene.step(Dynamics::LieEuler, begin.moved(z), no_control);
        let z = moved.minus(&end);
        std::array::from_fn(|i| if i < 12 { z[i].eps } else { mu[column] })
    });
    for pivot in 0..12 {
        let size = |row: &usize| rows[*row][pivot].re.abs();
        let largest = (pivot..12)
            .max_by(|a, b| size(a).total_cmp(&size(b)))
            .unwrap();
        rows.swap(pivot, largest);
        let top = rows[pivot];
        for (index, row) in rows.iter_mut().enumerate() {
            if index != pivot {
                let factor = row[pivot] / top[pivot];
                for column in pivot..13 {
                    row[column] -= factor * top[column];
                }
            }
        }
    }
    std::array::from_fn(|i| rows[i][12] / rows[i][i])
}

/// The end of the extremal from `λ_0`, with steps and multiplier equations computed from potentials only.
fn end(
    scene: &Scene,
    transfer: &Transfer,
    gains: &[Matrix3<f64>; 2],
    lambda0: [Dual64; 12],
) -> State<Dual64> {
    let mut state = State::of(&scene.state);
    let mut lambda = lambda0;
    for step in 0..transfer.intervals {
        if step > 0 {
            lambda = multipliers(scene, &state, lambda);
        }
        let control = std::array::from_fn(|i| {
            let gain = &gains[i / 3];
            (0..3).fold(Dual64::from(0.0), |sum, j| {
                sum - lambda[3 + 6 * (i / 3) + j] * gain[(i % 3, j)]
            })
        });
        state = scene.step(Dynamics::LieEuler, state, control);
    }
    state
}

#[test]
fn extremals_and_their_sensitivities_are_those_of_equations_made_of_potentials() {
    let mut rng = fastrand::Rng::with_seed(35);
    let mut worst = 0.0_f64;
    for scene in scenes(&mut rng) {
        let weight = |s: f64| Matrix3::new(s, 0.3, 0.0, 0.3, 2.0 * s, 0.1, 0.0, 0.1, s);
        let actuation = Actuation::full(&weight(1.3), &weight(2.1)).unwrap();
        let transfer = scene.transfer_by(actuation);
        let gains = *transfer.gains().unwrap();
        let lambda0 = Vector12::from_fn(|_, _| 0.03 * (2.0 * rng.f64() - 1.0));
        let (extremal, exact) = integrate_with_sensitivity(&transfer, &lambda0).unwrap();
        assert_eq!(integrate(&transfer, &lambda0).unwrap(), extremal);
        let reached = State::<Dual64>::of(extremal.end());
        let mut expected = SMatrix::<f64, 12, 12>::zeros();
        for axis in 0..12 {
            let unit = |i: usize| f64::from(u8::from(i == axis));
            let along = std::array::from_fn(|i| Dual64::new(lambda0[i], unit(i)));
            let missed = end(&scene, &transfer, &gains, along).minus(&reached);
            let apart = missed
                .iter()
                .fold(0.0_f64, |most, part| most.max(part.re.abs()));
            assert!(apart < 1e-13, "{}: {apart:e}", scene.name);
            expected.set_column(axis, &SVector::from(missed.map(|part| part.eps)));
        }
        let error = (exact - expected).amax() / expected.amax();
        worst = worst.max(error);
        assert!(error < 1e-12, "{}: off by {error:e}", scene.name);
    }
    println!("largest relative error {worst:.1e}");
}
