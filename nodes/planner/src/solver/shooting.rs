use lgvi_control::extremal::Extremal;
use lgvi_control::{Certificate, Plan, Settings, ShootingError, Solution, Transfer, shooting};
use lgvi_dynamics::gravity::Sources;
use nalgebra::SVector;

use super::{Iteration, Observe, Reason, Unsolved};

/// The paper's method, from the free drift.
pub(super) fn solve(
    transfer: &Transfer<Sources>,
    settings: &Settings,
    observe: Observe<'_>,
) -> Result<Plan, Unsolved> {
    shooting::solve(transfer, SVector::zeros(), settings, |now| {
        observe(&now.into())
    })
    .map(|solution| plan(transfer, solution))
    .map_err(|error| {
        let reason = match error {
            ShootingError::Stopped(_) => Reason::Cancelled,
            _ => Reason::NotConverged,
        };
        Unsolved::new(reason, error)
    })
}

/// A plan without costate and feedback, which the shooting does not give. It is an extremal from its start, so that its
/// states are the flight of its commands.
fn plan(transfer: &Transfer<Sources>, solution: Solution) -> Plan {
    let Extremal {
        states,
        controls,
        cost,
    } = solution.extremal;
    let commands = controls.iter().map(|load| {
        let load = load.force.iter().chain(&load.moment);
        SVector::from_iterator(load.copied())
    });
    Plan {
        h: transfer.h(),
        states,
        commands: commands.collect(),
        controls,
        multipliers: vec![solution.multipliers],
        feedback: Vec::new(),
        cost,
        certificate: Certificate {
            terminal: solution.last.violation,
            ..Certificate::default()
        },
    }
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
