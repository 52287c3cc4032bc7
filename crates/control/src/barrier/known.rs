use lgvi_dynamics::rotation::Unsolvable;
use nalgebra::SVector;

use crate::discrete::{DiscreteDynamics, Linearization};
use crate::newton::{Iterate, Problem};

/// The contribution of inequalities to the gradient of the Lagrangian at an interval.
#[derive(Clone, Debug)]
pub(crate) struct Force<const X: usize, const U: usize> {
    /// `Σ y ∂g/∂z` by the state at the end of the interval.
    pub(super) state: SVector<f64, X>,
    /// `Σ y ∂g/∂w` by the command of the interval.
    pub(crate) command: SVector<f64, U>,
}

/// The contributions that inequalities must make to the gradient of the Lagrangian for `iterate` to be stationary with
/// `costates`. For the state at the end of an interval it is `λ_k − Aᵀ λ_{k+1}`, except at the last state, where the
/// terminal conditions contribute. For the command it is `−(h W w + Bᵀ λ_k)`.
pub(crate) fn forces<S, E, const X: usize, const U: usize>(
    problem: &Problem<'_, S, E, X, U>,
    iterate: &Iterate<X, U>,
    costates: &[SVector<f64, X>],
) -> Result<Vec<Force<X, U>>, Unsolvable>
where
    S: DiscreteDynamics<X, U>,
{
    let inputs = problem.steps.inputs();
    let mut dynamics = Linearization::default();
    let none = Force {
        state: SVector::zeros(),
        command: SVector::zeros(),
    };
    let mut forces = vec![none; costates.len()];
    let weight = problem.h * problem.weight;
    for (k, costate) in costates.iter().enumerate() {
        let command = &iterate.commands[k];
        problem
            .steps
            .linearize(k, &iterate.states[k], command, &mut dynamics)?;
        let (before, by_command) = dynamics.backward(&inputs, costate);
        forces[k].command = -(weight * command + by_command);
        if k > 0 {
            forces[k - 1].state = costates[k - 1] - before;
        }
    }
    Ok(forces)
}
