use thiserror::Error;

use super::Run;
use crate::{BodyState, MethodError, StepError, System};

/// Accepted tolerances: those that are meaningful and can be met in double precision.
const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-14..=0.1;

/// Reasons why no method could be chosen.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
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
    /// No method reaches the tolerance.
    #[error(
        "the tolerance {tolerance:e} is out of reach: rounding limits this run to an error of about {floor:.1e}"
    )]
    Floor {
        /// The requested tolerance.
        tolerance: f64,
        /// The smallest tolerance that can be met.
        floor: f64,
    },
    /// No method can integrate the run.
    #[error("the run cannot be flown: {0}")]
    Flight(StepError),
    /// No method supports these bodies.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// The motion is too fast to integrate over any useful part of the run.
    #[error(
        "the motion is too fast for the run: {evaluations} evaluations of gravity do not cover a time of {horizon}"
    )]
    Costly {
        /// Time that the flight did not reach.
        horizon: f64,
        /// Evaluations made.
        evaluations: u64,
    },
    /// The caller stopped the search.
    #[error("the choice of an integrator was interrupted")]
    Interrupted,
}

impl ChoiceError {
    /// Creates the error for a tolerance that no method reaches, given the smallest error reached. That error is
    /// rounded up, so that the printed value can be used as a tolerance.
    pub(super) fn beyond(tolerance: f64, least: f64) -> Self {
        if !least.is_finite() {
            let floor = least;
            return Self::Floor { tolerance, floor };
        }
        let unit = libm::pow(10.0, libm::floor(libm::log10(least)) - 1.0);
        let floor = unit * libm::ceil(least / unit);
        Self::Floor { tolerance, floor }
    }
}

/// Returns an error if the input cannot be integrated.
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
