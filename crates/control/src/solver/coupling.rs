//! One half of a motion that gravity couples to the other.
//!
//! Half a motion is planned beside the free flight of the other half. A body that is no sphere is pulled and turned
//! otherwise where the plan leads it: the plan as flown misses. Where it misses by more than the tolerance, the whole motion
//! is planned, under the commands of the half and to its target.

use super::attempt::Solver;
use super::class::{Both, Class};
use super::error::PlanError;
use super::progress::{NewtonSettings, Progress, Start};
use super::resolution::resolved;
use crate::newton::Ending;
use crate::steps::{KickDriftKick, Steps};
use crate::{Motion, Plan, Transfer};

/// Solves the half of `transfer` that is the class's, as it is flown.
pub(super) fn half<C, const X: usize, const U: usize>(
    class: &C,
    transfer: &Transfer,
    start: Start<'_>,
    again: bool,
    settings: &NewtonSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError>
where
    C: Class<X, U> + Clone,
{
    let mut made = [0; 2];
    let mut watch = |now: &Progress| {
        made = [now.iteration, now.trials];
        observe(now)
    };
    let plan = Solver::new(class.clone(), transfer, settings, &mut watch).solve(start, again)?;
    let tolerated = settings.violation.max(2.0 * plan.certificate.terminal);
    if miss(class, transfer, &plan).is_some_and(|miss| miss <= tolerated) {
        return Ok(plan);
    }
    let mut watch = |now: &Progress| {
        observe(&Progress {
            iteration: made[0] + now.iteration,
            trials: made[1] + now.trials,
            ..*now
        })
    };
    let whole = whole(class, transfer);
    Solver::new(Both, &whole, settings, &mut watch).solve(Start::Warm(&plan), again)
}

/// By how much a plan misses its target where both halves are flown; `None` where it cannot be flown.
fn miss<C, const X: usize, const U: usize>(
    class: &C,
    transfer: &Transfer,
    plan: &Plan,
) -> Option<f64>
where
    C: Class<X, U>,
{
    let steps = KickDriftKick::full(transfer);
    let mut state = transfer.initial;
    for (k, command) in plan.commands.iter().enumerate() {
        state = steps.next(k, &state, command).ok()?;
    }
    state
        .is_finite()
        .then(|| class.ending(transfer).residual(&state).norm())
}

/// The transfer of the whole motion under the commands of the class, to where it is to lead its half.
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
