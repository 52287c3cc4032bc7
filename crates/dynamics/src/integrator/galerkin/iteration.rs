use std::f64::consts::PI;

use super::curve::greater;
use crate::integrator::StepError;
use crate::{BodyState, Mobility, RigidBody};

/// Correction, relative to the unknowns, below which the iteration has converged.
const ROUNDING: f64 = f64::EPSILON;

/// Correction, relative to the quantity to which the unknowns are added (a full angle, a position), that may be due to
/// rounding of the loads.
const NOISE: f64 = 1e-13;

/// Relative correction above which the next pass renews the Jacobian.
const STALE: f64 = 1e-3;

/// Smallest convergence rate used to predict the next correction, because the last corrections may shrink more slowly
/// than those before.
const SLOWEST: f64 = 0.1;

/// Number of passes that may reduce the correction by less than a tenth.
const PATIENCE: u32 = 3;

/// The change of the unknowns in a pass.
#[derive(Clone, Copy, Default)]
pub(super) struct Progress {
    /// Largest correction relative to the unknowns.
    relative: f64,
    /// Largest correction relative to the unknowns plus the quantity to which they are added.
    absolute: f64,
}

impl Progress {
    /// The progress of a `correction` of unknowns of magnitude `size`, which are added to a quantity of magnitude
    /// `base`.
    pub(super) fn new(correction: f64, size: f64, base: f64) -> Self {
        if correction == 0.0 {
            return Self::default();
        }
        Self {
            relative: correction / size,
            absolute: correction / (size + base),
        }
    }

    /// The larger progress of two sets of unknowns.
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            relative: greater(self.relative, other.relative),
            absolute: greater(self.absolute, other.absolute),
        }
    }
}

/// An iteration that stopped without converging.
pub(super) struct Stall {
    pub(super) iterations: u32,
    /// The last correction, relative.
    pub(super) residual: f64,
}

impl Stall {
    /// The error of a step `h` from `states` that stalled.
    pub(super) fn explain(&self, bodies: &[RigidBody], states: &[BodyState], h: f64) -> StepError {
        for (body, (rigid, state)) in bodies.iter().zip(states).enumerate() {
            let turn = h.abs() * state.angular_velocity(rigid).norm();
            let turns = matches!(rigid.mobility(), Mobility::Free | Mobility::Pivoted);
            if turns && turn >= PI {
                return StepError::TurnsTooFar { body, turn };
            }
        }
        StepError::NotConverged {
            iterations: self.iterations,
            residual: self.residual,
            tolerance: NOISE,
        }
    }
}

/// Repeats `pass` until its corrections are at rounding level. On failure, returns the last relative correction. The
/// argument of `pass` is true if it must renew its Jacobian. Adds the number of passes to `iterations`.
pub(super) fn iterate(
    limit: u32,
    iterations: &mut u32,
    mut pass: impl FnMut(bool) -> Progress,
) -> Result<(), f64> {
    let mut before = f64::NAN;
    let mut residual = f64::NAN;
    let mut linearize = true;
    let mut failures = 0;
    for _ in 0..limit {
        let Progress { relative, absolute } = pass(linearize);
        *iterations += 1;
        residual = absolute;
        let rate = relative / before;
        let done = relative <= ROUNDING || rate < 0.5 && relative * rate.max(SLOWEST) <= ROUNDING;
        let at_noise = rate > 0.5 && absolute <= NOISE;
        if done || at_noise {
            return Ok(());
        }
        failures += u32::from(rate > 0.9);
        if failures >= PATIENCE || !relative.is_finite() {
            break;
        }
        linearize = relative > STALE;
        before = relative;
    }
    Err(residual)
}
