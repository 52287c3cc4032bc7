//! Extremals: trajectories that satisfy the discrete necessary conditions (4.19)–(4.26), integrated forward from the
//! initial state and multipliers.

use lgvi_dynamics::rotation::Unsolvable;
use lgvi_dynamics::{BodyState, Load};
use nalgebra::{Matrix3, SMatrix, SVector};
use thiserror::Error;

use super::step::{Sensitivity, Step};
use crate::problem::{Vector12, block, stacked};
use crate::{Command, Transfer};

/// The reason why an extremal does not reach its end.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ExtremalError {
    /// The transfer is not covered by the conditions (4.19)–(4.26).
    #[error(
        "shooting plans the full motion by Lie–Euler steps, with force and moment as commands, without drag and \
         inequalities, to one state"
    )]
    Unsupported,
    /// The body turns too far in one step.
    #[error("step {step}: {source}")]
    Unsolvable {
        /// The step, from 0.
        step: usize,
        /// The turn that is too large.
        source: Unsolvable,
    },
    /// The state or the multipliers overflow, or the multiplier equation is singular.
    #[error("step {step}: the state or the multipliers are not finite")]
    NotFinite {
        /// The step, from 0.
        step: usize,
    },
}

/// An extremal from given initial multipliers.
#[derive(Clone, Debug, PartialEq)]
pub struct Extremal {
    /// States at `0 … N`.
    pub states: Vec<BodyState>,
    /// Controls `u_1 … u_N`.
    pub controls: Vec<Load>,
    /// Costate `λ_0 … λ_{N−1}`.
    pub multipliers: Vec<SVector<f64, 12>>,
    /// The objective.
    pub cost: f64,
}

impl Extremal {
    /// The final state.
    pub fn end(&self) -> &BodyState {
        &self.states[self.states.len() - 1]
    }
}

/// Integrates the necessary conditions from the initial multipliers `λ_0` (twelve, paired with `[δx, δγ, ζ, δΠ]`).
pub fn integrate(
    transfer: &Transfer,
    lambda0: &SVector<f64, 12>,
) -> Result<Extremal, ExtremalError> {
    sweep(transfer, lambda0, |_, _, _, _| ())
}

/// Integrates as [`integrate`] does and also returns the sensitivity `∂[x, γ, ζ, Π]_N / ∂λ_0` of the final state
/// (12×12; `Ψ₁₂` of (4.31)).
pub fn integrate_with_sensitivity(
    transfer: &Transfer,
    lambda0: &SVector<f64, 12>,
) -> Result<(Extremal, SMatrix<f64, 12, 12>), ExtremalError> {
    let mut sensitivity = Sensitivity::initial();
    let extremal = sweep(transfer, lambda0, |conditions, step, previous, lambda| {
        let before = (step > 0).then_some(previous);
        conditions.vary(before, lambda, &mut sensitivity);
    })?;
    let mut end = SMatrix::<f64, 12, 12>::zeros();
    for (which, rows) in sensitivity.state.iter().enumerate() {
        end.fixed_rows_mut::<3>(3 * which).copy_from(rows);
    }
    Ok((extremal, end))
}

/// Integrates the extremal. `visit` is called for each step with its index, the multipliers of the previous step and
/// its own.
fn sweep(
    transfer: &Transfer,
    lambda0: &Vector12,
    mut visit: impl FnMut(&Step<'_>, usize, &Vector12, &Vector12),
) -> Result<Extremal, ExtremalError> {
    let gains = transfer.gains().ok_or(ExtremalError::Unsupported)?;
    let mut states = Vec::with_capacity(transfer.intervals + 1);
    let mut controls = Vec::with_capacity(transfer.intervals);
    let mut multipliers = Vec::with_capacity(transfer.intervals);
    let mut cost = 0.0;
    let mut state = transfer.initial;
    let mut previous = *lambda0;
    states.push(state);
    for step in 0..transfer.intervals {
        let conditions = Step::new(transfer, gains, state)
            .map_err(|source| ExtremalError::Unsolvable { step, source })?;
        let lambda = if step == 0 {
            previous
        } else {
            conditions.multipliers(&previous)
        };
        visit(&conditions, step, &previous, &lambda);
        let control = control(gains, &lambda);
        state = conditions.next(&control);
        if !(state.is_finite() && control.is_finite()) {
            return Err(ExtremalError::NotFinite { step });
        }
        cost += transfer.actuation.cost(transfer.h, &command(&control));
        controls.push(control);
        multipliers.push(lambda);
        states.push(state);
        previous = lambda;
    }
    Ok(Extremal {
        states,
        controls,
        multipliers,
        cost,
    })
}

/// The optimal control for multipliers `λ_k`: `u_{k+1} = −[W_f⁻¹ λ², W_m⁻¹ λ⁴]` (4.24), (4.25).
fn control([force, moment]: &[Matrix3<f64>; 2], lambda: &Vector12) -> Load {
    Load {
        force: -force * block(lambda, 1),
        moment: -moment * block(lambda, 3),
    }
}

/// The command that is force and moment themselves.
fn command(load: &Load) -> Command {
    stacked(load).fixed_resize(0.0)
}
