//! How a small change of velocity grows into one of positions and attitudes.

use nalgebra::Vector3;

use super::{Levels, Refusal, Skip};
use crate::integrator::Adaptive;
use crate::{Accuracy, BodyState, Integrator, Load, Mobility, RigidBody, StepError, System};

/// Equal intervals of the run at whose ends the flights are looked at.
const SAMPLES: usize = 64;

/// The flights whose velocities are changed: in which direction, along the motion being the first, and at which sample.
const KICKS: [(u64, usize); 6] = [
    (0, 0),
    (1, 0),
    (2, 0),
    (0, SAMPLES / 4),
    (1, SAMPLES / 2),
    (0, 3 * SAMPLES / 4),
];

/// Part of all evaluations that the flight without a change may take; those with one take 4.5 times as many together.
const NOMINAL: u64 = 6;

/// Tolerance of a step, and what the change of velocity would make of a free motion in the whole run.
const TOLERANCE: f64 = 1e-11;
const CHANGE: f64 = 1e-6;

/// The greatest error that is taken to be proportional to the change that it comes from.
const SMALL: f64 = 1e-2;

/// Factor for directions and times that were not flown.
const MARGIN: f64 = 2.0;

/// How far a change of velocity carries: `|z(t)| ≤ κ (t − τ) |ż(τ)|`, where z is the change of all positions relative to the
/// size of the scene and of all attitudes in rad, and its norm the greatest of them; κ is 1 in free motion, and 3 along a
/// circular orbit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Response {
    /// κ over the whole run.
    pub(super) factor: f64,
    /// Evaluations of gravity that took.
    pub(super) evaluations: u64,
}

impl Response {
    /// Measured in flights of the whole run that take no more than about so many evaluations; with the states on the way.
    pub(super) fn measure(
        system: &mut System,
        states: &[BodyState],
        duration: f64,
        evaluations: u64,
    ) -> Result<(Self, Vec<Vec<BodyState>>), Refusal> {
        let turns = turns(system, states);
        let start = stilled(states, &turns);
        let accuracy = Accuracy::new(system.bodies(), states);
        let interval = duration / SAMPLES as f64;
        let speed = CHANGE / duration;
        let (nominal, mut spent) =
            course(system, &start, (interval, SAMPLES), evaluations / NOMINAL)?;
        let mut factor = 1.0_f64;
        for (flight, (direction, from)) in (0..).zip(KICKS) {
            let mut kicked = if from == 0 {
                &start
            } else {
                &nominal[from - 1]
            }
            .clone();
            let bodies = system.bodies().iter().zip(&turns);
            for (index, ((body, turns), state)) in (0..).zip(bodies.zip(&mut kicked)) {
                let speeds = [speed * accuracy.length, if *turns { speed } else { 0.0 }];
                kick(body, state, (flight, direction == 0), index, speeds);
            }
            let left = evaluations.saturating_sub(spent);
            let (other, took) = course(system, &kicked, (interval, SAMPLES - from), left)?;
            spent += took;
            for (sample, (states, truth)) in (1_u32..).zip(other.iter().zip(&nominal[from..])) {
                let error = accuracy.error(states, truth);
                if error > SMALL {
                    return Err(Refusal::Saturated { error });
                }
                factor = factor.max(error / (speed * interval * f64::from(sample)));
            }
        }
        let response = Self {
            factor: MARGIN * factor,
            evaluations: spent,
        };
        Ok((response, nominal))
    }
}

/// Whether a body's rotation depends on what is left out, or anything on its rotation: not where gravity has no moment on it.
fn turns(system: &mut System, states: &[BodyState]) -> Vec<bool> {
    let levels = Levels::new(system, states, Skip::Exact);
    let bodies = system.bodies();
    let coasting = levels.map(|levels| levels.selection(bodies).coasting);
    coasting.map_or_else(
        || vec![true; bodies.len()],
        |coasting| coasting.into_iter().map(|coasts| !coasts).collect(),
    )
}

/// The states, those bodies without spin that do not turn.
fn stilled(states: &[BodyState], turns: &[bool]) -> Vec<BodyState> {
    let mut states = states.to_vec();
    for (state, _) in states.iter_mut().zip(turns).filter(|(_, turns)| !**turns) {
        state.angular_momentum = Vector3::zeros();
    }
    states
}

/// States at the ends of so many equal intervals, and the evaluations of gravity that took, which are at most about `most`.
fn course(
    system: &mut System,
    states: &[BodyState],
    (interval, samples): (f64, usize),
    most: u64,
) -> Result<(Vec<Vec<BodyState>>, u64), Refusal> {
    let mut integrator = Adaptive::to(TOLERANCE, system.bodies());
    let controls = vec![Load::default(); states.len()];
    let mut states = states.to_vec();
    integrator.start(system, &states);
    let mut all = Vec::with_capacity(samples);
    for _ in 0..samples {
        integrator.limit(most.saturating_sub(integrator.work().evaluations));
        integrator
            .step(system, &mut states, &controls, interval)
            .map_err(|error| match error {
                StepError::TooManySteps { .. } => Refusal::Costly { evaluations: most },
                error => Refusal::Flight(error),
            })?;
        all.push(states.clone());
    }
    Ok((all, integrator.work().evaluations))
}

/// Changes velocity and angular velocity by these amounts: along the motion, or in a direction of the flight's own.
fn kick(
    body: &RigidBody,
    state: &mut BodyState,
    (flight, along): (u64, bool),
    index: u64,
    [v, w]: [f64; 2],
) {
    let towards = |motion: Vector3<f64>, which: u64| {
        let other = direction(flight, 2 * index + which);
        let motion = if along { motion } else { other };
        motion.try_normalize(0.0).unwrap_or(other)
    };
    let velocity = v * towards(state.velocity(body), 0);
    let angular_velocity = w * towards(state.angular_velocity(body), 1);
    match body.mobility() {
        Mobility::Free => state.linear_momentum += body.mass() * velocity,
        Mobility::Pivoted => {}
        Mobility::Fixed | Mobility::Driven(_) => return,
    }
    state.angular_momentum += body.inertia().matrix() * angular_velocity;
}

/// A unit vector, the same on every machine.
fn direction(flight: u64, index: u64) -> Vector3<f64> {
    let component = |axis: u64| {
        // SplitMix64
        let mut z = (((flight << 32) + index) * 3 + axis + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let v = Vector3::new(component(0), component(1), component(2));
    v.try_normalize(0.0).unwrap_or_else(Vector3::x)
}
