//! The local minima of a transfer, sorted by cost.

mod paths;
mod winding;

use std::cell::Cell;

use lgvi_dynamics::BodyState;

use crate::solver::{
    NewtonSettings, Phase, PlanError, Progress, Start, chance, from_guess,
    solve_in_own_units as solve,
};
use crate::units::Units;
use crate::{Plan, Transfer, propellant, wheels};
use paths::Detours;
pub use winding::Winding;

/// Settings of a search for local minima.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchSettings {
    /// Number of initial paths, including the cold start.
    pub starts: u32,
    /// Seed of the random paths.
    pub seed: u64,
    /// Settings of each solution.
    pub newton: NewtonSettings,
}

impl Default for SearchSettings {
    fn default() -> Self {
        Self {
            starts: 80,
            seed: 1,
            newton: NewtonSettings::default(),
        }
    }
}

/// A local minimum.
#[derive(Clone, Debug, PartialEq)]
pub struct Minimum {
    /// The plan.
    pub plan: Plan,
    /// The winding of the attitude.
    pub winding: Winding,
    /// Number of starts that led to it at the coarse resolution.
    pub starts: u32,
}

/// Relative tolerance within which costs and multipliers of the same minimum agree.
const SAME: f64 = 1e-6;

/// Searches for local minima of `transfer`, starting from paths with different windings about the axis of the geodesic
/// and the axes of the body, and from random paths. Each minimum is returned once, the cheapest first.
///
/// The first start is that of [`crate::solve`] with all intervals, so that the cheapest minimum never costs more than
/// its plan. Other minima are searched for at the solver's coarse resolution and then refined, the cheapest first.
/// `observe` is called with the iterations of all solutions, counted consecutively. If it returns `false`, the search
/// ends with the minima already known at all intervals, if any.
///
/// # Assumptions and limitations
/// The search is not exhaustive. With constraints that hold with a probability, it finds the minima without deviations, from which
/// those with them are planned. Plans that are not strict minima are not returned, except that of the first start.
///
/// # Errors
/// Returns the solver's error of the cold start if no start leads to a minimum.
pub fn search(
    transfer: &Transfer,
    settings: &SearchSettings,
    mut observe: impl FnMut(&Progress) -> bool,
) -> Result<Vec<Minimum>, PlanError> {
    match &transfer.chances {
        Some(chances) => chance::search(transfer, chances, settings, &mut observe),
        None => search_plain(transfer, settings, &mut observe),
    }
}

/// [`search`] for constraints as they are.
pub(crate) fn search_plain(
    transfer: &Transfer,
    settings: &SearchSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Vec<Minimum>, PlanError> {
    if transfer.actuation.is_of_wheels() {
        return wheels::search(transfer, settings, observe);
    }
    if transfer.uses_propellant() {
        return propellant::search(transfer, settings, observe);
    }
    search_stated(transfer, settings, observe)
}

/// [`search`] for a transfer that is solved as it is stated.
pub(crate) fn search_stated(
    transfer: &Transfer,
    settings: &SearchSettings,
    mut observe: impl FnMut(&Progress) -> bool,
) -> Result<Vec<Minimum>, PlanError> {
    let units = Units::of(transfer);
    let own = units.transfer(transfer)?;
    let observe = |now: &Progress| observe(&units.leave_progress(now));
    let leave = |minimum: Minimum| Minimum {
        plan: units.leave(minimum.plan),
        ..minimum
    };
    search_in_own_units(&own, settings, observe)
        .map(|minima| minima.into_iter().map(leave).collect())
        .map_err(|error| units.leave_error(error))
}

fn search_in_own_units(
    transfer: &Transfer,
    settings: &SearchSettings,
    mut observe: impl FnMut(&Progress) -> bool,
) -> Result<Vec<Minimum>, PlanError> {
    let newton = &settings.newton;
    let intervals = transfer.intervals.min(newton.coarse.max(2));
    let duration = transfer.h * transfer.intervals as f64;
    let coarse = Transfer {
        h: duration / intervals as f64,
        intervals,
        ..transfer.clone()
    };
    let end = end(transfer);
    let stopped = Cell::new(false);
    // Iterations and trials before the current solution, and including it.
    let (before, made) = (Cell::new([0; 2]), Cell::new([0; 2]));
    let mut watch = |now: &Progress| {
        let [iteration, trials] = before.get();
        let (iteration, trials) = (iteration + now.iteration, trials + now.trials);
        made.set([iteration, trials]);
        let all = Progress {
            iteration,
            trials,
            ..*now
        };
        stopped.set(stopped.get() || !observe(&all));
        !stopped.get()
    };
    let mut refined: Vec<Minimum> = Vec::new();
    let mut failure = None;
    match solve(transfer, Start::Cold, newton, &mut watch) {
        Ok(plan) => count(&mut refined, plan, 1),
        Err(error) => failure = Some(error),
    }
    let mut as_coarse = |now: &Progress| {
        let phase = Phase::Coarse;
        watch(&Progress { phase, ..*now })
    };
    let mut found: Vec<Minimum> = Vec::new();
    for detour in Detours::new(settings.seed).take(settings.starts.saturating_sub(1) as usize) {
        if stopped.get() {
            break;
        }
        before.set(made.get());
        let path = paths::plan(&coarse, &end, &detour);
        if let Ok(plan) = from_guess(&coarse, &path, newton, &mut as_coarse) {
            keep(&mut found, plan, 1);
        }
    }
    rank(&mut found);
    for Minimum { plan, starts, .. } in found {
        if stopped.get() {
            break;
        }
        before.set(made.get());
        match from_guess(transfer, &plan, newton, &mut watch) {
            Ok(plan) => keep(&mut refined, plan, starts),
            Err(error) => failure = failure.or(Some(error)),
        }
    }
    rank(&mut refined);
    match failure {
        Some(error) if refined.is_empty() => Err(match error {
            PlanError::Stopped { .. } => error,
            _ if stopped.get() => PlanError::Stopped { best: None },
            _ => error,
        }),
        _ => Ok(refined),
    }
}

/// The minima that `resolve` makes of others, ranked. Those of which it makes none are left out, unless there is no other.
pub(crate) fn resolved(
    minima: Vec<Minimum>,
    mut resolve: impl FnMut(Plan) -> Result<Plan, PlanError>,
) -> Result<Vec<Minimum>, PlanError> {
    let mut found = Vec::new();
    let mut failure = None;
    for Minimum { plan, starts, .. } in minima {
        match resolve(plan) {
            Ok(plan) => count(&mut found, plan, starts),
            Err(error) => {
                let stopped = matches!(error, PlanError::Stopped { .. });
                failure = failure.or(Some(error));
                if stopped {
                    break;
                }
            }
        }
    }
    rank(&mut found);
    match failure {
        Some(error) if found.is_empty() => Err(error),
        _ => Ok(found),
    }
}

fn rank(minima: &mut [Minimum]) {
    minima.sort_by(|a, b| a.plan.total_cost().total_cmp(&b.plan.total_cost()));
}

/// [`count`], if the plan is a strict minimum.
fn keep(found: &mut Vec<Minimum>, plan: Plan, starts: u32) {
    if plan.certificate.sufficient {
        count(found, plan, starts);
    }
}

/// Adds a plan to which `starts` starts led, or adds them to those of a known plan.
fn count(found: &mut Vec<Minimum>, plan: Plan, starts: u32) {
    match found.iter_mut().find(|known| same(&known.plan, &plan)) {
        Some(known) => known.starts += starts,
        None => found.push(Minimum {
            winding: plan.winding(),
            plan,
            starts,
        }),
    }
}

fn same(a: &Plan, b: &Plan) -> bool {
    let multipliers = a.multipliers.iter().zip(&b.multipliers);
    let apart: f64 = multipliers.map(|(a, b)| (a - b).norm_squared()).sum();
    let size: f64 = a.multipliers.iter().map(|a| a.norm_squared()).sum();
    let [cost, other] = [a, b].map(Plan::total_cost);
    (cost - other).abs() <= SAME * cost.abs() && apart <= SAME * SAME * size
}

/// A final state for paths. Coordinates that the terminal set leaves free are those of the initial state.
fn end(transfer: &Transfer) -> BodyState {
    let mut end = transfer.initial;
    transfer.terminal.aim(&mut end);
    end
}
