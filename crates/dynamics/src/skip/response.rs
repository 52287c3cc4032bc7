//! How a small change of velocity grows into one of positions and attitudes.

use nalgebra::Vector3;

use crate::auto::{Accuracy, Growth, rate};
use crate::integrator::Adaptive;
use crate::{BodyState, Integrator, Load, Mobility, RigidBody, System};

/// Flights whose velocities are changed a little: along the motion, and in other directions.
const FLIGHTS: u64 = 3;

/// Equal intervals of a flight at whose ends it is looked at, and how many of them must be flown.
const SAMPLES: u32 = 64;
const LEAST: usize = 8;

/// Tolerance of a step, and what the change of velocity would make of a free motion by the end.
const TOLERANCE: f64 = 1e-11;
const CHANGE: f64 = 1e-6;

/// Evaluations of gravity that a radian of the fastest motion is expected to take.
const PER_RADIAN: f64 = 40.0;

/// Factor for directions and times that were not flown.
const MARGIN: f64 = 2.0;

/// How far a change of velocity carries: `|z(t)| ≤ κ t |ż(0)|`, where z is the change of all positions relative to the size of
/// the scene and of all attitudes in rad, and its norm the greatest of them; κ is 1 in free motion, and 3 along a circular
/// orbit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Response {
    /// κ over the whole run.
    pub(super) factor: f64,
    /// Time for which it was measured.
    pub(super) horizon: f64,
    /// Evaluations of gravity that took.
    pub(super) evaluations: u64,
}

impl Response {
    /// Measured in flights that take about so many evaluations; none where they do not get anywhere.
    pub(super) fn measure(
        system: &mut System,
        states: &[BodyState],
        duration: f64,
        evaluations: u64,
    ) -> Option<Self> {
        let each = evaluations / (FLIGHTS + 1);
        let rate = rate(system, states).max(1.0 / duration);
        let horizon = duration.min(each as f64 / (PER_RADIAN * rate));
        let interval = horizon / f64::from(SAMPLES);
        let accuracy = Accuracy::new(system.bodies(), states);
        let speed = CHANGE / horizon;
        let course = Course::fly(system, states, interval, 2 * each)?;
        let mut spent = course.evaluations;
        let mut errors = vec![0.0_f64; course.samples.len()];
        for flight in 0..FLIGHTS {
            let mut kicked = states.to_vec();
            for (index, (body, state)) in system.bodies().iter().zip(&mut kicked).enumerate() {
                kick(
                    body,
                    state,
                    flight,
                    index as u64,
                    [speed * accuracy.length, speed],
                );
            }
            let other = Course::fly(system, &kicked, interval, 2 * each)?;
            spent += other.evaluations;
            errors.truncate(other.samples.len());
            let pairs = course.samples.iter().zip(&other.samples);
            for (error, (nominal, kicked)) in errors.iter_mut().zip(pairs) {
                *error = error.max(accuracy.error(kicked, nominal));
            }
        }
        if errors.len() < LEAST {
            return None;
        }
        let times = (1..).map(|sample| f64::from(sample) * interval);
        let measured = errors.iter().zip(times);
        let measured = measured
            .map(|(error, t)| error / (speed * t))
            .fold(1.0, f64::max);
        let horizon = interval * errors.len() as f64;
        let beyond = if horizon < duration {
            let growth = Growth::fit(&errors, horizon).factor(horizon, duration);
            (growth * horizon / duration).max(1.0)
        } else {
            1.0
        };
        Some(Self {
            factor: MARGIN * measured * beyond,
            horizon,
            evaluations: spent,
        })
    }
}

/// States at the ends of equal intervals.
struct Course {
    samples: Vec<Vec<BodyState>>,
    evaluations: u64,
}

impl Course {
    /// As far as the motion goes on and evaluations suffice.
    fn fly(system: &mut System, states: &[BodyState], interval: f64, most: u64) -> Option<Self> {
        let mut integrator = Adaptive::dormand_prince853(TOLERANCE, system.bodies()).ok()?;
        let controls = vec![Load::default(); states.len()];
        let mut states = states.to_vec();
        let mut samples = Vec::new();
        integrator.start(system, &states);
        for _ in 0..SAMPLES {
            let step = integrator.step(system, &mut states, &controls, interval);
            if step.is_err() || integrator.work().evaluations > most {
                break;
            }
            samples.push(states.clone());
        }
        Some(Self {
            samples,
            evaluations: integrator.work().evaluations,
        })
    }
}

/// Changes velocity and angular velocity by these amounts: along the motion, or in a direction of the flight's own.
fn kick(body: &RigidBody, state: &mut BodyState, flight: u64, index: u64, [v, w]: [f64; 2]) {
    let along = |motion: Vector3<f64>, which: u64| {
        let other = direction(flight, 2 * index + which);
        let along = if flight == 0 { motion } else { other };
        along.try_normalize(0.0).unwrap_or(other)
    };
    let velocity = v * along(state.velocity(body), 0);
    let angular_velocity = w * along(state.angular_velocity(body), 1);
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
