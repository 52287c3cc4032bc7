use std::f64::consts::PI;

use super::curve::greater;
use crate::integrator::StepError;
use crate::{BodyState, Mobility, RigidBody};

/// Correction, relative to the unknowns it corrects, below which nothing is left to correct.
const ROUNDING: f64 = f64::EPSILON;

/// Correction, relative to what the unknowns are added to (a whole angle, a position), that may be rounding of the loads.
const NOISE: f64 = 1e-13;

/// Relative change of the unknowns since it was made that makes a Jacobian worth renewing.
const STALE: f64 = 1e-3;

/// Rate at which the last corrections may shrink where those before shrank faster.
const SLOWEST: f64 = 0.1;

/// Passes that may fail to shrink the correction by a tenth.
const PATIENCE: u32 = 3;

/// How far a pass moved the unknowns.
#[derive(Clone, Copy, Default)]
pub(super) struct Progress {
    /// Greatest correction relative to the unknowns.
    relative: f64,
    /// The same relative to what they are added to.
    absolute: f64,
}

impl Progress {
    /// By a `correction` of unknowns of a `size` that are added to something of size `base`.
    pub(super) fn new(correction: f64, size: f64, base: f64) -> Self {
        if correction == 0.0 {
            return Self::default();
        }
        Self {
            relative: correction / size,
            absolute: correction / (size + base),
        }
    }

    /// Of both kinds of unknowns.
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            relative: greater(self.relative, other.relative),
            absolute: greater(self.absolute, other.absolute),
        }
    }
}

/// An iteration that stopped short of a solution.
pub(super) struct Stall {
    pub(super) iterations: u32,
    /// The last correction, relative.
    pub(super) residual: f64,
}

impl Stall {
    /// The error of a step `h` from `states` that ended so.
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

/// Repeats `pass` until its corrections are rounding, or returns the last of them, relative; it is told whether to renew its
/// Jacobian. Adds the passes made to `iterations`.
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
