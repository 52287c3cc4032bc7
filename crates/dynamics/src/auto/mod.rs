//! Automatic choice of an integrator and its step size for a system and an accuracy.
//!
//! A run asks for states at `steps` equidistant times. Each step between them may be divided into substeps of a method.
//! [`choose`] rehearses the run: it integrates the run with each candidate exactly as in the actual run, and compares
//! the end states with a reference.
//!
//! 1. The reference (`reference`) is the run by the Dormand–Prince method, far more accurate than requested. Its
//!    difference from flights of lower accuracy estimates its own error, truncation and rounding together: the floor.
//! 2. The candidates (`grid`) are methods on fixed ladders of resolution that do not depend on the tolerance. The
//!    choice is the cheapest candidate (`cost`) whose error and floor together are within the tolerance. So a tighter
//!    tolerance never leads to a larger error: the choice for a looser tolerance is either chosen again or has an error
//!    above the tighter tolerance.
//!
//! The result does not depend on a clock: the same input gives the same choice on every machine.

mod choice;
mod cost;
mod error;
mod flight;
mod grid;
mod reference;

use std::ops::ControlFlow;

pub use choice::{Candidate, Choice, Outlook};
pub use error::ChoiceError;

use crate::{Accuracy, BodyState, Method, System};
use cost::Cost;
use flight::Flights;
use reference::Reference;

/// Error that candidates can be expected to reach, in multiples of the floor.
const REACHED: f64 = 2.0;

/// The run to be integrated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Duration, > 0.
    pub duration: f64,
    /// Steps, ≥ 1. A state is requested at the end of each step.
    pub steps: u64,
}

/// Chooses method and substeps for `system`, starting from `states` (one per body), such that the error at the end of
/// `run` is at most `tolerance` as [`Accuracy`] measures it. No controls act. `progress` is called with the completed
/// fraction several times a second, and may stop the search.
///
/// # Assumptions and limitations
/// If the run is too expensive to rehearse in full, errors are assumed to grow with the square of time after the
/// rehearsed part ([`Outlook::Extrapolated`]); a later close approach is not foreseen. If the end cannot be determined,
/// the tolerance holds for a part of the run ([`Outlook::Chaotic`]).
///
/// # Errors
/// Returns an error if rounding prevents the run from reaching the tolerance. The error contains a tolerance that can
/// be reached.
pub fn choose(
    system: &mut System,
    states: &[BodyState],
    run: Run,
    tolerance: f64,
    progress: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Choice, ChoiceError> {
    error::check(system, states, run, tolerance)?;
    let mut states = states.to_vec();
    system.constrain(&mut states);
    let cost = Cost::new(system, &states);
    let exact = if system.is_free() && !system.has_drag() {
        Some(closed_form(system, &states, run, &cost, tolerance)?)
    } else {
        None
    };
    let mut flights = Flights::new(system, &states, run, cost, progress);
    if let Some(exact) = exact {
        let reference = Reference::closed_form(&mut flights, exact.error)?;
        let found = grid::interpolated(&mut flights, &reference, tolerance, exact.cost)?;
        let candidates = found.into_iter().chain([exact]).collect();
        return Ok(of(candidates, Outlook::Met, &flights));
    }
    let reference = Reference::new(&mut flights, tolerance)?;
    // If even the reference misses the tolerance, the search aims at an accuracy that can be reached.
    let floor = reference.floor();
    let aim = if floor > tolerance {
        REACHED * floor
    } else {
        tolerance
    };
    let mut candidates = grid::search(&mut flights, &reference, aim)?;
    let lacks = |candidate: &Candidate| candidate.error.max(aim);
    candidates.sort_by(|a, b| {
        let nearer = lacks(a).total_cmp(&lacks(b));
        nearer.then(a.cost.total_cmp(&b.cost))
    });
    let chosen = candidates[0];
    let may_miss = matches!(reference.outlook, Outlook::Extrapolated { .. });
    if chosen.error > tolerance && !(may_miss && chosen.error.is_finite()) {
        return Err(ChoiceError::beyond(tolerance, chosen.error));
    }
    Ok(of(candidates, reference.outlook, &flights))
}

/// The choice of the first of the candidates.
fn of(candidates: Vec<Candidate>, outlook: Outlook, flights: &Flights<'_>) -> Choice {
    let Candidate {
        method,
        substeps,
        error,
        ..
    } = candidates[0];
    Choice {
        method,
        substeps,
        error,
        outlook,
        evaluations: flights.evaluations(),
        candidates,
    }
}

/// The motion of bodies without loads: exact except for the rounding of displacements and rotation angles.
fn closed_form(
    system: &System,
    states: &[BodyState],
    run: Run,
    cost: &Cost,
    tolerance: f64,
) -> Result<Candidate, ChoiceError> {
    let Accuracy { length } = Accuracy::new(system.bodies(), states);
    let moved = system.bodies().iter().zip(states).map(|(body, state)| {
        let rate = state.velocity(body).norm() / length;
        rate.max(state.angular_velocity(body).norm()) * run.duration
    });
    let error = f64::EPSILON * moved.fold(1.0, f64::max);
    if error > tolerance {
        return Err(ChoiceError::beyond(tolerance, error));
    }
    Ok(Candidate {
        method: Method::ClosedForm,
        substeps: 1,
        error,
        cost: cost.closed_form(run.steps as f64),
    })
}
