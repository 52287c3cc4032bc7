use lgvi_control::{Plan, PlanError, Start, Transfer, certified, shooting};
use lgvi_scene::Solver;
use nalgebra::SVector;

use super::{Iteration, Observe, Reason, Unsolved, newton_settings};

/// The paper's method, from the free drift; from an extremal that is no minimum Newton's method goes on.
pub(super) fn solve(
    transfer: &Transfer,
    solver: &Solver,
    observe: Observe<'_>,
) -> Result<Plan, Unsolved> {
    let mut made = Iteration::NONE;
    let zero = SVector::zeros();
    let solution = shooting::solve(transfer, zero, &solver.shooting(), |now| {
        made = now.into();
        observe(&made)
    })
    .map_err(|error| {
        let reason = match error {
            shooting::ShootingError::Stopped(_) => Reason::Cancelled,
            _ => Reason::NotConverged,
        };
        Unsolved::new(reason, error)
    })?;
    let plan = certified(transfer, &solution.extremal)
        .map_err(|error| Unsolved::new(Reason::NotConverged, error))?;
    if plan.certificate.sufficient {
        return Ok(plan);
    }
    let settings = newton_settings(solver);
    let mut count = made.continued(observe);
    let lower = lgvi_control::solve(transfer, Start::Warm(&plan), &settings, |now| {
        count(&now.into())
    });
    match lower {
        Ok(lower) if lower.cost < plan.cost => Ok(lower),
        Err(stopped @ PlanError::Stopped { .. }) => Err(stopped.into()),
        _ => Ok(plan),
    }
}

impl From<&shooting::Iteration> for Iteration {
    fn from(now: &shooting::Iteration) -> Self {
        Self {
            iteration: now.iteration,
            trials: now.trials,
            step_length: now.step_length,
            violation: now.violation,
            stationarity: 0.0,
            cost: now.cost,
            condition: 0.0,
            sufficient: false,
            priced: 0.0,
            paid: 0.0,
            phase: "shooting",
        }
    }
}
