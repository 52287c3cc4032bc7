//! The choice of an integrator and its step for a system and an accuracy.
//!
//! A run wants states at `steps` equal times; each step between them may be cut into substeps of a method. [`choose`]
//! rehearses the run: it flies it by one candidate after another, just as the run will be flown, and compares where they end
//! with a reference.
//!
//! 1. The reference (`reference`): the run by the method of Dormand and Prince, far more accurate than is asked. What flights
//!    less accurate than it differ by is its own error, truncation and rounding alike: the floor.
//! 2. The candidates (`grid`): methods on ladders of resolutions, the same whatever the tolerance. The cheapest (`cost`) whose
//!    error and floor together are within the tolerance is the choice. So a tighter tolerance never ends with a larger
//!    error: what is chosen for a looser one is chosen again, or errs by more than the tighter one.
//!
//! Nothing depends on a clock: the same input gives the same choice on every machine.

mod choice;
mod cost;
mod error;
mod flight;
mod grid;
mod reference;

use std::ops::ControlFlow;

pub use choice::{Candidate, Choice, Outlook};
pub use error::ChoiceError;

use crate::{Accuracy, BodyState, System};
use cost::Cost;
use flight::Flights;
use reference::Reference;

/// Error, in multiples of the floor, that candidates can be expected to reach.
const REACHED: f64 = 2.0;

/// What is wanted of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Duration, > 0.
    pub duration: f64,
    /// Steps, each of which ends in a state that is wanted, ≥ 1.
    pub steps: u64,
}

/// Chooses method and substeps for `system`, from `states` (one a body), such that the error at the end of `run` is at most
/// `tolerance` as [`Accuracy`] measures it. Controls are none. `progress` is told about which part is done, some times a
/// second, and may end the search.
///
/// # Assumptions and limitations
/// Where the run is too dear to be rehearsed whole, errors are taken to grow with the square of time after the part that was
/// ([`Outlook::Extrapolated`]); a close encounter later is not foreseen. Where nothing is known of the end, the tolerance
/// holds for a part of the run ([`Outlook::Chaotic`]).
///
/// # Errors
/// A tolerance that rounding does not let the run reach, with the one that it does.
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
    let cost = Cost::new(system);
    if system.is_free() {
        return Choice::closed_form(system, &states, run, &cost, tolerance);
    }
    let mut flights = Flights::new(system, &states, run, cost, progress);
    let reference = Reference::new(&mut flights, tolerance)?;
    // Where not even the reference is as accurate, what can be reached is looked for.
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
    Ok(Choice {
        method: chosen.method,
        substeps: chosen.substeps,
        error: chosen.error,
        outlook: reference.outlook,
        evaluations: flights.evaluations(),
        candidates,
    })
}
