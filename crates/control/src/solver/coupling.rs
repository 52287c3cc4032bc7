//! Planning of one half of a motion that gravity couples to the other half.
//!
//! A half is planned beside the free flight of the other half. Gravity acts differently on a body that is not a sphere
//! where the plan moves or turns it, so that the plan misses its target when both halves are flown. If it misses by
//! more than the tolerance, the whole motion is planned, with the commands of the half and to its target.

use super::attempt::Solver;
use super::both;
use super::class::Class;
use super::error::PlanError;
use super::progress::{Consecutive, NewtonSettings, Progress, Start, Warmth};
use super::resolution::resolved;
use crate::discrete::{DiscreteDynamics, KickDriftKick};
use crate::newton::Ending;
use crate::{MAX_COMMANDS, Motion, Plan, Transfer};

/// Plans the half of `transfer` that belongs to the class so that it holds when both halves are flown.
pub(super) fn half<C, const X: usize, const U: usize>(
    class: &C,
    transfer: &Transfer,
    start: Start<'_>,
    warmth: Warmth,
    settings: &NewtonSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError>
where
    C: Class<X, U> + Clone,
{
    let mut progress = Consecutive::new(observe);
    let plan = Solver::new(class.clone(), transfer, settings, &mut progress.next())
        .solve(start, warmth)?;
    let tolerated = settings.violation.max(2.0 * plan.certificate.terminal);
    if miss(class, transfer, &plan).is_some_and(|miss| miss <= tolerated) {
        return Ok(plan);
    }
    let whole = whole(class, transfer);
    let start = Start::Warm(&plan);
    let plan = both(&whole, start, warmth, settings, &mut progress.next())?;
    // The terminal conditions are not those of the transfer.
    let sweep = plan.sweep.clone().without_policies();
    Ok(Plan { sweep, ..plan })
}

/// The terminal miss of a plan when both halves are flown, or `None` if it cannot be flown.
fn miss<C, const X: usize, const U: usize>(
    class: &C,
    transfer: &Transfer,
    plan: &Plan,
) -> Option<f64>
where
    C: Class<X, U>,
{
    let steps = KickDriftKick::<_, 2, MAX_COMMANDS>::full(transfer);
    let mut state = transfer.initial;
    for (k, command) in plan.commands.iter().enumerate() {
        state = steps.next(k, &state, command).ok()?;
    }
    state
        .is_finite()
        .then(|| class.ending(transfer).residual(&state).norm())
}

/// The transfer of the whole motion, with the commands of the class and the terminal conditions of its half only.
fn whole<C, const X: usize, const U: usize>(class: &C, transfer: &Transfer) -> Transfer
where
    C: Class<X, U>,
{
    let mut whole = resolved(transfer, transfer.intervals);
    if transfer.motion == Motion::Translation {
        whole.terminal.rotation.release();
    } else {
        whole.terminal.translation.release();
    }
    whole.motion = Motion::Full;
    whole.actuation = transfer.actuation.limited_to(&class.selection());
    whole
}
