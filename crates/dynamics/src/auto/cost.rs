use super::family::{Family, Kind};
use crate::integrator::Rotor;
use crate::{Inertia, Method, Mobility, RigidBody, System};

// Costs in nanoseconds of one core of the machine that they were measured on; only their ratios matter. To measure
// them again: `lgvi_bench costs`.

/// A step without stages.
const STEP: f64 = 15.0;

/// Per body and step: copying and checking states.
const BODY: f64 = 8.0;

/// A ratio of costs that does not matter, and a cost.
const LIKE: f64 = 1.3;
const SMALL: f64 = 1e5;

/// Per body and stage, a kick and a drift by the discrete rotor.
const DISCRETE: f64 = 40.0;

/// The same by the preprocessed rotor.
const PREPROCESSED: f64 = 141.0;

/// The same by the exact rotor, of bodies with three equal principal moments, two and none.
const EXACT: [f64; 3] = [42.0, 31.0, 145.0];

/// More than that for a body that is not free but pivoted, by the discrete rotor: its steps turn it by some tenths of a
/// radian, and the rotor's equation takes more iterations.
const PIVOTED: f64 = 45.0;

/// Per body and step of the closed form, likewise.
const CLOSED_FORM: [f64; 3] = [60.0, 80.0, 302.0];

/// A stage of an adaptive method, of its own and per body.
const ADAPTIVE: [f64; 2] = [15.0, 31.0];

/// Stages that an adaptive method adds to a step within which states are wanted.
const DENSE: f64 = 4.0;

/// Per body and state that an adaptive method shows.
const SHOWN: f64 = 97.0;

/// A point of mass in a central field.
const POINT: f64 = 11.0;

/// Predicts what flights of a system cost.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cost {
    gravity: f64,
    /// Bodies that move, with three equal principal moments, two and none.
    moving: [f64; 3],
    pivoted: f64,
}

impl Cost {
    pub(super) fn new(system: &System) -> Self {
        let mut moving = [0.0; 3];
        let bodies = system.bodies().iter();
        let is_pivoted = |body: &&RigidBody| *body.mobility() == Mobility::Pivoted;
        let pivoted = bodies.clone().filter(is_pivoted).count() as f64;
        for body in bodies.filter(|body| !body.mobility().is_given()) {
            moving[different(body.inertia()) - 1] += 1.0;
        }
        Self {
            gravity: POINT * system.cost(),
            moving,
            pivoted,
        }
    }

    /// Whether no method can be much cheaper than the closed form, or it costs less than a pilot flight.
    pub(super) fn is_closed_form_cheap(&self, steps: f64) -> bool {
        let exact = self.closed_form(steps);
        let least = steps * (STEP + (BODY + DISCRETE) * self.bodies());
        exact < LIKE * least || exact < SMALL
    }

    fn closed_form(&self, steps: f64) -> f64 {
        steps * (STEP + self.of(CLOSED_FORM))
    }

    /// Of a flight in which the method makes `made` steps, with states wanted at `shown` of them or between.
    pub(super) fn flight(&self, family: &Family, made: f64, shown: f64) -> f64 {
        let stages = f64::from(family.stages);
        let bodies = self.bodies();
        match family.kind {
            Kind::Equal(method) => {
                let stage = self.gravity + self.drift(method);
                made * (STEP + BODY * bodies + stages * stage)
            }
            Kind::Closed(_) => self.closed_form(shown),
            Kind::Adaptive(_) => {
                let [own, body] = ADAPTIVE;
                let stage = self.gravity + own + body * bodies;
                let dense = DENSE * made.min(shown) * stage;
                made * stages * stage + dense + shown * (STEP + SHOWN * bodies)
            }
        }
    }

    fn drift(&self, method: Method) -> f64 {
        match rotor(method) {
            Rotor::Discrete(_) => DISCRETE * self.bodies() + PIVOTED * self.pivoted,
            Rotor::Preprocessed(_) => PREPROCESSED * self.bodies(),
            Rotor::Exact => self.of(EXACT),
        }
    }

    /// The sum over the bodies of a cost by the number of different moments.
    fn of(&self, costs: [f64; 3]) -> f64 {
        self.moving
            .iter()
            .zip(costs)
            .map(|(n, cost)| n * cost)
            .sum()
    }

    fn bodies(&self) -> f64 {
        self.moving.iter().sum()
    }
}

fn rotor(method: Method) -> Rotor {
    match method {
        Method::Lgvi(rotor) | Method::Composition { rotor, .. } | Method::Nystrom { rotor, .. } => {
            rotor
        }
        _ => Rotor::default(),
    }
}

/// How many different principal moments.
fn different(inertia: &Inertia) -> usize {
    let mut moments = inertia.principal_moments();
    moments.sort_by(f64::total_cmp);
    let [least, middle, greatest] = moments;
    let differ = |a: f64, b: f64| usize::from(b - a > 4.0 * f64::EPSILON * greatest);
    1 + differ(least, middle) + differ(middle, greatest)
}
