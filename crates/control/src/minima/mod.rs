//! The local minima of a transfer, ranked.

mod paths;
mod winding;

use std::cell::Cell;

use lgvi_dynamics::BodyState;

use crate::solver::{
    NewtonSettings, Phase, PlanError, Progress, Start, from_guess, solve_in_own_units as solve,
};
use crate::units::Units;
use crate::{Plan, Transfer};
use paths::Detours;
pub use winding::Winding;

/// How local minima are searched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchSettings {
    /// Paths to start from, the cold start included.
    pub starts: u32,
    /// Of the random ones among them.
    pub seed: u64,
    /// Of each solution.
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
    /// How it turns the body.
    pub winding: Winding,
    /// How many starts led to it at the coarse resolution.
    pub starts: u32,
}

/// Costs and multipliers of one minimum agree to this, relatively.
const SAME: f64 = 1e-6;

/// Searches local minima of `transfer` from paths that wind otherwise about the geodesic's axis and the body's, and from
/// random ones; each found once, the cheapest first.
///
/// The first start is that of [`crate::solve`], at all intervals, so that the cheapest is never dearer than its plan. Other minima
/// are searched at the solver's coarse resolution and then refined, the cheapest first. `observe` sees the iterations of
/// all, counted through; if it returns `false`, the search ends with what there is at all intervals, if there is something.
///
/// # Assumptions and limitations
/// A search proves nothing about what it has not found. Of plans that are no strict minima only that of the first start is
/// returned.
///
/// # Errors
/// What the solver says of the cold start, if no start leads to a minimum.
pub fn search(
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
    // Iterations and trials of the solutions before, and of this one too.
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

fn rank(minima: &mut [Minimum]) {
    minima.sort_by(|a, b| a.plan.cost.total_cmp(&b.plan.cost));
}

/// [`count`], where the plan is a strict minimum.
fn keep(found: &mut Vec<Minimum>, plan: Plan, starts: u32) {
    if plan.certificate.sufficient {
        count(found, plan, starts);
    }
}

/// Adds a plan to which so many starts led, or counts them to it.
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
    (a.cost - b.cost).abs() <= SAME * a.cost.abs() && apart <= SAME * SAME * size
}

/// An end for paths to lead to: what the terminal set leaves free is as at the start.
fn end(transfer: &Transfer) -> BodyState {
    let mut end = transfer.initial;
    transfer.terminal.aim(&mut end);
    end
}
