//! The discrete dynamics with exact first and second derivatives, as the structured solver sees them.

mod commands;
mod coordinates;
mod drift;
mod halves;
mod kick;
mod kick_drift_kick;
mod passage;
#[cfg(test)]
pub(crate) mod tests;

use lgvi_dynamics::BodyState;
use lgvi_dynamics::rotation::Unsolvable;
use nalgebra::{SMatrix, SVector};

pub(crate) use self::{
    commands::HalfCommands,
    coordinates::{Coordinates, Full},
    halves::{HalfError, Rotation as RotationHalf, Translation as TranslationHalf},
    kick_drift_kick::KickDriftKick,
};

/// Discrete dynamics `s_{k+1} = Φ_k(s_k, w_{k+1})` of `X` coordinates under `U` commands.
///
/// Variations `z` are `[δx, δγ, ζ, δΠ]`, or its half that moves. States move along `z` by [`Steps::moved`]:
/// `x + δx`, `γ + δγ`, `R exp S(ζ)`, `Π + δΠ`. Derivatives are those of
/// `z ↦ difference(Φ(s, w), Φ(moved(s, z), w + v))` at 0.
pub(crate) trait Steps<const X: usize, const U: usize> {
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

    /// Second derivatives of `λ · Φ` (symmetric, in the exponential coordinates of [`Steps::moved`]) at fixed λ, where
    /// [`Steps::linearize`] is possible.
    fn curvature(
        &self,
        k: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
        lambda: &SVector<f64, X>,
        into: &mut Curvature<X, U>,
    ) -> Result<(), Unsolvable>;

    /// [`Steps::linearize`] and [`Steps::curvature`] at once, at less than the cost of one after the other.
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

    /// `z` with `moved(from, z) = to`.
    fn difference(&self, from: &BodyState, to: &BodyState) -> SVector<f64, X>;

    /// The state at `z` from `state`.
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
