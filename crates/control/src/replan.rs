//! The rest of a transfer, to be planned again in flight from where the body is.

use lgvi_dynamics::BodyState;
use thiserror::Error;

use crate::{Certificate, Plan, Transfer};

/// What remains of a transfer cannot be planned.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("{remaining} of {intervals} intervals remain after step {step}, expected at least 2")]
pub struct TooLate {
    /// Steps flown.
    pub step: usize,
    /// Intervals of the transfer.
    pub intervals: usize,
    /// Intervals that remain.
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
    /// The transfer from `state`, where the body is after `step` steps, to the same end at the same time.
    ///
    /// # Errors
    /// Less than two intervals remain: one interval cannot reach all twelve coordinates.
    pub fn remaining(&self, step: usize, state: BodyState) -> Result<Self, TooLate> {
        TooLate::check(step, self.intervals)?;
        Ok(Self {
            intervals: self.intervals - step,
            initial: state,
            ..self.clone()
        })
    }
}

impl Plan {
    /// The plan of [`Transfer::remaining`] to start from: this one of `transfer` after `step` steps, with `state` as its
    /// first. It is not the flight of its commands, since `state` may be another than planned; the certificate says
    /// nothing.
    ///
    /// # Errors
    /// Less than two intervals remain.
    pub fn remaining(
        &self,
        transfer: &Transfer,
        step: usize,
        state: BodyState,
    ) -> Result<Self, TooLate> {
        TooLate::check(step, self.commands.len())?;
        let commands = rest(&self.commands, step);
        let costs = commands
            .iter()
            .map(|command| transfer.actuation.cost(self.h, command));
        let mut states = rest(&self.states, step);
        if let Some(first) = states.first_mut() {
            *first = state;
        }
        Ok(Self {
            h: self.h,
            states,
            cost: costs.sum(),
            commands,
            controls: rest(&self.controls, step),
            multipliers: rest(&self.multipliers, step),
            feedback: rest(&self.feedback, step),
            certificate: Certificate::default(),
        })
    }
}

fn rest<T: Clone>(all: &[T], step: usize) -> Vec<T> {
    all.get(step..).unwrap_or_default().to_vec()
}
