use lgvi_control::{Plan, Settings, ShootingError, Transfer, certified, shooting};
use lgvi_dynamics::gravity::Sources;
use nalgebra::SVector;

use super::{Iteration, Observe, Reason, Unsolved};

/// The paper's method, from the free drift.
pub(super) fn solve(
    transfer: &Transfer<Sources>,
    settings: &Settings,
    observe: Observe<'_>,
) -> Result<Plan, Unsolved> {
    let solution = shooting::solve(transfer, SVector::zeros(), settings, |now| {
        observe(&now.into())
    })
    .map_err(|error| {
        let reason = match error {
            ShootingError::Stopped(_) => Reason::Cancelled,
            _ => Reason::NotConverged,
        };
        Unsolved::new(reason, error)
    })?;
    certified(transfer, &solution.extremal)
        .map_err(|error| Unsolved::new(Reason::NotConverged, error))
}

impl From<&lgvi_control::Iteration> for Iteration {
    fn from(now: &lgvi_control::Iteration) -> Self {
        Self {
            iteration: now.iteration,
            trials: now.trials,
            step_length: now.step_length,
            violation: now.violation,
            stationarity: 0.0,
            cost: now.cost,
            condition: 0.0,
            sufficient: false,
            phase: "shooting",
        }
    }
}
