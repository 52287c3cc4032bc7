//! Limits and costs of commands that change from interval to interval.

use nalgebra::{SMatrix, SVector};

use crate::{MAX_COMMANDS, Transfer};

/// The factors of limits and the costs of commands by interval; empty if they are the same in all.
#[derive(Clone, Debug, Default)]
pub(super) struct Varying<const U: usize> {
    /// `1/ℓ`
    shares: Vec<f64>,
    /// `h r`
    costs: Vec<SVector<f64, U>>,
}

impl<const U: usize> Varying<U> {
    /// Those of a transfer for the commands that `selection` makes of the `U` planned ones.
    pub(super) fn new(transfer: &Transfer, selection: &SMatrix<f64, MAX_COMMANDS, U>) -> Self {
        let Some(by_step) = &transfer.by_step else {
            return Self::default();
        };
        let by_step = by_step.in_intervals(transfer.intervals);
        let costs = by_step.costs.iter();
        Self {
            shares: by_step.limits.iter().map(|limit| limit.recip()).collect(),
            costs: costs
                .map(|cost| transfer.h * selection.tr_mul(cost))
                .collect(),
        }
    }

    /// `1/ℓ` of an interval.
    pub(super) fn share(&self, interval: usize) -> f64 {
        self.shares.get(interval).copied().unwrap_or(1.0)
    }

    /// `∂/∂w` of an interval's additional cost, if there is one.
    pub(super) fn cost(&self, interval: usize) -> Option<&SVector<f64, U>> {
        self.costs.get(interval)
    }
}
