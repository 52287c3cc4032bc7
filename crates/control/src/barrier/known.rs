use lgvi_dynamics::rotation::Unsolvable;
use nalgebra::{SMatrix, SVector};

use crate::newton::{Iterate, Problem};
use crate::steps::{Linearisation, Steps};

/// What inequalities must add to the gradient of the Lagrangian where `iterate` is stationary with `costates`: by each
/// interval's last state `λ_k − Aᵀ λ_{k+1}`, but for the terminal conditions' at the end, and by its command
/// `−(h W w + Bᵀ λ_k)`.
pub(crate) fn forces<S, E, const X: usize, const U: usize>(
    problem: &Problem<'_, S, E, X, U>,
    iterate: &Iterate<X, U>,
    costates: &[SVector<f64, X>],
) -> Result<Vec<(SVector<f64, X>, SVector<f64, U>)>, Unsolvable>
where
    S: Steps<X, U>,
{
    let mut dynamics = Linearisation {
        a: SMatrix::zeros(),
        b: SMatrix::zeros(),
    };
    let mut forces = vec![(SVector::zeros(), SVector::zeros()); costates.len()];
    let weight = problem.h * problem.weight;
    for (k, costate) in costates.iter().enumerate() {
        let command = &iterate.commands[k];
        problem
            .steps
            .linearise(k, &iterate.states[k], command, &mut dynamics)?;
        forces[k].1 = -(weight * command + dynamics.b.tr_mul(costate));
        if k > 0 {
            forces[k - 1].0 = costates[k - 1] - dynamics.a.tr_mul(costate);
        }
    }
    Ok(forces)
}
