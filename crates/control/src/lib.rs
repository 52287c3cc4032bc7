//! Discrete optimal control of one rigid body on SE(3) (§4).
//!
//! Pure mathematics: no I/O, no clock, no thread. A [`Transfer`] states the problem. [`extremal`] integrates the
//! necessary conditions forward from initial multipliers, with their sensitivities on demand; [`shooting`] finds the
//! multipliers that reach the target.
//!
//! Equation numbers are those of M. Leok, *An Overview of Lie Group Variational Integrators and Their Applications to
//! Optimal Control*. Variations are `z = [δx, δγ, ζ, δΠ] ∈ ℝ¹²` with `δR = R S(ζ)`; multipliers `λ` pair with them.

// Test cases name the crate as they do from outside.
#[cfg(test)]
extern crate self as lgvi_control;

mod barrier;
pub mod extremal;
mod final_time;
mod minima;
mod newton;
mod plan;
mod problem;
pub mod processing;
mod replan;
mod riccati;
pub mod shooting;
mod solver;
mod stage;
mod steps;
mod units;

pub use final_time::{FinalTime, FinalTimeError, TimeOptimality, TimedPlan, solve_final_time};
pub use minima::{Minimum, SearchSettings, Winding, search};
pub use plan::{Certificate, Plan};
pub use problem::{
    Actuation, ActuationError, Constraint, ConstraintError, Dynamics, Motion, RotationTarget,
    Terminal, TerminalError, Transfer, TransferError, TranslationTarget, miss,
};
pub use replan::TooLate;
pub use shooting::{Iteration, Settings, ShootingError, Solution};
pub use solver::{NewtonSettings, Phase, PlanError, Progress, Start, certified, solve};
