use lgvi_dynamics::BodyState;
use nalgebra::{SMatrix, SVector};

use super::body_frame::BodyFrame;
use super::conditions::Ending;
use super::step_size::Beside;

/// A discrete optimal control problem of `X` coordinates and `U` commands, as the Newton iteration sees it.
pub(crate) struct Problem<'p, S, E, const X: usize, const U: usize> {
    /// `s_{k+1} = Φ_k(s_k, w_{k+1})`
    pub(crate) steps: &'p S,
    /// The terminal conditions.
    pub(crate) ending: &'p E,
    /// The initial state.
    pub(crate) initial: BodyState,
    /// `h`
    pub(crate) h: f64,
    /// Steps of other sizes, if the step size is to be found.
    pub(crate) beside: Option<Beside<'p, S>>,
    /// `N`
    pub(crate) intervals: usize,
    /// `W` of the cost `Σ (h/2) wᵀ W w`.
    pub(crate) weight: SMatrix<f64, U, U>,
    /// Weight of variations of the commands per unit of time: `W` itself, or a quadratic cost of the same size where `W` is
    /// small beside a price.
    pub(crate) command_metric: SMatrix<f64, U, U>,
    /// `1/√W_ii` of the metric: units of the gradients by commands, so that the units of the commands do not matter.
    pub(crate) command_units: SVector<f64, U>,
    /// Approximate stiffness of each coordinate at the end, the metric of the augmentation: a displacement `δ` costs
    /// about `½ stiffness δ²`.
    pub(crate) stiffness: SVector<f64, X>,
    /// Positions of the body-frame vectors that turn with the attitude.
    pub(crate) body_frame: Option<BodyFrame>,
    /// Weight of variations of a state per unit of time, by coordinate.
    pub(crate) metric: SVector<f64, X>,
    /// Rounding error of each coordinate at the end, in multiples of the tolerance.
    pub(crate) rounding: SVector<f64, X>,
}

impl<S, E: Ending<X>, const X: usize, const U: usize> Problem<'_, S, E, X, U> {
    /// The weights of an augmentation of the terminal conditions at the end of an iterate.
    pub(crate) fn augmentation(&self, iterate: &Iterate<X, U>, factor: f64) -> SVector<f64, X> {
        let end = &iterate.states[self.intervals];
        self.weights(&self.ending.jacobian(end), factor)
    }
}

impl<S, E, const X: usize, const U: usize> Problem<'_, S, E, X, U> {
    /// The weights of an augmentation of terminal conditions with this `jacobian`, in multiples of the stiffness at the
    /// end; zero for rows without a condition.
    pub(super) fn weights(&self, jacobian: &SMatrix<f64, X, X>, factor: f64) -> SVector<f64, X> {
        SVector::from_fn(|row, _| {
            let parts = jacobian.row(row).into_owned();
            let parts = parts.iter().zip(&self.stiffness);
            let compliance: f64 = parts.map(|(c, stiffness)| c * c / stiffness).sum();
            if compliance > 0.0 {
                factor / compliance
            } else {
                0.0
            }
        })
    }

    /// The [`strictness`] for terminal conditions with this `jacobian`.
    pub(crate) fn strictness(&self, jacobian: &SMatrix<f64, X, X>) -> SVector<f64, X> {
        strictness(&(jacobian.abs() * self.rounding))
    }
}

/// Factors by which misses are multiplied before they are compared with the tolerance: less than 1 where `rounding`, in
/// multiples of the tolerance, exceeds 1.
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
