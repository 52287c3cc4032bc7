//! The whole strategy of the structured solver behind one call: guesses, a few stages first, then all, then the
//! inequalities, then what the plan carries with it.

mod assisted;
mod attempt;
mod class;
mod constrained;
mod coupling;
mod drifted;
mod error;
mod finish;
mod first;
mod progress;
mod relaxation;
mod resolution;
mod scale;
#[cfg(test)]
mod tests;
mod warm;

pub use error::PlanError;
pub use progress::{NewtonSettings, Phase, Progress, Start};

use crate::extremal::{Extremal, stacked};
use crate::newton::{Iterate, Newton, Unconstrained};
use crate::units::Units;
use crate::{Motion, Plan, Transfer};
use attempt::Solver;
use class::{Both, Class, Rotation, Translation};

/// Solves `transfer` by Newton's method on all stages, from a plan or from nothing.
///
/// Cold starts go from smooth paths over a few stages to all of them. What comes back flies: its states are those of its
/// commands, to rounding. `observe` sees every iteration and may end it by returning `false`.
///
/// # Assumptions and limitations
/// A plan is a local minimum; windings of the attitude make others. Inequalities are imposed on the plan that is best
/// without them, and hold where they are sampled. Conditions that no command moves at first order are reached by way of
/// additional actuators that grow dear, where the actuation has places left for them among its commands.
pub fn solve(
    transfer: &Transfer,
    start: Start<'_>,
    settings: &NewtonSettings,
    mut observe: impl FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    let units = Units::of(transfer);
    let own = units.transfer(transfer)?;
    let guess;
    let start = match start {
        Start::Cold => Start::Cold,
        Start::Warm(plan) => {
            guess = units.enter(plan);
            Start::Warm(&guess)
        }
    };
    let observe = |now: &Progress| observe(&units.leave_progress(now));
    solve_in_own_units(&own, start, settings, observe)
        .map(|plan| units.leave(plan))
        .map_err(|error| units.leave_error(error))
}

/// [`solve`] of a transfer that is stated in units of its own size.
pub(crate) fn solve_in_own_units(
    transfer: &Transfer,
    start: Start<'_>,
    settings: &NewtonSettings,
    mut observe: impl FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    by_class(transfer, start, true, settings, &mut observe)
}

/// [`solve_in_own_units`] from a guess, and not from nothing where that fails.
pub(crate) fn from_guess(
    transfer: &Transfer,
    guess: &Plan,
    settings: &NewtonSettings,
    mut observe: impl FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    by_class(transfer, Start::Warm(guess), false, settings, &mut observe)
}

fn by_class(
    transfer: &Transfer,
    start: Start<'_>,
    again: bool,
    settings: &NewtonSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    let actuation = &transfer.actuation;
    match transfer.motion {
        Motion::Full => Solver::new(Both, transfer, settings, observe).solve(start, again),
        Motion::Translation => {
            let class = Translation::of(actuation)?;
            coupling::half(&class, transfer, start, again, settings, observe)
        }
        Motion::Rotation => {
            let class = Rotation::of(actuation)?;
            coupling::half(&class, transfer, start, again, settings, observe)
        }
    }
}

/// The plan that an extremal is which ends at the target, with all that a plan carries.
///
/// # Errors
/// Its commands cannot be flown.
pub fn certified(transfer: &Transfer, extremal: &Extremal) -> Result<Plan, PlanError> {
    let units = Units::of(transfer);
    let own = units.transfer(transfer)?;
    let extremal = units.enter_extremal(extremal);
    let iterate = Iterate {
        states: extremal.states.clone(),
        commands: extremal.controls.iter().map(stacked).collect(),
        // At the target the conditions vary as the state does: `ν = λ_{N−1}`.
        nu: extremal.multipliers.last().copied().unwrap_or_default(),
    };
    let mut unobserved = |_: &Progress| true;
    let solver = Solver::new(Both, &own, &NewtonSettings::default(), &mut unobserved);
    let newton = Newton::new(own.intervals, iterate);
    solver
        .finish(newton, &mut Unconstrained)
        .map(|plan| units.leave(plan))
        .map_err(|error| units.leave_error(error))
}
