//! The whole strategy of the structured solver behind one call: initial guesses at a coarse resolution, refinement to
//! all intervals, the inequalities, and the completion of the plan.

mod assisted;
mod attempt;
mod between;
pub(crate) mod chance;
mod class;
mod constrained;
mod coupling;
mod crest;
mod deviations;
mod drifted;
mod error;
mod finish;
mod first;
mod free_time;
mod fuel;
mod inertial_guess;
mod neighboring;
mod progress;
mod relaxation;
mod resolution;
mod scale;
#[cfg(test)]
mod tests;
mod warm;

pub(crate) use between::{Margin, Reached, TOLERANCE as BETWEEN};
pub(crate) use crest::highest;
pub use error::PlanError;
pub(crate) use free_time::{TimePrice, TimedPath};
pub(crate) use progress::{Consecutive, Warmth};
pub use progress::{NewtonSettings, Phase, Progress, Start};

use crate::discrete::SPINNING;
use crate::newton::{Iterate, Newton, Unconstrained};
use crate::problem::{FEW, stacked};
use crate::shooting::Extremal;
use crate::units::Units;
use crate::{Command, MAX_COMMANDS, Motion, Plan, Transfer, propellant, wheels};
use attempt::Solver;
use class::{Both, Class, Rotation, Spinning, Translation};

/// Solves `transfer` by Newton's method on all stages, from a plan or by a cold start.
///
/// A cold start leads from smooth paths over a few intervals to all intervals. The states of the returned plan are
/// those of its commands, to rounding. `observe` is called with every iteration and stops the solver by returning
/// `false`.
///
/// # Assumptions and limitations
/// A plan is a local minimum; other windings of the attitude give other minima. Inequalities are imposed on the best
/// plan without them. Conditions that no command affects to first order are met by
/// means of additional actuators at increasing weights, if the actuation has room for further commands.
pub fn solve(
    transfer: &Transfer,
    start: Start<'_>,
    settings: &NewtonSettings,
    mut observe: impl FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    match &transfer.chances {
        Some(chances) => chance::solve(transfer, chances, start, settings, &mut observe),
        None => solve_plain(transfer, start, settings, &mut observe),
    }
}

/// [`solve`] for constraints as they are.
fn solve_plain(
    transfer: &Transfer,
    start: Start<'_>,
    settings: &NewtonSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    if transfer.actuation.is_of_wheels() {
        return wheels::solve(transfer, start, Warmth::of(settings), settings, observe);
    }
    if let Some(command) = fuel::unlimited(transfer) {
        return Err(PlanError::Unlimited { command });
    }
    if transfer.uses_propellant() {
        return propellant::solve(transfer, start, settings, observe);
    }
    solve_stated(transfer, start, settings, observe)
}

/// [`solve`] for a transfer that is solved as it is stated.
pub(crate) fn solve_stated(
    transfer: &Transfer,
    start: Start<'_>,
    settings: &NewtonSettings,
    mut observe: impl FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    stated(
        transfer,
        start,
        Warmth::of(settings),
        settings,
        &mut observe,
    )
}

/// [`solve`] from a plan, without a cold start if that fails.
pub(crate) fn solve_near(
    transfer: &Transfer,
    plan: &Plan,
    warmth: Warmth,
    settings: &NewtonSettings,
    mut observe: impl FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    let start = Start::Warm(plan);
    if transfer.actuation.is_of_wheels() {
        return wheels::solve(transfer, start, warmth, settings, &mut observe);
    }
    stated(transfer, start, warmth, settings, &mut observe)
}

fn stated(
    transfer: &Transfer,
    start: Start<'_>,
    warmth: Warmth,
    settings: &NewtonSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
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
    let mut observe = |now: &Progress| observe(&units.leave_progress(now));
    by_class(&own, start, warmth, settings, &mut observe)
        .map(|plan| units.leave(plan))
        .map_err(|error| units.leave_error(error))
}

/// For each interval of a plan of position, with or without the attitude, the force by which prices and inequalities hold the commands:
/// `−(h W w + Bᵀ λ)`. Without it, if the plan has not as many intervals as the transfer.
pub(crate) fn command_forces(transfer: &Transfer, plan: &Plan) -> Result<Vec<Command>, PlanError> {
    let units = Units::of(transfer);
    let (own, plan) = (units.transfer(transfer)?, units.enter(plan));
    let mut unobserved = |_: &Progress| true;
    let settings = NewtonSettings::default();
    let forces = if own.motion == Motion::Translation {
        let class = Translation::of(&own.actuation)?;
        Solver::new(class, &own, &settings, &mut unobserved).command_forces(&plan)
    } else if own.actuation.commands() <= FEW {
        Solver::new(Both::<FEW>, &own, &settings, &mut unobserved).command_forces(&plan)
    } else {
        Solver::new(Both::<MAX_COMMANDS>, &own, &settings, &mut unobserved).command_forces(&plan)
    }?;
    let unit = units.commands().map(|unit| units.cost() / unit);
    Ok(forces
        .iter()
        .map(|force| force.component_mul(&unit))
        .collect())
}

/// [`solve`] for a transfer in its own units.
pub(crate) fn solve_in_own_units(
    transfer: &Transfer,
    start: Start<'_>,
    settings: &NewtonSettings,
    mut observe: impl FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    by_class(
        transfer,
        start,
        Warmth::of(settings),
        settings,
        &mut observe,
    )
}

/// [`solve_in_own_units`] from an initial guess, without a cold start if it fails.
pub(crate) fn from_guess(
    transfer: &Transfer,
    guess: &Plan,
    settings: &NewtonSettings,
    mut observe: impl FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    let warmth = Warmth::ONCE;
    by_class(transfer, Start::Warm(guess), warmth, settings, &mut observe)
}

fn by_class(
    transfer: &Transfer,
    start: Start<'_>,
    warmth: Warmth,
    settings: &NewtonSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    let actuation = &transfer.actuation;
    if transfer.orbit.is_some() {
        return spinning(transfer, start, warmth, settings, observe);
    }
    match transfer.motion {
        Motion::Full => both(transfer, start, warmth, settings, observe),
        Motion::Translation => {
            let class = Translation::of(actuation)?;
            coupling::half(&class, transfer, start, warmth, settings, observe)
        }
        Motion::Rotation => {
            let class = Rotation::of(actuation)?;
            coupling::half(&class, transfer, start, warmth, settings, observe)
        }
    }
}

/// Minimizes the cost of a plan and of its time, from a plan. A half of the motion is planned beside the free flight of the other half.
pub(crate) fn with_free_time(
    transfer: &Transfer,
    plan: &Plan,
    price: &TimePrice,
    settings: &NewtonSettings,
    mut observe: impl FnMut(&Progress) -> bool,
) -> Result<TimedPath, PlanError> {
    if transfer.actuation.is_of_wheels() {
        return wheels::with_free_time(transfer, plan, price, settings, &mut observe);
    }
    let units = Units::of(transfer);
    let own = units.transfer(transfer)?;
    let plan = units.enter(plan);
    let price = TimePrice {
        rate: price.rate * units.time() / units.cost(),
        ..*price
    };
    let mut observe = |now: &Progress| observe(&units.leave_progress(now));
    let timed = timed_by_class(&own, &plan, &price, settings, &mut observe);
    timed
        .map(|timed| TimedPath {
            plan: units.leave(timed.plan),
            bound: timed.bound.map(|bound| units.cost() * bound),
        })
        .map_err(|error| units.leave_error(error))
}

fn timed_by_class(
    transfer: &Transfer,
    plan: &Plan,
    price: &TimePrice,
    settings: &NewtonSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<TimedPath, PlanError> {
    let actuation = &transfer.actuation;
    let few = actuation.commands() <= FEW;
    match transfer.motion {
        _ if transfer.orbit.is_some() && actuation.commands() <= SPINNING => {
            Solver::new(Spinning::<SPINNING>, transfer, settings, observe)
                .with_free_time(plan, price)
        }
        _ if transfer.orbit.is_some() => {
            Solver::new(Spinning::<MAX_COMMANDS>, transfer, settings, observe)
                .with_free_time(plan, price)
        }
        Motion::Full if few => {
            Solver::new(Both::<FEW>, transfer, settings, observe).with_free_time(plan, price)
        }
        Motion::Full => Solver::new(Both::<MAX_COMMANDS>, transfer, settings, observe)
            .with_free_time(plan, price),
        Motion::Translation => {
            let class = Translation::of(actuation)?;
            Solver::new(class, transfer, settings, observe).with_free_time(plan, price)
        }
        Motion::Rotation => {
            let class = Rotation::of(actuation)?;
            Solver::new(class, transfer, settings, observe).with_free_time(plan, price)
        }
    }
}

/// Plans position and attitude, with room for as many commands as there are.
fn both(
    transfer: &Transfer,
    start: Start<'_>,
    warmth: Warmth,
    settings: &NewtonSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    if transfer.actuation.commands() <= FEW {
        Solver::new(Both::<FEW>, transfer, settings, observe).solve(start, warmth)
    } else {
        Solver::new(Both::<MAX_COMMANDS>, transfer, settings, observe).solve(start, warmth)
    }
}

/// Plans the attitude of a body with wheels, with room for as many commands as there are.
fn spinning(
    transfer: &Transfer,
    start: Start<'_>,
    warmth: Warmth,
    settings: &NewtonSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    if transfer.actuation.commands() <= SPINNING {
        Solver::new(Spinning::<SPINNING>, transfer, settings, observe).solve(start, warmth)
    } else {
        Solver::new(Spinning::<MAX_COMMANDS>, transfer, settings, observe).solve(start, warmth)
    }
}

/// The complete plan of an extremal that ends at the target.
///
/// # Errors
/// Returns an error if the commands of the extremal cannot be flown.
pub fn certified(transfer: &Transfer, extremal: &Extremal) -> Result<Plan, PlanError> {
    let units = Units::of(transfer);
    let own = units.transfer(transfer)?;
    let extremal = units.enter_extremal(extremal);
    let iterate = Iterate {
        states: extremal.states.clone(),
        commands: extremal.controls.iter().map(stacked).collect(),
        // At the target, the variations of the conditions are those of the state: `ν = λ_{N−1}`.
        nu: extremal.multipliers.last().copied().unwrap_or_default(),
    };
    let mut unobserved = |_: &Progress| true;
    let mut solver = Solver::new(
        Both::<FEW>,
        &own,
        &NewtonSettings::default(),
        &mut unobserved,
    );
    let newton = Newton::new(own.intervals, iterate);
    solver
        .finish(newton, &mut Unconstrained)
        .map(|plan| units.leave(plan))
        .map_err(|error| units.leave_error(error))
}
