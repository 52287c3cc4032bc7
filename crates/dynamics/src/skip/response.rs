//! Growth of a small change of velocity into changes of positions and attitudes.

use nalgebra::Vector3;

use super::{Levels, Refusal, Skip};
use crate::integrator::Adaptive;
use crate::{Accuracy, BodyState, Integrator, Load, Mobility, RigidBody, StepError, System};

/// Number of equal intervals of the run. The flights are compared at their ends.
const SAMPLES: usize = 64;

/// The perturbed flights: number of the direction (0 is along the motion) and sample at which the perturbation is
/// applied.
const KICKS: [(u64, usize); 6] = [
    (0, 0),
    (1, 0),
    (2, 0),
    (0, SAMPLES / 4),
    (1, SAMPLES / 2),
    (0, 3 * SAMPLES / 4),
];

/// The unperturbed flight may use one part in this number of all evaluations. The perturbed flights together take 4.5
/// times as many.
const NOMINAL: u64 = 6;

/// Tolerance of a step, and the change that the perturbation would cause in free motion over the whole run.
const TOLERANCE: f64 = 1e-11;
const CHANGE: f64 = 1e-6;

/// Largest error that is assumed to be proportional to the perturbation.
const SMALL: f64 = 1e-2;

/// Safety factor for directions and times that were not sampled.
const MARGIN: f64 = 2.0;

/// The growth of a change of velocity: `|z(t)| ≤ κ (t − τ) |ż(τ)|`, where z consists of the changes of all positions,
/// relative to the size of the scene, and of all attitudes in rad. Its norm is the largest of them. κ is 1 in free
/// motion, and 3 along a circular orbit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Response {
    /// κ over the whole run.
    pub(super) factor: f64,
    /// Gravity evaluations used.
    pub(super) evaluations: u64,
}

impl Response {
    /// Measures the response in flights of the whole run that together take approximately `evaluations` at most. Also
    /// returns the states of the unperturbed flight.
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

/// Returns true for each body whose rotation depends on the omissions or affects anything. It is false for bodies
/// without gravitational moments.
fn turns(system: &mut System, states: &[BodyState]) -> Vec<bool> {
    let levels = Levels::new(system, states, Skip::Exact);
    let bodies = system.bodies();
    let coasting = levels.map(|levels| levels.selection(bodies).coasting);
    coasting.map_or_else(
        || vec![true; bodies.len()],
        |coasting| coasting.into_iter().map(|coasts| !coasts).collect(),
    )
}

/// The states with the spin of bodies removed whose `turns` is false.
fn stilled(states: &[BodyState], turns: &[bool]) -> Vec<BodyState> {
    let mut states = states.to_vec();
    for (state, _) in states.iter_mut().zip(turns).filter(|(_, turns)| !**turns) {
        state.angular_momentum = Vector3::zeros();
    }
    states
}

/// States at the ends of equal intervals, and the number of gravity evaluations used, which is approximately `most` at
/// most.
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

/// Changes velocity and angular velocity by these amounts, either along the motion or in a direction specific to the
/// flight.
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

/// A pseudorandom unit vector, the same on every machine.
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
