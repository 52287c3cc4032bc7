//! Replanning of the rest of a transfer from the current state.

use lgvi_dynamics::BodyState;
use thiserror::Error;

use crate::{Certificate, Plan, Transfer};

/// The error that too few intervals of a transfer remain to be planned.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("{remaining} of {intervals} intervals remain after step {step}, expected at least 2")]
pub struct TooLate {
    /// Number of steps flown.
    pub step: usize,
    /// Number of intervals of the transfer.
    pub intervals: usize,
    /// Number of intervals that remain.
    pub remaining: usize,
}

impl TooLate {
    fn check(step: usize, intervals: usize) -> Result<(), Self> {
        let remaining = intervals.saturating_sub(step);
        if remaining < 2 {
            return Err(Self {
                step,
                intervals,
                remaining,
            });
        }
        Ok(())
    }
}

impl Transfer {
    /// The transfer from `state`, the state after `step` steps, to the same target at the same time. Of a transfer by wheels,
    /// [`Transfer::with_wheel_momenta`] sets the momenta that they have by then, and of one by thrusters that use propellant,
    /// [`Transfer::with_propellant`] sets what is left; `state` has the momenta of the lighter body.
    ///
    /// # Errors
    /// Returns an error if fewer than two intervals remain: one interval cannot reach all twelve coordinates.
    pub fn remaining(&self, step: usize, state: BodyState) -> Result<Self, TooLate> {
        TooLate::check(step, self.intervals)?;
        Ok(Self {
            intervals: self.intervals - step,
            initial: state,
            inequalities: self.inequalities.later(self.h, step),
            off: self.off_after(step),
            ..self.clone()
        })
    }
}

impl Plan {
    /// The initial guess for [`Transfer::remaining`]: this plan of `transfer` after `step` steps. Its certificate is the
    /// default one.
    ///
    /// # Errors
    /// Returns an error if fewer than two intervals remain.
    pub fn remaining(&self, transfer: &Transfer, step: usize) -> Result<Self, TooLate> {
        TooLate::check(step, self.commands.len())?;
        let commands = rest(&self.commands, step);
        let costs = commands
            .iter()
            .map(|command| transfer.actuation.cost(self.h, command));
        Ok(Self {
            h: self.h,
            states: rest(&self.states, step),
            cost: costs.sum(),
            paid: 0.0,
            commands,
            controls: rest(&self.controls, step),
            multipliers: rest(&self.multipliers, step),
            feedback: rest(&self.feedback, step),
            actuator_feedback: rest(&self.actuator_feedback, step),
            certificate: Certificate::default(),
            sweep: self.sweep.remaining(step),
        })
    }
}

fn rest<T: Clone>(all: &[T], step: usize) -> Vec<T> {
    all.get(step..).unwrap_or_default().to_vec()
}
