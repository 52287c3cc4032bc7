use super::family::{Family, Kind};
use crate::integrator::Rotor;
use crate::{Method, Mobility, System};

/// Costs in nanoseconds of one core of the machine that they were measured on; only their ratios matter. To measure
/// them again: `cargo test -p lgvi_dynamics --release -- --ignored auto_costs --nocapture`.
///
/// A step without stages.
const STEP: f64 = 25.0;

/// Per body and step: copying and checking states.
const BODY: f64 = 15.0;

/// Per body and stage: free motion by the discrete rotor, and a kick.
const DISCRETE: f64 = 60.0;

/// Per body and stage of an adaptive method.
const ADAPTIVE: f64 = 80.0;

/// Stages that an adaptive method adds to a step within which states are wanted.
const DENSE: f64 = 4.0;

/// Per body and state that an adaptive method shows.
const SHOWN: f64 = 80.0;

/// An evaluation of gravity, per pair of points.
const PAIR: f64 = 8.0;

/// An evaluation of gravity, per point.
const POINT: f64 = 6.0;

/// Predicts what flights of a system cost.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cost {
    gravity: f64,
    moving: f64,
}

impl Cost {
    pub(super) fn new(system: &System) -> Self {
        let bodies = system.bodies();
        let (mut points, mut pairs) = (0, 0);
        for (index, body) in bodies.iter().enumerate() {
            points += body.points().len();
            for other in &bodies[..index] {
                pairs += body.points().len() * other.points().len();
            }
        }
        let moving = bodies
            .iter()
            .filter(|body| *body.mobility() != Mobility::Fixed)
            .count();
        let gravity = if system.is_free() {
            0.0
        } else {
            PAIR * pairs as f64 + POINT * points as f64
        };
        Self {
            gravity,
            moving: moving as f64,
        }
    }

    /// Of a flight in which the method makes `made` steps, with states wanted at `shown` of them or between.
    pub(super) fn flight(&self, family: &Family, made: f64, shown: f64) -> f64 {
        let stages = f64::from(family.stages);
        match family.kind {
            Kind::Equal(method) => {
                let drift = match rotor(method) {
                    Rotor::Discrete(_) => DISCRETE,
                };
                let stage = self.gravity + drift * self.moving;
                made * (STEP + BODY * self.moving + stages * stage)
            }
            Kind::Adaptive(_) => {
                let stage = self.gravity + ADAPTIVE * self.moving;
                let dense = (DENSE * stage * made).min(DENSE * stage * shown);
                made * stages * stage + dense + shown * (STEP + SHOWN * self.moving)
            }
        }
    }
}

fn rotor(method: Method) -> Rotor {
    match method {
        Method::Lgvi(rotor)
        | Method::LieEuler(rotor)
        | Method::ProcessedLieEuler(rotor)
        | Method::Composition { rotor, .. }
        | Method::Nystrom { rotor, .. } => rotor,
        Method::LagrangianLgvi(chart) => Rotor::Discrete(chart),
    }
}
