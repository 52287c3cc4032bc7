//! Constraints on states that hold with a probability.
//!
//! To first order a flight deviates from its plan by `z_k = S_k ξ`, where ξ are independent standard normal numbers. An inequality
//! `g` then deviates by `σ = |Sᵀ ∂g|` and holds with the probability of κ standard deviations if `g + κ σ ≤ 0`. The
//! deviations are those of the closed loop, `S_{k+1} = (A_k − B_k K_k) S_k + B_k diag(u_k) E`. They depend on the plan, so it is solved
//! again with those of the plan before, until it keeps its own.

use nalgebra::{SMatrix, SVector};

use super::error::PlanError;
use super::progress::{NewtonSettings, Progress, Start};
use super::solve_plain;
use crate::discrete::{DiscreteDynamics, KickDriftKick, Linearization};
use crate::problem::constraint::Coordinates;
use crate::problem::{Chances, Deviations, InequalitySet, StateInequality, Uncertainty, stacked};
use crate::{Actuation, Plan, Transfer};

/// Maximum number of plans.
const ROUNDS: u32 = 12;
/// Part of the largest spread by which spreads may differ from those that were planned with.
const SETTLED: f64 = 1e-3;
/// By how much `g + κ σ` may exceed zero.
const TOLERANCE: f64 = 1e-6;

/// Solves a transfer whose inequalities on states hold with a probability.
pub(super) fn solve(
    transfer: &Transfer,
    chances: &Chances,
    start: Start<'_>,
    settings: &NewtonSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    if transfer.actuation.is_of_wheels() || transfer.actuation.is_fixed_to_body() {
        let beside = "commands of actuators that turn with the body";
        return Err(PlanError::ChancesBeside { beside });
    }
    let mut own = transfer.clone();
    let mut made = [0; 2];
    let mut before: Option<Plan> = None;
    let mut last = Worst::default();
    let mut used = vec![vec![0.0; transfer.intervals + 1]; transfer.inequalities.state.len()];
    for round in 1..=ROUNDS {
        let earlier = made;
        let mut watch = |now: &Progress| {
            made = [earlier[0] + now.iteration, earlier[1] + now.trials];
            observe(&Progress {
                iteration: made[0],
                trials: made[1],
                ..*now
            })
        };
        let start = before.as_ref().map_or(start, Start::Warm);
        let plan = solve_plain(&own, start, settings, &mut watch)?;
        let spreads = spreads(transfer, chances, &plan)?;
        last = worst(&transfer.inequalities, transfer.h, &plan, &spreads);
        if std::env::var("D").is_ok() {
            for (r, sp) in spreads.iter().enumerate() {
                let row = &transfer.inequalities.state[r];
                let vals: Vec<(usize, f64, f64, f64)> = (1..plan.states.len())
                    .map(|k| {
                        (
                            k,
                            row.value_at(transfer.h * k as f64, &plan.states[k]),
                            sp[k],
                            used[r][k],
                        )
                    })
                    .collect();
                let m = vals
                    .iter()
                    .max_by(|a, b| (a.1 + a.2).total_cmp(&(b.1 + b.2)))
                    .unwrap();
                let m2 = vals
                    .iter()
                    .max_by(|a, b| (a.1 + a.3).total_cmp(&(b.1 + b.3)))
                    .unwrap();
                println!(
                    "round {round} row {r}: {m:?} used {m2:?} cost {}",
                    plan.cost
                );
            }
        }
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

/// The largest `g + κ σ` above zero.
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

/// `κ σ` of each inequality on states, at the states `0 … N`.
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
                quantile * here.deviation(state, deviations)
            }
            Some(_) => 0.0,
        });
        spread.collect()
    };
    Ok(transfer.inequalities.state.iter().map(through).collect())
}

/// `S_k` at the states `0 … N` of a plan: of all coordinates under loads, as it is flown.
pub(crate) fn deviations(
    transfer: &Transfer,
    uncertainty: &Uncertainty,
    plan: &Plan,
) -> Result<Vec<Deviations>, PlanError> {
    let identity = SMatrix::identity();
    let flown = Transfer {
        actuation: Actuation::full(&identity, &identity).map_err(crate::TransferError::from)?,
        ..transfer.clone()
    };
    let steps = KickDriftKick::<_, 2, 6>::full(&flown);
    let inputs = steps.inputs();
    let mut dynamics = Linearization::default();
    let mut now = uncertainty.initial(&transfer.body);
    let mut all = vec![now];
    for (k, control) in plan.controls.iter().enumerate() {
        let load = stacked(control);
        let linearized = steps.linearize(k, &plan.states[k], &load, &mut dynamics);
        linearized.map_err(|source| PlanError::Dynamics { step: k, source })?;
        let gain = plan.feedback.get(k).filter(|_| uncertainty.feedback);
        let mut next = Deviations::zeros();
        for (source, column) in now.column_iter().enumerate() {
            let z: SVector<f64, 12> = column.into_owned();
            let mut change = SVector::<f64, 6>::zeros();
            if let Some(gain) = gain {
                change -= gain * z;
            }
            if let Some(component) = source.checked_sub(12) {
                let error = if component < 3 {
                    uncertainty.force_error
                } else {
                    uncertainty.moment_error
                };
                change[component] += error * load[component];
            }
            next.set_column(source, &dynamics.forward(&inputs, &z, &change));
        }
        now = next;
        if std::env::var("D2").is_ok() {
            println!(
                "k {k} x {:.4} p {:.4} r {:.4} l {:.4} gain {:.2}",
                now.fixed_rows::<3>(0).norm(),
                now.fixed_rows::<3>(3).norm(),
                now.fixed_rows::<3>(6).norm(),
                now.fixed_rows::<3>(9).norm(),
                plan.feedback[k].norm()
            );
        }
        all.push(now);
    }
    Ok(all)
}

impl StateInequality {
    /// The standard deviation of `g` at a state with these deviations, in the units of the constraint.
    fn deviation(&self, state: &lgvi_dynamics::BodyState, deviations: &Deviations) -> f64 {
        let (gradient, _) = self.derivatives(state);
        let mut by_state = SVector::<f64, 12>::zeros();
        let offset = match self.coordinates() {
            Coordinates::Position | Coordinates::Pose => 0,
            Coordinates::LinearMomentum => 3,
            Coordinates::Attitude => 6,
            Coordinates::AngularMomentum => 9,
        };
        by_state.fixed_rows_mut::<3>(offset).copy_from(&gradient);
        if self.coordinates() == Coordinates::Pose {
            let by_attitude = self.by_attitude(state).gradient;
            by_state.fixed_rows_mut::<3>(6).copy_from(&by_attitude);
        }
        deviations.tr_mul(&by_state).norm()
    }
}
