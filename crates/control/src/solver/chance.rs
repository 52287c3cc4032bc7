//! Constraints on states that hold with a probability.
//!
//! To first order a flight deviates from its plan by `z_k = S_k ξ`, where ξ are independent standard normal numbers. The deviations
//! are those of the closed loop. An inequality `g` holds with the probability of κ
//! standard deviations if it holds at the likeliest deviation of this size, `ξ = κ Sᵀ∂g/|Sᵀ∂g|` with the gradient there (the
//! first-order reliability method, Hasofer and Lind 1974). The deviations depend on the plan, so it is solved again with those of
//! the plan before, until it keeps its own.

use lgvi_dynamics::BodyState;
use lgvi_lie::exp;

use super::deviations::deviations;
use super::error::PlanError;
use super::progress::{Consecutive, NewtonSettings, Progress, Start};
use super::solve_plain;
use crate::multistart::{resolved, search_plain};
use crate::problem::{Chances, Deviations, InequalitySet, StateInequality, Vector12, block};
use crate::{Minimum, Motion, Plan, SearchSettings, Transfer};

/// Maximum number of plans.
const ROUNDS: u32 = 12;
/// Number of gradients by which the likeliest deviation is found.
const DIRECTIONS: u32 = 4;
/// Part of the largest spread by which spreads may differ from those that were planned with.
const SETTLED: f64 = 1e-3;
/// By how much an inequality may be exceeded.
const TOLERANCE: f64 = 1e-6;

/// Solves a transfer whose inequalities on states hold with a probability.
pub(super) fn solve(
    transfer: &Transfer,
    chances: &Chances,
    start: Start<'_>,
    settings: &NewtonSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    if transfer.actuation.is_fixed_to_body() && transfer.motion != Motion::Full {
        let beside = "thrusters that control only a part of the motion";
        return Err(PlanError::ChancesBeside { beside });
    }
    if transfer.uses_propellant() {
        let beside = "actuators that use propellant";
        return Err(PlanError::ChancesBeside { beside });
    }
    let mut own = transfer.clone();
    let mut progress = Consecutive::new(observe);
    let mut before: Option<Plan> = None;
    let mut last = Worst::default();
    let mut used = vec![vec![0.0; transfer.intervals + 1]; transfer.inequalities.state.len()];
    for round in 1..=ROUNDS {
        let start = before.as_ref().map_or(start, Start::Warm);
        let plan = solve_plain(&own, start, settings, &mut progress.next())?;
        let spreads = spreads(transfer, chances, &plan)?;
        last = worst(&transfer.inequalities, transfer.h, &plan, &spreads);
        let settled = round == ROUNDS || !differ(&used, &spreads);
        if last.excess <= TOLERANCE && settled {
            return Ok(plan);
        }
        own.inequalities = transfer.inequalities.spread(spreads.clone());
        used = spreads;
        before = Some(plan);
    }
    let inequality = &transfer.inequalities.state[last.row];
    Err(PlanError::Chance {
        constraint: inequality.index,
        step: last.step,
        violation: inequality.excess(last.excess),
        best: before.map(Box::new),
    })
}

/// [`crate::search`] for such a transfer, among the minima without deviations.
pub(crate) fn search(
    transfer: &Transfer,
    chances: &Chances,
    settings: &SearchSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Vec<Minimum>, PlanError> {
    let certain = Transfer {
        chances: None,
        ..transfer.clone()
    };
    let mut progress = Consecutive::new(observe);
    let minima = search_plain(&certain, settings, &mut progress.next())?;
    resolved(minima, |plan| {
        let (start, newton) = (Start::Warm(&plan), &settings.newton);
        solve(transfer, chances, start, newton, &mut progress.next())
    })
}

/// Returns true if spreads differ by more than a small part of the largest.
fn differ(one: &[Vec<f64>], other: &[Vec<f64>]) -> bool {
    let all = |spreads: &[Vec<f64>]| spreads.iter().flatten().copied().collect::<Vec<f64>>();
    let [one, other] = [all(one), all(other)];
    let largest = other.iter().copied().fold(0.0, f64::max);
    let mut pairs = one.iter().zip(&other);
    pairs.any(|(one, other)| (one - other).abs() > SETTLED * largest)
}

/// An inequality that is exceeded by deviations, and the step at whose end it is.
#[derive(Clone, Copy, Debug, Default)]
struct Worst {
    row: usize,
    step: usize,
    excess: f64,
}

/// The inequality that deviations exceed the most.
fn worst(set: &InequalitySet, h: f64, plan: &Plan, spreads: &[Vec<f64>]) -> Worst {
    let intervals = plan.commands.len();
    let rows = set.state.iter().zip(spreads).enumerate();
    let values = rows.flat_map(|(row, (inequality, spread))| {
        let applies = inequality.applies(intervals);
        let ends = plan.states.iter().zip(spread).enumerate().skip(1);
        ends.filter(move |(end, _)| applies[end - 1] && inequality.price.is_none())
            .map(move |(end, (state, spread))| Worst {
                row,
                step: end - 1,
                excess: inequality.value_at(h * end as f64, state) + spread,
            })
    });
    let largest = values.max_by(|a, b| a.excess.total_cmp(&b.excess));
    largest.unwrap_or_default()
}

/// By how much deviations may raise each inequality on states, at the states `0 … N`.
fn spreads(
    transfer: &Transfer,
    chances: &Chances,
    plan: &Plan,
) -> Result<Vec<Vec<f64>>, PlanError> {
    let deviations = deviations(transfer, &chances.uncertainty, plan)?;
    let quantile = chances.quantile();
    let through = |row: &StateInequality| {
        let intervals = plan.commands.len();
        let moving = row.through(transfer.h, intervals);
        let states = plan.states.iter().zip(&deviations).enumerate();
        let spread = states.map(|(at, (state, deviations))| match row.price {
            None => {
                // A frame that moves has hardly turned in the first step.
                let here = moving.get(at.saturating_sub(1)).unwrap_or(row);
                here.raised(state, deviations, quantile)
            }
            Some(_) => 0.0,
        });
        spread.collect()
    };
    Ok(transfer.inequalities.state.iter().map(through).collect())
}

impl StateInequality {
    /// By how much the likeliest deviation of `quantile` standard deviations raises `g` at a state.
    fn raised(&self, state: &BodyState, deviations: &Deviations, quantile: f64) -> f64 {
        let mut farthest = *state;
        if self.gradient(state) == Vector12::zeros() {
            // A limit of a norm about rest: any direction raises it.
            let sources = deviations.column_iter();
            let ends = sources.map(|source| deviated(state, &(quantile * source)));
            let highest = ends.max_by(|a, b| self.value(a).total_cmp(&self.value(b)));
            farthest = highest.unwrap_or(farthest);
        }
        for _ in 0..DIRECTIONS {
            let along = deviations.tr_mul(&self.gradient(&farthest));
            let size = along.norm();
            if size == 0.0 {
                break;
            }
            farthest = deviated(state, &(deviations * (along * (quantile / size))));
        }
        self.value(&farthest) - self.value(state)
    }

    /// The derivatives of `g` by `[δx, δγ, ζ, δΠ]`.
    fn gradient(&self, state: &BodyState) -> Vector12 {
        let (own, _) = self.derivatives(state);
        let mut gradient = Vector12::zeros();
        let [first, second] = self.coordinates().groups([Some(0), Some(6)]);
        if let Some(offset) = first {
            gradient.fixed_rows_mut::<3>(offset).copy_from(&own);
        }
        if let Some(offset) = second {
            let own = self.by_second(state).gradient;
            gradient.fixed_rows_mut::<3>(offset).copy_from(&own);
        }
        gradient
    }
}

fn deviated(state: &BodyState, by: &Vector12) -> BodyState {
    BodyState {
        position: state.position + block(by, 0),
        linear_momentum: state.linear_momentum + block(by, 1),
        attitude: state.attitude * exp(&block(by, 2)),
        angular_momentum: state.angular_momentum + block(by, 3),
    }
}
