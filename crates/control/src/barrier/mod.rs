//! The interior point method on the stages. Inequalities become smoothed exact penalties with decreasing β. Their
//! multipliers and slacks are eliminated stage by stage, so that a step is still one linear-quadratic problem.
//!
//! The iterate need not satisfy the inequalities: a violation costs at most ρ per unit. If a multiplier comes close to
//! ρ, ρ is raised. If it comes close to the highest ρ, the inequalities are infeasible. This is a penalty interior
//! point method whose slacks are optimal for the iterate.

mod elimination;
mod fuel;
mod known;
mod penalty;
mod position;
mod row;
mod schedule;
mod set;
mod varying;
mod violation;
mod wheel_speeds;

pub(crate) use known::{Force, forces};
pub(crate) use schedule::BarrierTolerances;
pub(crate) use set::{Barrier, Given};
pub(crate) use violation::Violation;
