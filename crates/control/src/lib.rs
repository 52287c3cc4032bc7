//! Discrete optimal control of one rigid body on SE(3) (§4).
//!
//! ```
//! use lgvi_control::nalgebra::{Matrix3, Vector3};
//! use lgvi_control::{Actuation, NewtonSettings, Start, Transfer, solve};
//! use lgvi_dynamics::gravity::Central;
//! use lgvi_dynamics::{BodyState, Inertia, RigidBody};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // An eighth of a circular orbit in 50 steps, to rise by a tenth and turn by 90° on the way.
//! let body = RigidBody::new(1.0, Inertia::principal([0.01, 0.02, 0.025])?, vec![])?;
//! let (still, upright) = (Vector3::zeros(), Matrix3::identity());
//! let initial = BodyState::from_velocities(&body, Vector3::x(), Vector3::y(), upright, still);
//! let there = 1.1 * Vector3::new(0.5_f64.sqrt(), 0.5_f64.sqrt(), 0.0);
//! let quarter = lgvi_lie::exp(&Vector3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2));
//! let target = BodyState::from_velocities(&body, there, still, quarter, still);
//!
//! let h = std::f64::consts::FRAC_PI_4 / 50.0;
//! let field = Central { gm: 1.0 };
//! let actuation = Actuation::full(&Matrix3::identity(), &Matrix3::identity())?;
//! let transfer = Transfer::new(body, field, h, 50, initial, target, actuation)?;
//! let plan = solve(&transfer, Start::Cold, &NewtonSettings::default(), |_| true)?;
//! assert!(plan.certificate.terminal < 1e-12 && plan.certificate.sufficient);
//! # Ok(())
//! # }
//! ```
//!
//! Pure mathematics: no I/O, no clock, no thread. A [`Transfer`] states the problem, and [`solve`] plans it by Newton's method on all steps.
//! [`shooting`] is the method of the paper: it integrates the necessary conditions forward from initial multipliers and
//! finds those that reach the target.
//!
//! Equation numbers are those of M. Leok, *An Overview of Lie Group Variational Integrators and Their Applications to
//! Optimal Control*. Variations are `z = [δx, δγ, ζ, δΠ] ∈ ℝ¹²` with `δR = R S(ζ)`; multipliers `λ` pair with them.

// Test cases refer to the crate by its external name.
#[cfg(test)]
extern crate self as lgvi_control;

mod anderson;
mod barrier;
mod discrete;
mod final_time;
mod formation;
mod multistart;
mod newton;
mod plan;
mod problem;
pub mod processing;
mod propellant;
mod replan;
mod rescheduled;
mod riccati;
pub mod shooting;
mod solver;
mod sweep;
mod units;
mod wheels;

pub use lgvi_lie::nalgebra;

pub use final_time::{
    FinalTime, FinalTimeError, MinimumTime, TimeOptimality, TimeRange, TimedPlan,
    search_minimum_time, solve_final_time, solve_minimum_time,
};
pub use formation::{Agreement, Formation, FormationError, check_together, solve_together};
pub use multistart::{Minimum, SearchSettings, Winding, search};
pub use plan::{Certificate, Plan, Switching};
pub use problem::{
    Actuation, ActuationError, Allocation, Chances, Command, Comparable, Constraint, Dynamics,
    MAX_COMMANDS, Motion, ParameterError, Place, Terminal, Transfer, TransferError, Uncertainty,
    miss,
};
pub use problem::{constraint, terminal};
pub use replan::TooLate;
pub use solver::{NewtonSettings, Phase, PlanError, Progress, Start, certified, solve};
pub use sweep::Sweep;
