//! The discrete dynamics with exact first and second derivatives, for the structured solver.

mod commands;
mod coordinates;
mod decoupled;
mod derivatives;
mod drift;
mod kick;
mod kick_drift_kick;
#[cfg(test)]
pub(crate) mod tests;

use lgvi_dynamics::BodyState;
use lgvi_dynamics::rotation::Unsolvable;
use nalgebra::{SMatrix, SVector};

pub(crate) use self::{
    commands::DecoupledCommands,
    coordinates::{Coordinates, Full},
    decoupled::{DecouplingError, RotationOnly, TranslationOnly},
    kick_drift_kick::KickDriftKick,
};

/// Discrete dynamics `s_{k+1} = Φ_k(s_k, w_{k+1})` of `X` coordinates under `U` commands.
///
/// Variations `z` are `[δx, δγ, ζ, δΠ]`, or the half of them that is planned. States move along `z` by
/// [`DiscreteDynamics::moved`]: `x + δx`, `γ + δγ`, `R exp S(ζ)`, `Π + δΠ`. Derivatives are those of `z ↦ difference(Φ(s, w),
/// Φ(moved(s, z), w + v))` at 0.
pub(crate) trait DiscreteDynamics<const X: usize, const U: usize> {
    /// The state after step `k`.
    fn next(
        &self,
        k: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
    ) -> Result<BodyState, Unsolvable>;

    /// The state after step `k` and the first derivatives of the step.
    fn linearize(
        &self,
        k: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
        into: &mut Linearization<X, U>,
    ) -> Result<BodyState, Unsolvable>;

    /// Second derivatives of `λ · Φ` at fixed λ (symmetric, in the exponential coordinates of [`DiscreteDynamics::moved`]). Fails
    /// if and only if [`DiscreteDynamics::linearize`] does.
    fn curvature(
        &self,
        k: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
        lambda: &SVector<f64, X>,
        into: &mut Curvature<X, U>,
    ) -> Result<(), Unsolvable>;

    /// [`DiscreteDynamics::linearize`] and [`DiscreteDynamics::curvature`] at once, at less than their total cost.
    fn expand(
        &self,
        k: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
        lambda: &SVector<f64, X>,
        first: &mut Linearization<X, U>,
        second: &mut Curvature<X, U>,
    ) -> Result<BodyState, Unsolvable> {
        self.curvature(k, state, command, lambda, second)?;
        self.linearize(k, state, command, first)
    }

    /// The variation `z` with `moved(from, z) = to`.
    fn difference(&self, from: &BodyState, to: &BodyState) -> SVector<f64, X>;

    /// The state that `z` leads to from `state`.
    fn moved(&self, state: &BodyState, z: &SVector<f64, X>) -> BodyState;
}

/// First derivatives of a step: `z⁺ = A z + B v`.
#[derive(Clone, Debug)]
pub(crate) struct Linearization<const X: usize, const U: usize> {
    /// `A`
    pub(crate) a: SMatrix<f64, X, X>,
    /// `B`
    pub(crate) b: SMatrix<f64, X, U>,
}

/// Second derivatives of `λ · Φ`: symmetric blocks by state and command.
#[derive(Clone, Debug)]
pub(crate) struct Curvature<const X: usize, const U: usize> {
    /// By state twice, symmetric.
    pub(crate) state: SMatrix<f64, X, X>,
    /// By state and command.
    pub(crate) mixed: SMatrix<f64, X, U>,
    /// By command twice, symmetric.
    pub(crate) command: SMatrix<f64, U, U>,
}
