//! Plans whose commands are the torques of reaction wheels.
//!
//! A transfer by wheels is solved as that of a gyrostat: the attitude, the angular momentum and the momentum of the wheels,
//! along a given orbit. The orbit is first that of a body whose wheels coast. Gravity may pull a body that turns elsewhere a
//! little differently; then the orbit is that of the plan's own flight, and the plan is solved again, until its flight
//! arrives.

mod flight;

use std::sync::Arc;

use lgvi_dynamics::{BodyState, Load};
use nalgebra::{SVector, Vector3};

use crate::multistart::search_stated;
use crate::problem::block;
use crate::solver::{NewtonSettings, PlanError, Progress, Start, solve_stated};
use crate::units::Units;
use crate::{
    Command, Dynamics, Minimum, Motion, Place, Plan, SearchSettings, Sweep, Transfer, miss,
};
use flight::{Flight, fly};

/// Maximum number of orbits that are tried.
const ORBITS: u32 = 40;

/// [`crate::solve`] for a transfer by wheels.
pub(crate) fn solve(
    transfer: &Transfer,
    start: Start<'_>,
    settings: &NewtonSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    let mut made = [0; 2];
    let mut plan = match start {
        Start::Cold => None,
        Start::Warm(plan) => Some(entered(transfer, plan)),
    };
    let mut orbit = fly(transfer, &vec![Command::zeros(); transfer.intervals])?.positions();
    let mut apart = f64::INFINITY;
    for _ in 0..ORBITS {
        let stated = stated(transfer, orbit)?;
        let before = made;
        let mut watch = |now: &Progress| {
            made = [before[0] + now.iteration, before[1] + now.trials];
            observe(&Progress {
                iteration: made[0],
                trials: made[1],
                ..*now
            })
        };
        let start = plan.as_ref().map_or(Start::Cold, Start::Warm);
        let found = solve_stated(&stated, start, settings, &mut watch)
            .map_err(|error| left_error(transfer, error))?;
        let flight = fly(transfer, &found.commands)?;
        apart = distance(&stated, &found, &flight);
        if apart <= settings.violation {
            flight.check_speeds(transfer, &found.commands)?;
            return Ok(left(transfer, found, flight));
        }
        orbit = flight.positions();
        plan = Some(found);
    }
    Err(PlanError::NotConverged {
        best: None,
        iterations: made[0],
        violation: apart,
        stationarity: plan.map_or(f64::INFINITY, |plan| plan.certificate.stationarity),
        tolerance: settings.violation,
    })
}

/// [`crate::search`] for a transfer by wheels, along the orbit of a body whose wheels coast.
pub(crate) fn search(
    transfer: &Transfer,
    settings: &SearchSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Vec<Minimum>, PlanError> {
    let coasting = vec![Command::zeros(); transfer.intervals];
    let stated = stated(transfer, fly(transfer, &coasting)?.positions())?;
    let minima = search_stated(&stated, settings, &mut *observe)
        .map_err(|error| left_error(transfer, error))?;
    let mut found = Vec::new();
    let mut failure = None;
    for Minimum {
        plan,
        winding,
        starts,
    } in minima
    {
        let flight = fly(transfer, &plan.commands)?;
        let plan = match distance(&stated, &plan, &flight) {
            apart if apart <= settings.newton.violation => flight
                .check_speeds(transfer, &plan.commands)
                .map(|()| left(transfer, plan, flight)),
            _ => {
                let guess = left(transfer, plan, flight);
                solve(transfer, Start::Warm(&guess), &settings.newton, observe)
            }
        };
        match plan {
            Ok(plan) => found.push(Minimum {
                plan,
                winding,
                starts,
            }),
            Err(error) => failure = failure.or(Some(error)),
        }
    }
    match failure {
        Some(error) if found.is_empty() => Err(error),
        _ => Ok(found),
    }
}

/// The transfer as that of a gyrostat along an orbit.
fn stated(transfer: &Transfer, orbit: Arc<[Vector3<f64>]>) -> Result<Transfer, PlanError> {
    let (dynamics, motion) = (transfer.dynamics, transfer.motion);
    if dynamics != Dynamics::Lgvi || motion != Motion::Rotation {
        return Err(PlanError::WheelsDo { dynamics, motion });
    }
    let wheels = transfer.body.wheels();
    let stored = wheels.map_or_else(Vector3::zeros, |wheels| wheels.momentum());
    let mut stated = Transfer {
        initial: BodyState {
            linear_momentum: stored,
            ..transfer.initial
        },
        target: transfer.target.clone().without(Place::Position),
        actuation: transfer.actuation.exchanging(),
        orbit: Some(orbit),
        ..transfer.clone()
    };
    stated.terminal.translation.release();
    Ok(stated)
}

/// The difference of the attitude and the angular momentum at the end of a plan and of its flight, relative to their sizes.
fn distance(stated: &Transfer, plan: &Plan, flight: &Flight) -> f64 {
    let ends = plan.states.last().zip(flight.states.last());
    ends.map_or(0.0, |(planned, flown)| {
        let apart = miss(planned, flown).component_div(&Units::of(stated).variations());
        block(&apart, 2).norm().max(block(&apart, 3).norm())
    })
}

/// A plan of the transfer as one of [`stated`].
fn entered(transfer: &Transfer, plan: &Plan) -> Plan {
    let stored = flight::stored(transfer, &plan.commands);
    let last = stored.len() - 1;
    let mut entered = plan.clone();
    for (k, state) in entered.states.iter_mut().enumerate() {
        state.linear_momentum = stored[k.min(last)];
    }
    entered
}

/// A plan of [`stated`] as one of the transfer, with the states of its flight.
fn left(transfer: &Transfer, plan: Plan, flight: Flight) -> Plan {
    let loads = plan.commands.iter();
    let controls: Vec<Load> = loads.map(|w| transfer.actuation.load(w)).collect();
    Plan {
        states: flight.states,
        controls,
        feedback: Vec::new(),
        sweep: Sweep::default(),
        ..plan
    }
}

fn left_error(transfer: &Transfer, error: PlanError) -> PlanError {
    let leave = |plan: Option<Box<Plan>>| {
        let plan = *plan?;
        let flight = fly(transfer, &plan.commands).ok()?;
        Some(Box::new(left(transfer, plan, flight)))
    };
    match error {
        PlanError::NotConverged {
            best,
            iterations,
            violation,
            stationarity,
            tolerance,
        } => PlanError::NotConverged {
            best: leave(best),
            iterations,
            violation,
            stationarity,
            tolerance,
        },
        PlanError::Stopped { best } => PlanError::Stopped { best: leave(best) },
        other => other,
    }
}

impl Transfer {
    /// The transfer by wheels with other axial momenta `h` of the wheels at its start, one for each wheel. Without wheels it
    /// stays the same.
    pub fn with_wheel_momenta(mut self, momenta: &[f64]) -> Self {
        if let Some(wheels) = self.body.wheels_mut() {
            let mut states = wheels.states().to_vec();
            for (state, momentum) in states.iter_mut().zip(momenta) {
                state.momentum = *momentum;
            }
            wheels.set_states(&states);
        }
        self
    }
}

impl Plan {
    /// The axial momenta `h` of the wheels of `transfer`, by which it was planned, at `0 … N`; empty if it has none.
    pub fn wheel_momenta(&self, transfer: &Transfer) -> Vec<SVector<f64, { crate::MAX_COMMANDS }>> {
        flight::momenta(transfer, &self.commands)
    }
}
