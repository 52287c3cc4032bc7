//! The processing of §4.5: Lie–Euler plans of second order.
//!
//! Let `D` be the free motion and `K` the kick of loads. A Lie–Euler step is `K_h D_h`, and `D_{h/2} (K_h D_h)ᴺ
//! D_{−h/2} = (D_{h/2} K_h D_{h/2})ᴺ`. Half a drift thus turns it into a method of second order in which every control
//! acts in the middle of its interval. A plan between the boundary states half a drift early becomes, half a drift
//! later, a second-order plan between the true boundary states.
//!
//! With drag a drift is not a flow, so that this holds but for a part of third order in each step. The method remains of second
//! order.
//!
//! The controls do not change. They can be flown from the true initial state, each constant over its interval, by an
//! accurate integrator or by the LGVI. They then miss the target by `O(h²)`, while those of a plain Lie–Euler plan miss
//! it by `O(h)`. The cost differs from that of the continuous problem by `O(h²)`.

use lgvi_dynamics::rotation::Unsolvable;
use lgvi_dynamics::{BodyState, RigidBody};
use nalgebra::{SMatrix, SVector};
use thiserror::Error;

use crate::discrete::{Coordinates, Drift, Full, Inputs, Linearization, glide_gradient};
use crate::problem::Dynamics;
use crate::{Plan, Transfer, TransferError};

/// The reason why a transfer or a plan cannot be processed.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ProcessingError {
    /// The dynamics are already of second order.
    #[error("the LGVI needs no processing: expected Lie–Euler dynamics")]
    Dynamics,
    /// The terminal set has several states.
    #[error(
        "moved back by half a drift, the target is not a single state; expected a target that fixes the full state"
    )]
    Terminal,
    /// The body turns too far in half a step.
    #[error("{which}: {source}")]
    Unsolvable {
        /// Name of the state.
        which: &'static str,
        /// The turn that is too large.
        source: Unsolvable,
    },
    /// The transfer half a drift early is invalid.
    #[error("half a drift early: {0}")]
    Transfer(#[from] TransferError),
}

/// The transfer to plan instead of `transfer`, between its boundary states half a drift early.
///
/// # Assumptions and limitations
/// Its states are half a drift early, so inequalities on states are imposed half a step early. The step size is fixed:
/// a free final time would shift the boundary states.
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
        off,
        ..
    } = transfer;
    let target = target.try_into().map_err(TransferError::from)?;
    let early = Transfer::in_field(body, field, h, intervals, initial, target, actuation)?;
    Ok(Transfer {
        motion,
        inequalities,
        off,
        ..early
    })
}

/// Converts the `plan` of a [`processed`] transfer of `body` to the original transfer. The states are half a drift
/// later, from the initial state to the target. Multipliers and feedback are transformed accordingly; commands,
/// controls and cost are unchanged.
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

/// `state` after a drift over `h`, with the first derivatives of the drift by `[δx, δγ, ζ, δΠ]`. `which` names the
/// state in errors.
fn drifted(
    body: &RigidBody,
    h: f64,
    state: &BodyState,
    which: &'static str,
) -> Result<(BodyState, SMatrix<f64, 12, 12>), ProcessingError> {
    let mut drifted = *state;
    let turn = Full
        .drift(0, body, [h, 1.0], &mut drifted)
        .map_err(|source| ProcessingError::Unsolvable { which, source })?;
    let drift = Linearization {
        slowed: Some(Box::new(glide_gradient(body, h, state))),
        turn: turn.map(|turn| turn.gradient(body)),
        ..Linearization::default()
    };
    let none = Inputs::<6>::none();
    let mut all = SMatrix::<f64, 12, 12>::identity();
    for mut column in all.column_iter_mut() {
        let moved = drift.forward(&none, &column.clone_owned(), &SVector::zeros());
        column.copy_from(&moved);
    }
    Ok((drifted, all))
}
