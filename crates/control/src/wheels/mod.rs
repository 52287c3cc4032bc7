//! Plans whose commands are the torques of reaction wheels.
//!
//! A transfer by wheels is solved as that of a gyrostat: the attitude, the angular momentum and the momentum of the wheels,
//! along a given orbit. The orbit is first that of a body whose wheels coast. Gravity may pull a body that turns elsewhere a
//! little differently; then the orbit is that of the plan's own flight, and the plan is solved again, until its flight
//! arrives.
//!
//! Where such a plan takes a wheel past the limit of its speed, it is solved again under the limits.

mod flight;
mod speeds;

use std::sync::Arc;

use lgvi_dynamics::{BodyState, Load};
use nalgebra::{SVector, Vector3};

use crate::multistart::{resolved, search_stated};
use crate::problem::block;
use crate::solver::{
    self, Consecutive, NewtonSettings, PlanError, Progress, Start, TimePrice, TimedPath, Warmth,
    solve_near, solve_stated,
};
use crate::units::Units;
use crate::{
    Certificate, Command, Dynamics, Minimum, Motion, Place, Plan, SearchSettings, Transfer,
    TransferError, miss,
};
use flight::{Flight, fly};
use speeds::Speeds;

/// The distance of the ends of a plan and of its flight, in parts of that along the orbit before, with which the orbits
/// still settle.
const SETTLING: f64 = 0.9;

/// [`crate::solve`] for a transfer by wheels.
pub(crate) fn solve(
    transfer: &Transfer,
    start: Start<'_>,
    warmth: Warmth,
    settings: &NewtonSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    stateable(transfer)?;
    let mut progress = Consecutive::new(observe);
    let mut plan = match start {
        Start::Cold => None,
        Start::Warm(plan) => Some(entered(transfer, plan)),
    };
    let mut orbit = fly(transfer, &vec![Command::zeros(); transfer.intervals])?.positions();
    let mut last = f64::INFINITY;
    let speeds = Speeds::of(transfer);
    // A plan near the limits is one under them.
    let near =
        |speeds: &&Speeds| matches!(start, Start::Warm(plan) if speeds.are_reached(transfer, plan));
    let mut imposed: Option<&Speeds> = speeds.as_ref().filter(near);
    loop {
        let mut stated = stated(transfer, orbit);
        if let Some(speeds) = imposed {
            speeds.impose(transfer, &mut stated);
            plan = plan.map(|plan| speeds.entered(transfer, plan));
        }
        let start = plan.as_ref().map_or(Start::Cold, Start::Warm);
        let found = match start {
            Start::Warm(plan) => solve_near(&stated, plan, warmth, settings, progress.next()),
            Start::Cold => solve_stated(&stated, Start::Cold, settings, progress.next()),
        };
        let found = found.map_err(|error| {
            let error = left_error(transfer, error);
            match imposed {
                Some(speeds) => speeds.named(transfer, error),
                None => error,
            }
        })?;
        let flight = fly(transfer, &found.commands)?;
        let kept = flight.check_speeds(transfer, &found.commands);
        if kept.is_err() && speeds.is_some() && imposed.is_none() {
            imposed = speeds.as_ref();
            plan = (!warmth.falls_back()).then_some(found);
            (orbit, last) = (flight.positions(), f64::INFINITY);
            continue;
        }
        let apart = distance(&stated, &found, &flight);
        let tolerance = tolerated(transfer, &found, settings);
        if apart <= tolerance {
            kept?;
            return Ok(left(transfer, found, flight, apart));
        }
        if apart > SETTLING * last {
            let stationarity = found.certificate.stationarity;
            return Err(PlanError::NotConverged {
                best: Some(Box::new(left(transfer, found, flight, apart))),
                iterations: progress.made()[0],
                violation: apart,
                stationarity,
                tolerance,
            });
        }
        last = apart;
        orbit = flight.positions();
        plan = Some(found);
    }
}

/// [`crate::solver::with_free_time`] for a transfer by wheels, along the orbit of the plan, under the limits of speeds.
pub(crate) fn with_free_time(
    transfer: &Transfer,
    plan: &Plan,
    price: &TimePrice,
    settings: &NewtonSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<TimedPath, PlanError> {
    let (stated, mut own) = restated(transfer, plan);
    if let Some(speeds) = Speeds::of(transfer) {
        own = speeds.entered(transfer, own);
    }
    let timed = solver::with_free_time(&stated, &own, price, settings, observe);
    let mut timed = timed.map_err(|error| left_error(transfer, error))?;
    for (state, given) in timed.plan.states.iter_mut().zip(&plan.states) {
        (state.position, state.linear_momentum) = (given.position, given.linear_momentum);
    }
    Ok(timed)
}

/// How far the end of a plan's flight may be from that of the plan: by the tolerance, by what the plan itself misses, or by
/// the rounding of the sums of `s`, which turns the body at the rate `J⁻¹ δs` until the end.
fn tolerated(transfer: &Transfer, plan: &Plan, settings: &NewtonSettings) -> f64 {
    let stored = flight::stored(transfer, plan.h, &plan.commands);
    let largest = stored.iter().map(Vector3::norm).fold(0.0, f64::max);
    let steps = transfer.intervals as f64;
    let turn = largest * transfer.body.inertia().inverse().norm() * transfer.h * steps;
    settings
        .violation
        .max(2.0 * plan.certificate.terminal)
        .max(f64::EPSILON * steps.sqrt() * turn)
}

/// [`crate::search`] for a transfer by wheels, along the orbit of a body whose wheels coast. Minima in which a wheel is too
/// fast, and those that the orbit of their own flight does not keep, are solved again; they are left out if that fails.
pub(crate) fn search(
    transfer: &Transfer,
    settings: &SearchSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Vec<Minimum>, PlanError> {
    stateable(transfer)?;
    let coasting = vec![Command::zeros(); transfer.intervals];
    let stated = stated(transfer, fly(transfer, &coasting)?.positions());
    let mut progress = Consecutive::new(observe);
    let minima = search_stated(&stated, settings, progress.next())
        .map_err(|error| left_error(transfer, error))?;
    resolved(minima, |plan| {
        let flight = fly(transfer, &plan.commands)?;
        let apart = distance(&stated, &plan, &flight);
        let is_kept = apart <= tolerated(transfer, &plan, &settings.newton);
        if is_kept && flight.check_speeds(transfer, &plan.commands).is_ok() {
            return Ok(left(transfer, plan, flight, apart));
        }
        let guess = left(transfer, plan, flight, apart);
        let start = Start::Warm(&guess);
        let newton = &settings.newton;
        let warmth = Warmth::of(newton);
        solve(transfer, start, warmth, newton, &mut progress.next())
    })
}

/// Checks that the transfer can be stated as that of a gyrostat.
fn stateable(transfer: &Transfer) -> Result<(), PlanError> {
    let (dynamics, motion) = (transfer.dynamics, transfer.motion);
    if dynamics != Dynamics::Lgvi || motion != Motion::Rotation {
        return Err(PlanError::WheelsDo { dynamics, motion });
    }
    Ok(())
}

/// The transfer as that of a gyrostat along an orbit.
fn stated(transfer: &Transfer, orbit: Arc<[Vector3<f64>]>) -> Transfer {
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
    stated
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
    let stored = flight::stored(transfer, plan.h, &plan.commands);
    let last = stored.len() - 1;
    let mut entered = plan.clone();
    for (k, state) in entered.states.iter_mut().enumerate() {
        state.linear_momentum = stored[k.min(last)];
    }
    entered
}

/// A plan of [`stated`] as one of the transfer, with the states of its flight, whose end is so far from that of the plan.
fn left(transfer: &Transfer, mut plan: Plan, flight: Flight, apart: f64) -> Plan {
    // What is stored is in the place of linear momenta, and what is exchanged in that of positions.
    for gain in &mut plan.actuator_feedback {
        gain.fixed_columns_mut::<6>(0).fill(0.0);
    }
    let certificate = Certificate {
        terminal: plan.certificate.terminal.max(apart),
        ..plan.certificate
    };
    let loads = plan.commands.iter();
    let controls: Vec<Load> = loads.map(|w| transfer.actuation.load(w)).collect();
    Plan {
        states: flight.states,
        controls,
        certificate,
        feedback: Vec::new(),
        sweep: plan.sweep.without_states(),
        ..plan
    }
}

/// The transfer as that of a gyrostat along the orbit of a plan, under the limits of speeds, and the plan with what is stored in
/// the place of linear momenta. Positions are those of the orbit, also where the gyrostat has exchanged momenta in their place.
pub(crate) fn restated(transfer: &Transfer, plan: &Plan) -> (Transfer, Plan) {
    let (mut restated, plan) = along(transfer, plan);
    if let Some(speeds) = Speeds::of(transfer) {
        speeds.impose(transfer, &mut restated);
    }
    (restated, plan)
}

/// [`restated`] without limits of speeds.
pub(crate) fn along(transfer: &Transfer, plan: &Plan) -> (Transfer, Plan) {
    let orbit = plan.states.iter().map(|state| state.position).collect();
    (stated(transfer, orbit), entered(transfer, plan))
}

fn left_error(transfer: &Transfer, error: PlanError) -> PlanError {
    error.with_plan(|plan| {
        let flight = fly(transfer, &plan.commands).ok()?;
        Some(left(transfer, plan, flight, 0.0))
    })
}

impl Transfer {
    /// The transfer by wheels with other axial momenta `h` of the wheels at its start, one for each wheel.
    ///
    /// # Errors
    /// Returns an error if there are more or fewer momenta than wheels, or if one is not finite.
    pub fn with_wheel_momenta(mut self, momenta: &[f64]) -> Result<Self, TransferError> {
        let wheels = self.body.wheels().map_or(0, |wheels| wheels.wheels().len());
        if momenta.len() != wheels || !momenta.iter().all(|momentum| momentum.is_finite()) {
            let momenta = momenta.to_vec();
            return Err(TransferError::WheelMomenta { wheels, momenta });
        }
        if let Some(wheels) = self.body.wheels_mut() {
            let mut states = wheels.states().to_vec();
            for (state, momentum) in states.iter_mut().zip(momenta) {
                state.momentum = *momentum;
            }
            wheels.set_states(&states);
        }
        Ok(self)
    }
}

impl Plan {
    /// The axial momenta `h` of the wheels of `transfer`, by which it was planned, at `0 … N`; empty if it has none.
    pub fn wheel_momenta(&self, transfer: &Transfer) -> Vec<SVector<f64, { crate::MAX_COMMANDS }>> {
        flight::momenta(transfer, self.h, &self.commands)
    }
}
