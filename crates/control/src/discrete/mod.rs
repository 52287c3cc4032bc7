//! The discrete dynamics with exact first and second derivatives, for the structured solver.

mod commands;
mod coordinates;
mod decoupled;
mod derivatives;
mod drift;
mod gyrostat;
mod kick_drift_kick;
pub(crate) mod linear;
pub(crate) mod stored;
#[cfg(test)]
pub(crate) mod tests;
mod within;

use lgvi_dynamics::BodyState;
use lgvi_dynamics::rotation::Unsolvable;
use nalgebra::{SVector, Vector3};

use crate::problem::Off;

pub(crate) use self::{
    commands::DecoupledCommands,
    coordinates::{Coordinates, Full},
    decoupled::{DecouplingError, RotationOnly, TranslationOnly},
    drift::{Drift, glide_gradient},
    gyrostat::{Gyrostat, balance},
    kick_drift_kick::KickDriftKick,
    linear::{Curvature, Inputs, Linearization},
    stored::SPINNING,
    within::Within,
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

    /// The effects of the commands, the same in every step but for [`Linearization::own`].
    fn inputs(&self) -> Inputs<U>;

    /// The commands that are off in each step; empty if none ever is.
    fn off(&self) -> &[Off];

    /// The state after step `k` and the first derivatives of the step.
    fn linearize(
        &self,
        k: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
        into: &mut Linearization,
    ) -> Result<BodyState, Unsolvable>;

    /// [`DiscreteDynamics::linearize`], and second derivatives of `λ · Φ` at fixed λ (in the exponential coordinates of
    /// [`DiscreteDynamics::moved`]).
    fn expand(
        &self,
        k: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
        lambda: &SVector<f64, X>,
        first: &mut Linearization,
        second: &mut Curvature,
    ) -> Result<BodyState, Unsolvable>;

    /// The derivatives of position and linear momentum at the end of the drift of step `k` by a factor of the angular velocity of
    /// the air; 0 without drag.
    fn by_rotation_of_air(
        &self,
        k: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
    ) -> [Vector3<f64>; 2];

    /// The variation `z` with `moved(from, z) = to`.
    fn difference(&self, from: &BodyState, to: &BodyState) -> SVector<f64, X>;

    /// The state that `z` leads to from `state`.
    fn moved(&self, state: &BodyState, z: &SVector<f64, X>) -> BodyState;

    /// Sets the momentum that the body stores, which a path of poses does not give, in states along it. The first is the
    /// initial one.
    fn complete(&self, states: &mut [BodyState]);
}
