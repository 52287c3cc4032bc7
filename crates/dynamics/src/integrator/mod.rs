//! Integrators, one a file, behind the trait [`Integrator`]; [`Method`] names them.
//!
//! - Kicks and drifts: `splitting` (LGVI, Lie–Euler), `composition`, `nystrom`, with tables in `coefficients`; a drift turns
//!   each body by a rotor (`drift`, `rotor`), from guesses that `warm_start` extrapolates.
//! - Other variational methods: `lagrangian`, `galerkin`, `closed_form`.
//! - With error control: `adaptive`. To compare with: `baselines`. Both share the vector field `flow`, `stages`, `tableau`
//!   and `scale`.
//! - Round any of them: `subdivision`.

mod adaptive;
mod baselines;
mod closed_form;
mod coefficients;
mod composition;
mod drift;
mod error;
mod flow;
mod galerkin;
mod lagrangian;
mod method;
mod nystrom;
mod rotor;
mod scale;
mod splitting;
mod stages;
mod subdivision;
mod tableau;
pub(crate) mod warm_start;

pub use adaptive::{Adaptive, Work};
pub use baselines::{CrouchGrossman, ImplicitMidpoint, RungeKutta};
pub use closed_form::ClosedForm;
pub use error::{MethodError, StepError};
pub use galerkin::{ChartOrigin, EulerPoincare, Galerkin, Quadrature};
pub use lagrangian::LagrangianLgvi;
pub use method::{Method, Rotor};
pub use splitting::Splitting;
pub use subdivision::Subdivision;

use crate::{BodyState, Load, System};

/// A one-step method for the bodies of a [`System`].
///
/// An integrator may keep what it knows of the last states (loads, starting guesses); [`Integrator::start`] tells it
/// that the states are new.
pub trait Integrator: Send {
    /// Prepares for a trajectory from `states`.
    fn start(&mut self, system: &mut System, states: &[BodyState]);

    /// Advances `states` by `h` under gravity and `controls` (one a body), constant over the step. On an error
    /// `states` are unchanged, and so is what the integrator knows.
    fn step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError>;

    /// Sets `next` to where such a step from `states` ends; on an error, to anything. Where the states of two steps are kept
    /// by turns nothing need be copied.
    fn step_to(
        &mut self,
        system: &mut System,
        states: &[BodyState],
        next: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError> {
        next.copy_from_slice(states);
        self.step(system, next, controls, h)
    }

    /// Whether it cuts steps by itself, as an error control does.
    fn cuts_steps(&self) -> bool {
        false
    }
}

/// What a step took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepReport {
    /// Newton corrections of the implicit equations: the most that one of them took.
    pub iterations: u32,
    /// Steps into which this one was cut, by an error control or a subdivision; 0 when it was made as one.
    pub cuts: u32,
}

impl StepReport {
    /// The report of a step that is one step after the other.
    pub fn then(self, next: Self) -> Self {
        Self {
            iterations: self.iterations.max(next.iterations),
            cuts: self.cuts.max(1) + next.cuts.max(1),
        }
    }
}

/// Whether all of `states` are finite.
pub(crate) fn check_finite(states: &[BodyState]) -> Result<(), StepError> {
    match states.iter().position(|state| !state.is_finite()) {
        Some(body) => Err(StepError::NotFinite { body }),
        None => Ok(()),
    }
}

/// Accepts `next` as the new `states` if all are finite and outside each other.
fn accept(system: &System, next: &[BodyState], states: &mut [BodyState]) -> Result<(), StepError> {
    check_finite(next)?;
    system.check_clearance(next)?;
    states.copy_from_slice(next);
    Ok(())
}
