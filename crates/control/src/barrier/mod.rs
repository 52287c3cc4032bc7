//! The interior point method on the stages: inequalities as smoothed exact penalties whose β falls, their multipliers
//! and slacks eliminated stage by stage, so that a step is still one linear-quadratic problem.
//!
//! The iterate need not satisfy the inequalities: a violation costs ρ at most. Where a multiplier comes near ρ, ρ rises,
//! and where it comes near the highest ρ, the inequalities are infeasible (a penalty interior point method, with the
//! slacks at their best for the iterate).

mod elimination;
mod known;
mod penalty;
mod row;
mod schedule;
mod set;

pub(crate) use known::forces;
pub(crate) use schedule::BarrierTolerances;
pub(crate) use set::{Barrier, Given, Violation};
