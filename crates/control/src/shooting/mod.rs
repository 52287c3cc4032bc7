//! Newton–Armijo shooting on the initial multipliers (§4.6), the paper's method.
//!
//! [`integrate`] integrates the necessary conditions forward from initial multipliers; [`solve`] finds the multipliers
//! that reach the target.

mod extremal;
mod step;

use lgvi_lie::right_jacobian_inverse;
use nalgebra::{SMatrix, SVector};
use thiserror::Error;

pub use self::extremal::{Extremal, ExtremalError, integrate, integrate_with_sensitivity};
pub(crate) use self::step::inverse;
use crate::newton::strictness;
use crate::problem::{Vector12, block, miss};
use crate::units::Units;
use crate::{Transfer, TransferError};

/// Settings of the shooting method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Terminal error at which a solution is accepted, relative to the size of each quantity. The rounding error of a
    /// quantity is always accepted.
    pub tolerance: f64,
    /// Maximum number of Newton iterations.
    pub max_iterations: u32,
    /// Armijo's `α`: a step `c` is accepted if the terminal error falls to `(1 − 2αc)` of its value.
    pub armijo: f64,
    /// The smallest step size tried.
    pub least_step: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            tolerance: 1e-12,
            max_iterations: 200,
            armijo: 0.1,
            least_step: 1e-8,
        }
    }
}

/// The state of the iteration after a Newton step, or before the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// Newton iterations so far.
    pub iteration: u32,
    /// Number of extremals integrated so far, including the first and those of the line search.
    pub trials: u32,
    /// Accepted Armijo step; 1 before the first.
    pub step_length: f64,
    /// Norm of the terminal error `[x − x_d, γ − γ_d, log(R_dᵀ R), Π − Π_d]`, relative to the size of each quantity.
    pub violation: f64,
    /// Objective.
    pub cost: f64,
}

/// An extremal that reaches the target.
#[derive(Clone, Debug)]
pub struct Solution {
    /// States and controls.
    pub extremal: Extremal,
    /// Initial multipliers `λ_0`.
    pub multipliers: SVector<f64, 12>,
    /// The last iteration.
    pub last: Iteration,
}

/// The reason why shooting ended without a solution.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ShootingError {
    /// The transfer's values overflow or underflow in its own units.
    #[error("the transfer leaves the range of numbers in units of its own size: {0}")]
    Units(#[from] TransferError),
    /// The extremal from the initial multipliers does not exist.
    #[error("the extremal of the starting multipliers ends early: {0}")]
    Start(#[from] ExtremalError),
    /// The sensitivity matrix is singular.
    #[error("the sensitivity is singular at iteration {}: terminal error {:.3e}", .0.iteration, .0.violation)]
    Singular(Iteration),
    /// No step along the Newton direction lowers the terminal error.
    #[error(
        "no step along the Newton direction lowers the terminal error {:.3e} at iteration {}",
        .0.violation, .0.iteration
    )]
    LineSearch(Iteration),
    /// The maximum number of iterations was reached.
    #[error("terminal error {:.3e} after {} iterations, expected at most {tolerance:.1e}", .last.violation, .last.iteration)]
    MaxIterations {
        /// The last iteration.
        last: Iteration,
        /// Tolerance of the terminal error.
        tolerance: f64,
    },
    /// The caller asked to stop.
    #[error("stopped at iteration {}: terminal error {:.3e}", .0.iteration, .0.violation)]
    Stopped(Iteration),
}

/// Solves `transfer` from the initial multipliers `start`; zero starts from the free drift.
///
/// `observe` is called with every iteration, including the start, and stops the iteration by returning `false`.
pub fn solve(
    transfer: &Transfer,
    start: SVector<f64, 12>,
    settings: &Settings,
    mut observe: impl FnMut(&Iteration) -> bool,
) -> Result<Solution, ShootingError> {
    if transfer.uses_propellant() {
        return Err(ExtremalError::Unsupported.into());
    }
    let units = Units::of(transfer);
    let own = units.transfer(transfer)?;
    let observe = |now: &Iteration| observe(&units.leave_iteration(now));
    shoot(&own, units.enter_multipliers(&start), settings, observe)
        .map(|solution| Solution {
            extremal: units.leave_extremal(solution.extremal),
            multipliers: units.leave_multipliers(&solution.multipliers),
            last: units.leave_iteration(&solution.last),
        })
        .map_err(|error| units.leave_shooting(error))
}

/// [`solve`] in the transfer's units.
fn shoot(
    transfer: &Transfer,
    start: SVector<f64, 12>,
    settings: &Settings,
    mut observe: impl FnMut(&Iteration) -> bool,
) -> Result<Solution, ShootingError> {
    let target = transfer
        .terminal
        .state()
        .ok_or(ExtremalError::Unsupported)?;
    let mut multipliers = start;
    let (mut extremal, mut sensitivity) = integrate_with_sensitivity(transfer, &multipliers)?;
    let tolerance = settings.tolerance.max(f64::EPSILON);
    let strictness = strictness(&(transfer.rounding / tolerance));
    let violation = |miss: &Vector12| strictness.component_mul(miss).norm();
    let mut error = miss(&target, extremal.end());
    let mut now = Iteration {
        iteration: 0,
        trials: 1,
        step_length: 1.0,
        violation: violation(&error),
        cost: extremal.cost,
    };
    loop {
        if !observe(&now) {
            return Err(ShootingError::Stopped(now));
        }
        if now.violation <= tolerance {
            return Ok(Solution {
                extremal,
                multipliers,
                last: now,
            });
        }
        if now.iteration >= settings.max_iterations {
            return Err(ShootingError::MaxIterations {
                last: now,
                tolerance,
            });
        }
        let direction =
            newton_direction(&error, &sensitivity).ok_or(ShootingError::Singular(now))?;
        now.iteration += 1;
        now.step_length = 1.0;
        loop {
            let trial = multipliers + now.step_length * direction;
            now.trials += 1;
            let reached = integrate(transfer, &trial).map_or(f64::INFINITY, |extremal| {
                violation(&miss(&target, extremal.end()))
            });
            if reached <= (1.0 - 2.0 * settings.armijo * now.step_length) * now.violation {
                multipliers = trial;
                break;
            }
            now.step_length /= 10.0;
            if now.step_length < settings.least_step {
                return Err(ShootingError::LineSearch(now));
            }
        }
        (extremal, sensitivity) = integrate_with_sensitivity(transfer, &multipliers)?;
        error = miss(&target, extremal.end());
        now.violation = violation(&error);
        now.cost = extremal.cost;
    }
}

/// `−(∂miss/∂λ_0)⁻¹ miss`. The attitude rows of the sensitivity are multiplied by `J_r⁻¹` to give those of `log(R_dᵀ
/// R)`.
fn newton_direction(miss: &Vector12, sensitivity: &SMatrix<f64, 12, 12>) -> Option<Vector12> {
    let mut jacobian = *sensitivity;
    let attitude = right_jacobian_inverse(&block(miss, 2)) * sensitivity.fixed_rows::<3>(6);
    jacobian.fixed_rows_mut::<3>(6).copy_from(&attitude);
    jacobian.lu().solve(&-miss)
}

#[cfg(test)]
mod tests;
