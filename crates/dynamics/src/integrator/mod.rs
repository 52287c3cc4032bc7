//! Integrators, one per file, with the common trait [`Integrator`]. [`Method`] lists them by name.
//!
//! - Kicks and drifts: `splitting` (LGVI, Lie–Euler), `composition`, `nystrom`, with tables in `coefficients`. A drift
//!   rotates each body by a rotor (`drift`, `rotor`), starting from guesses that `warm_start` extrapolates.
//! - Kicks, and drifts along Kepler's motion: `wisdom_holman`.
//! - Other variational methods: `lagrangian`, `galerkin`, `closed_form`.
//! - Error control: `adaptive`, with solutions by Runge–Kutta pairs and by `taylor`. Methods for comparison: `baselines`.
//!   Both share the vector field `flow`, `stages`, `tableau` and `scale`.
//! - Wrapper around any of them: `subdivision`.

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
mod taylor;
pub(crate) mod warm_start;
mod wisdom_holman;

pub use adaptive::{Adaptive, Work};
pub use baselines::{CrouchGrossman, ImplicitMidpoint, RungeKutta};
pub use closed_form::ClosedForm;
pub use error::{MethodError, StepError};
pub use galerkin::{ChartOrigin, Galerkin, Quadrature};
pub use lagrangian::LagrangianLgvi;
pub use method::{KeplerScheme, Method, Rotor};
pub use splitting::Splitting;
pub use subdivision::Subdivision;
pub(crate) use taylor::ExpansionSize;
pub use wisdom_holman::WisdomHolman;

use crate::{BodyState, Load, System};

/// A one-step method for the bodies of a [`System`].
///
/// An integrator may keep data of the last states (loads, initial guesses). [`Integrator::start`] tells it that the
/// states are new.
pub trait Integrator: Send {
    /// Checks that the method can integrate from `states`, before [`start`](Self::start).
    ///
    /// # Errors
    /// Returns an error if the motion is not of the kind that the method is for.
    fn check(&mut self, _system: &mut System, _states: &[BodyState]) -> Result<(), MethodError> {
        Ok(())
    }

    /// Prepares for a trajectory from `states`.
    fn start(&mut self, system: &mut System, states: &[BodyState]);

    /// Advances `states` by `h` under gravity and `controls` (one per body), which are constant over the step. On an
    /// error, `states` and the data of the integrator remain unchanged.
    fn step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError>;

    /// Sets `next` to the result of a step from `states`. On an error, the contents of `next` are unspecified. A caller
    /// that alternates between two buffers of states avoids copies.
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

    /// Returns true if the method divides steps itself, as an error control does.
    fn cuts_steps(&self) -> bool {
        false
    }
}

/// Statistics of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepReport {
    /// Newton corrections of the implicit equations: the largest number for any of them.
    pub iterations: u32,
    /// Number of steps into which this one was divided, by an error control or a subdivision, or 0 if it was made in
    /// one piece.
    pub cuts: u32,
}

impl StepReport {
    /// Combines the reports of two consecutive steps.
    pub fn then(self, next: Self) -> Self {
        Self {
            iterations: self.iterations.max(next.iterations),
            cuts: self.cuts.max(1) + next.cuts.max(1),
        }
    }
}

/// Returns an error unless all `states` are finite.
pub(crate) fn check_finite(states: &[BodyState]) -> Result<(), StepError> {
    match states.iter().position(|state| !state.is_finite()) {
        Some(body) => Err(StepError::NotFinite { body }),
        None => Ok(()),
    }
}

/// Copies `next` to `states` if all states are finite and all bodies are clear of each other.
fn accept(system: &System, next: &[BodyState], states: &mut [BodyState]) -> Result<(), StepError> {
    check_finite(next)?;
    system.check_clearance(next)?;
    states.copy_from_slice(next);
    Ok(())
}
