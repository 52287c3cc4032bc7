//! Several bodies planned together, which keep apart.
//!
//! The bodies share the inequalities `g(x_i − x_j) ≤ 0` of each pair, and the sum of their costs is least. Each body is planned by
//! itself: of a pair, the more compliant body, its *owner*, has the inequality, with the last path of the other one as data. The
//! other one has its price instead: the known cost `Σ f_k · x_j(k)` with `f = y ∂g/∂x_j`, where `y` are the owner's multipliers. Where
//! the prices are those of the owner's own plan, the necessary conditions of all bodies are those of the joint problem, with the
//! same multipliers.
//!
//! A round plans each body once, the least compliant first, so that its plans always keep apart at the ends of steps. It maps prices to
//! prices `F(f)`. With compliances in the ratio `ρ ≤ 1` its slope is about `−ρ`, so that `f + ½ (F(f) − f)` contracts by
//! `½ (1 − ρ)`. Anderson's acceleration of this iteration copes with what the ratio does not tell.

mod bodies;
mod check;
mod error;
mod near;
mod separation;
mod sides;
#[cfg(test)]
mod tests;

use std::cell::Cell;

use crate::{NewtonSettings, Plan, Progress, Transfer, solve};
use bodies::Bodies;
pub use check::check_together;
use check::check_warm;
pub use error::FormationError;

/// Plans of several bodies that keep apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Formation {
    /// The plan of each body, in the order of the transfers.
    pub plans: Vec<Plan>,
    /// How well the plans fit each other.
    pub agreement: Agreement,
}

impl Formation {
    /// The sum of the plans' objectives.
    pub fn total_cost(&self) -> f64 {
        self.plans.iter().map(Plan::total_cost).sum()
    }
}

/// How well the plans of several bodies fit each other, beside the certificate of each plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// Number of rounds in which each body was planned.
    pub rounds: u32,
    /// Norm of the difference between the prices that bodies paid for their paths and the multipliers of those that keep away
    /// from them, relative to the prices: the error of the joint necessary conditions.
    pub price: f64,
    /// The least distance between two bodies, along the motions that steps stand for.
    pub distance: f64,
    /// These bodies.
    pub nearest: [usize; 2],
}

/// Plans transfers together at the least sum of their costs so that no two bodies come nearer to each other than `separation`, along
/// the whole of their steps. It starts from `warm`, a plan of each transfer, such as the rest of an earlier formation, and from nothing
/// if that is empty. `observe` is called with the iterations of all plans, counted consecutively, and stops the
/// solver by returning `false`.
///
/// # Assumptions and limitations
/// The bodies do not act on each other. All transfers have the same steps; costs are in the same unit. The formation is a local
/// optimum: the sides on which bodies pass each other are those of `warm`, or chosen one body after the other, the cheapest of four. That it is a minimum
/// for joint changes of all plans is not certified; each plan is one beside the others.
///
/// # Errors
/// Returns an error if the transfers cannot be planned together, if `warm` has plans that are not of their steps, if one has no plan, or if
/// prices do not settle.
pub fn solve_together(
    transfers: &[Transfer],
    separation: f64,
    warm: &[Plan],
    settings: &NewtonSettings,
    mut observe: impl FnMut(&Progress) -> bool,
) -> Result<Formation, FormationError> {
    check_together(transfers, separation)?;
    check_warm(transfers, warm)?;
    let mut order: Vec<usize> = (0..transfers.len()).collect();
    let compliances: Vec<_> = transfers.iter().map(compliance).collect();
    order.sort_by(|a, b| compliances[*a].total_cmp(&compliances[*b]));
    let mut made = [0; 2];
    let mut bodies = Bodies {
        transfers,
        separation,
        order,
        solve: Box::new(|transfer, start| {
            let latest = Cell::new(made);
            let plan = solve(transfer, start, settings, |now| {
                latest.set([made[0] + now.iteration, made[1] + now.trials]);
                let [iteration, trials] = latest.get();
                observe(&Progress {
                    iteration,
                    trials,
                    ..*now
                })
            });
            made = latest.get();
            plan
        }),
        plans: Vec::new(),
        paths: Vec::new(),
        near: Vec::new(),
        keeps_sides: !warm.is_empty(),
    };
    match warm {
        [] => bodies.free()?,
        warm => bodies.begin(warm),
    }
    bodies.settle()
}

/// How far a price of its path moves the body, up to a factor that is the same for all bodies.
fn compliance(transfer: &Transfer) -> f64 {
    let actuation = &transfer.actuation;
    let columns = (0..actuation.commands()).map(|command| {
        let force = actuation.matrix().fixed_view::<3, 1>(0, command);
        force.norm_squared() / actuation.weight()[(command, command)]
    });
    columns.sum::<f64>() / transfer.body.mass().powi(2)
}
