use lgvi_dynamics::BodyState;
use nalgebra::{SMatrix, SVector};

use super::turning::Turning;

/// A discrete optimal control problem of `X` coordinates and `U` commands, as the Newton iteration sees it.
pub(crate) struct Problem<'p, S, E, const X: usize, const U: usize> {
    /// `s_{k+1} = Φ_k(s_k, w_{k+1})`
    pub(crate) steps: &'p S,
    /// Where it is to end.
    pub(crate) ending: &'p E,
    /// Where it starts.
    pub(crate) initial: BodyState,
    /// `h`
    pub(crate) h: f64,
    /// `N`
    pub(crate) intervals: usize,
    /// `W`, of the cost `Σ (h/2) wᵀ W w`.
    pub(crate) weight: SMatrix<f64, U, U>,
    /// `1/√W_ii`: what gradients by commands are measured in, so that their units do not matter.
    pub(crate) command_units: SVector<f64, U>,
    /// What a unit of each coordinate costs at the end, squared and halved, roughly: the augmentation's metric.
    pub(crate) stiffness: SVector<f64, X>,
    /// Where body-frame vectors turn with the attitude.
    pub(crate) turning: Option<Turning>,
    /// What variations of a state weigh by its coordinates, a unit of time.
    pub(crate) metric: SVector<f64, X>,
    /// What rounding makes of each coordinate at the end, in multiples of the tolerance.
    pub(crate) rounding: SVector<f64, X>,
}

impl<S, E, const X: usize, const U: usize> Problem<'_, S, E, X, U> {
    /// The [`strictness`] towards terminal conditions with this `jacobian`.
    pub(crate) fn strictness(&self, jacobian: &SMatrix<f64, X, X>) -> SVector<f64, X> {
        strictness(&(jacobian.abs() * self.rounding))
    }
}

/// By what misses are multiplied before they are compared with the tolerance: by less than 1 where `rounding`, in multiples
/// of the tolerance, exceeds it.
pub(crate) fn strictness<const X: usize>(rounding: &SVector<f64, X>) -> SVector<f64, X> {
    rounding.map(|rounding| rounding.max(1.0).recip())
}

/// States and commands of all stages, and the multipliers of the terminal conditions.
#[derive(Clone, Debug)]
pub(crate) struct Iterate<const X: usize, const U: usize> {
    /// `s_0 … s_N`
    pub(crate) states: Vec<BodyState>,
    /// `w_1 … w_N`
    pub(crate) commands: Vec<SVector<f64, U>>,
    /// `ν`
    pub(crate) nu: SVector<f64, X>,
}
