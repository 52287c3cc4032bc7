//! The processing of §4.5: Lie–Euler plans of second order.
//!
//! With `D` the free motion and `K` the kick of loads, a Lie–Euler step is `K_h D_h`, and
//! `D_{h/2} (K_h D_h)ᴺ D_{−h/2} = (D_{h/2} K_h D_{h/2})ᴺ`: half a drift makes a method of second order of it, in which every
//! control acts in the middle of its interval. So a plan between the boundary states half a drift early is, half a drift
//! later, one of second order between the true ones. Nothing of its controls changes: flown from the true initial state,
//! each constant over its interval, by an accurate integrator or by the LGVI, they miss the target by `O(h²)` where a plain
//! Lie–Euler plan's miss it by `O(h)`, and the cost is that close to the continuous problem's.

use lgvi_dynamics::rotation::Unsolvable;
use lgvi_dynamics::{BodyState, RigidBody};
use nalgebra::{Matrix3, SMatrix};
use thiserror::Error;

use crate::problem::Dynamics;
use crate::steps::{Coordinates, Full};
use crate::{Plan, Transfer, TransferError};

/// Why a transfer or a plan is not processed.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ProcessingError {
    /// The dynamics are of second order already.
    #[error("the LGVI needs no processing: expected Lie–Euler dynamics")]
    Dynamics,
    /// The terminal set has more than one state.
    #[error("half a drift early the terminal set is none of those known: expected a single state")]
    Terminal,
    /// The body turns too far in half a step.
    #[error("{which}: {source}")]
    Unsolvable {
        /// Of which state.
        which: &'static str,
        /// By how much.
        source: Unsolvable,
    },
    /// Half a drift early it is no transfer.
    #[error("half a drift early: {0}")]
    Transfer(#[from] TransferError),
}

/// The transfer to plan instead of `transfer`: between its boundary states half a drift early.
///
/// # Assumptions and limitations
/// Its states are half a drift early, and so inequalities on states are imposed early by half a step. The step is given: a
/// free final time would shift the boundary states with it.
pub fn processed(transfer: Transfer) -> Result<Transfer, ProcessingError> {
    if transfer.dynamics != Dynamics::LieEuler {
        return Err(ProcessingError::Dynamics);
    }
    let target = transfer.terminal.state().ok_or(ProcessingError::Terminal)?;
    let early = |which, state: &BodyState| {
        drifted(&transfer.body, -0.5 * transfer.h, state, which).map(|(early, _)| early)
    };
    let initial = early("the initial state", &transfer.initial)?;
    let target = early("the target", &target)?;
    let Transfer {
        body,
        field,
        h,
        intervals,
        actuation,
        motion,
        inequalities,
        ..
    } = transfer;
    let target = target.try_into().map_err(TransferError::from)?;
    let early = Transfer::in_field(body, field, h, intervals, initial, target, actuation)?;
    Ok(Transfer {
        motion,
        inequalities,
        ..early
    })
}

/// What the `plan` of a [`processed`] transfer of `body` is in the transfer's own terms: its states half a drift later, from
/// the initial state to the target, the multipliers and the feedback as they pair with those; commands, controls and cost
/// as they are.
pub fn flown(body: &RigidBody, mut plan: Plan) -> Result<Plan, ProcessingError> {
    let half = 0.5 * plan.h;
    for (k, state) in plan.states.iter_mut().enumerate() {
        let (later, _) = drifted(body, half, state, "a state of the plan")?;
        let (_, early) = drifted(body, -half, &later, "a state of the plan")?;
        *state = later;
        if let Some(gain) = plan.feedback.get_mut(k) {
            *gain *= early;
        }
        if let Some(multipliers) = k.checked_sub(1).and_then(|k| plan.multipliers.get_mut(k)) {
            *multipliers = early.tr_mul(multipliers);
        }
    }
    Ok(plan)
}

/// `state` after a drift over `h`, with the drift's first derivatives by `[δx, δγ, ζ, δΠ]`.
fn drifted(
    body: &RigidBody,
    h: f64,
    state: &BodyState,
    which: &'static str,
) -> Result<(BodyState, SMatrix<f64, 12, 12>), ProcessingError> {
    let mut drifted = *state;
    let drifts = Full
        .drift(0, body, h, &mut drifted)
        .map_err(|source| ProcessingError::Unsolvable { which, source })?;
    let mut all = SMatrix::<f64, 12, 12>::zeros();
    for (part, drift) in drifts.iter().enumerate() {
        let [pose, pose_by_momentum, momentum] = drift.gradient().matrices();
        let mut set = |row: usize, column: usize, block: &Matrix3<f64>| {
            let (row, column) = (6 * part + 3 * row, 6 * part + 3 * column);
            all.fixed_view_mut::<3, 3>(row, column).copy_from(block);
        };
        set(0, 0, &pose);
        set(0, 1, &pose_by_momentum);
        set(1, 1, &momentum);
    }
    Ok((drifted, all))
}
