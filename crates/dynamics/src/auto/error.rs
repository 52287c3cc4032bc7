use thiserror::Error;

use super::Run;
use crate::{BodyState, MethodError, StepError, System};

/// Tolerances that can be met in double precision and mean something.
const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-14..=0.1;

/// Why no choice was made.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ChoiceError {
    /// The duration is not a positive number.
    #[error("duration is {0}, expected a finite number > 0")]
    Duration(f64),
    /// No steps.
    #[error("the run has no steps, expected at least 1")]
    Steps,
    /// The tolerance is out of range.
    #[error("tolerance is {0}, expected 1e-14 to 0.1")]
    Tolerance(f64),
    /// States and bodies differ in number.
    #[error("{states} states for {bodies} bodies, expected one a body")]
    States {
        /// Number of states.
        states: usize,
        /// Number of bodies.
        bodies: usize,
    },
    /// A state is NaN or infinite.
    #[error("the state of body {0} is not finite")]
    NotFinite(usize),
    /// No method can fly even the pilot, however short its steps.
    #[error("no step was short enough for the pilot flight: {0}")]
    Flight(StepError),
    /// No method knows such bodies.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// The motion is too fast to be followed at the cost that pilot flights may have.
    #[error("the pilot flight of {horizon} needs more than {evaluations} evaluations of gravity")]
    Costly {
        /// Duration of the pilot flight.
        horizon: f64,
        /// What it may take.
        evaluations: u64,
    },
}

/// Refuses what cannot be flown.
pub(super) fn check(
    system: &System,
    states: &[BodyState],
    run: Run,
    tolerance: f64,
) -> Result<(), ChoiceError> {
    let bodies = system.bodies().len();
    if states.len() != bodies {
        let states = states.len();
        return Err(ChoiceError::States { states, bodies });
    }
    if let Some(body) = states.iter().position(|state| !state.is_finite()) {
        return Err(ChoiceError::NotFinite(body));
    }
    if !(run.duration.is_finite() && run.duration > 0.0) {
        return Err(ChoiceError::Duration(run.duration));
    }
    if run.steps == 0 {
        return Err(ChoiceError::Steps);
    }
    if !TOLERANCES.contains(&tolerance) {
        return Err(ChoiceError::Tolerance(tolerance));
    }
    Ok(())
}
