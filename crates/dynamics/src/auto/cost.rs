use nalgebra::Vector3;

use crate::integrator::{
    ExpansionSize as Size, Integrator, KeplerScheme, Rotor, Splitting, WisdomHolman,
};
use crate::{BodyState, Inertia, Method, Mobility, RigidBody, System};

// Costs are in nanoseconds of one core of the machine on which they were measured. Only their ratios matter.
// `lgvi_bench costs` measures them again.

/// Overhead of a step without its stages.
const STEP: f64 = 15.0;

/// Cost per body and step of copying and checking states.
const BODY: f64 = 8.0;

/// Cost per body and drift of a kick and a drift with the discrete rotor.
const DISCRETE: f64 = 40.0;

/// Cost per body and drift of a kick and a drift with the exact rotor, for bodies with three equal principal moments,
/// with two, and with none.
const EXACT: [f64; 3] = [42.0, 31.0, 145.0];

/// Additional cost of a pivoted body with the discrete rotor. Its steps rotate it by some tenths of a radian, so the
/// rotor's equation takes more iterations.
const PIVOTED: f64 = 45.0;

/// Cost per body of Kepler's motion, and of the attraction of its center in a kick.
const KEPLER: f64 = 130.0;
const CENTER: f64 = 12.0;

/// Cost per body and step of the closed form, by the same three cases.
const CLOSED_FORM: [f64; 3] = [60.0, 80.0, 302.0];

/// Cost of a stage of an adaptive method: per stage, and per stage and body.
const ADAPTIVE: [f64; 2] = [15.0, 31.0];

/// Gravity evaluations in a step of the Dormand–Prince method, and the additional cost of dense output in a step, in
/// stages.
pub(super) const STAGES: u32 = 12;
const DENSE: f64 = 4.0;

/// Cost per body and dense output state of an adaptive method.
const SHOWN: f64 = 97.0;

/// Cost of a step of a Taylor series: in all, and per order for a body, for its rotation, for a group of forces, and
/// because a force waits for places and a velocity for forces.
const EXPANSION: f64 = 120.0;
const EXPANDED_BODY: f64 = 6.0;
const EXPANDED_ROTATION: f64 = 4.0;
const EXPANDED_FORCES: f64 = 10.0;
const WAITING: f64 = 45.0;

/// Cost of a term of a product of Taylor series, in all lanes.
const TERM: f64 = 0.3;

/// Cost per body and output state of a Taylor series: in all, and per order.
const EVALUATED: [f64; 2] = [50.0, 2.5];

/// Cost of a point mass in a central field.
const POINT: f64 = 11.0;

/// Predicts the cost of flights of a system.
#[derive(Clone, Debug)]
pub(super) struct Cost {
    gravity: f64,
    /// Numbers of moving bodies with three equal principal moments, with two, and with none.
    moving: [f64; 3],
    pivoted: f64,
    /// Size of the Taylor series, if they can be used, and numbers of bodies that turn without being expanded, by their
    /// principal moments as above.
    expansion: Option<(Size, [f64; 3])>,
    /// What the Wisdom–Holman method makes of the system, if it can be used.
    kepler: Option<Kepler>,
}

/// What the Wisdom–Holman method need not compute in each stage.
#[derive(Clone, Copy, Debug)]
struct Kepler {
    /// True if Kepler's motion is all there is.
    solved: bool,
    /// Numbers of bodies that rotate once in a step, by their principal moments as above.
    coasting: [f64; 3],
}

impl Kepler {
    fn of(system: &mut System, states: &[BodyState]) -> Option<Self> {
        let mut method = WisdomHolman::new(KeplerScheme::default(), system).ok()?;
        method.check(system, states).ok()?;
        method.start(system, states);
        let (solved, coasts) = method.outline()?;
        let coasting = count(system, |body| coasts[body]);
        Some(Self { solved, coasting })
    }
}

impl Cost {
    pub(super) fn new(system: &mut System, states: &[BodyState]) -> Self {
        let kepler = Kepler::of(system, states);
        let expansion = Size::of(system).map(|size| {
            let turns = |body: usize| states[body].angular_momentum != Vector3::zeros();
            let free = count(system, |body| turns(body) && !size.turning[body]);
            (size, free)
        });
        let bodies = system.bodies().iter();
        let is_pivoted = |body: &&RigidBody| *body.mobility() == Mobility::Pivoted;
        Self {
            gravity: POINT * system.cost(),
            moving: count(system, |_| true),
            pivoted: bodies.filter(is_pivoted).count() as f64,
            expansion,
            kepler,
        }
    }

    /// The cost of a flight in closed form.
    pub(super) fn closed_form(&self, steps: f64) -> f64 {
        steps * (STEP + self.of(CLOSED_FORM))
    }

    /// The cost of a step of a method of equal steps, or infinity if it cannot be used.
    pub(super) fn step(&self, method: Method) -> f64 {
        let own = STEP + BODY * self.bodies();
        let (evaluations, drifts) = work(method);
        let (evaluations, drifts) = (f64::from(evaluations), f64::from(drifts));
        match (method, &self.kepler) {
            (Method::WisdomHolman { .. }, Some(kepler)) => {
                let turning =
                    drifts * self.of(EXACT) - (drifts - 1.0) * sum(kepler.coasting, EXACT);
                let moving = drifts * KEPLER * self.bodies();
                let kicks = evaluations * (self.gravity + CENTER * self.bodies());
                own + turning + moving + if kepler.solved { 0.0 } else { kicks }
            }
            (Method::WisdomHolman { .. }, None) => f64::INFINITY,
            _ => {
                let drift = match method.rotor() {
                    Some(Rotor::Discrete) => DISCRETE * self.bodies() + PIVOTED * self.pivoted,
                    _ => self.of(EXACT),
                };
                own + evaluations * self.gravity + drifts * drift
            }
        }
    }

    /// The cost of an internal step of the Dormand–Prince method.
    pub(super) fn internal_step(&self) -> f64 {
        f64::from(STAGES) * self.stage()
    }

    /// The cost of dense output for `shown` states in a flight of `internal` internal steps.
    pub(super) fn shown(&self, internal: f64, shown: f64) -> f64 {
        DENSE * internal.min(shown) * self.stage() + shown * (STEP + SHOWN * self.bodies())
    }

    /// True if Taylor series can be used.
    pub(super) fn expands(&self) -> bool {
        self.expansion.is_some()
    }

    /// The cost of a step of a Taylor series of this order, or infinity if there is none.
    pub(super) fn expansion(&self, order: u32) -> f64 {
        let Some((size, _)) = &self.expansion else {
            return f64::INFINITY;
        };
        let order = f64::from(order);
        let rotations = size.turning.iter().filter(|turns| **turns).count();
        let bodies = EXPANDED_BODY * self.bodies() + EXPANDED_ROTATION * rotations as f64;
        let waiting = if size.forces > 0.0 { WAITING } else { 0.0 };
        let own = bodies + EXPANDED_FORCES * size.forces + waiting;
        EXPANSION + order * (own + 0.5 * order * TERM * size.terms)
    }

    /// The cost of `shown` output states of a Taylor series of this order.
    pub(super) fn evaluated(&self, order: u32, shown: f64) -> f64 {
        let [own, each] = EVALUATED;
        let free = self.expansion.as_ref().map_or([0.0; 3], |(_, free)| *free);
        let bodies = self.bodies() * (own + each * f64::from(order));
        shown * (STEP + bodies + sum(free, CLOSED_FORM))
    }

    fn stage(&self) -> f64 {
        let [own, body] = ADAPTIVE;
        self.gravity + own + body * self.bodies()
    }

    /// The sum of `costs` over the bodies, indexed by the number of distinct principal moments.
    fn of(&self, costs: [f64; 3]) -> f64 {
        sum(self.moving, costs)
    }

    fn bodies(&self) -> f64 {
        self.moving.iter().sum()
    }
}

/// Numbers of those moving bodies that are counted, by their numbers of distinct principal moments.
fn count(system: &System, counts: impl Fn(usize) -> bool) -> [f64; 3] {
    let mut numbers = [0.0; 3];
    for (index, body) in system.bodies().iter().enumerate() {
        if counts(index) && !body.mobility().is_given() {
            numbers[different(body.inertia()) - 1] += 1.0;
        }
    }
    numbers
}

/// The number of distinct principal moments.
fn different(inertia: &Inertia) -> usize {
    let mut moments = inertia.principal_moments();
    moments.sort_by(f64::total_cmp);
    let [least, middle, greatest] = moments;
    let differ = |a: f64, b: f64| usize::from(b - a > 4.0 * f64::EPSILON * greatest);
    1 + differ(least, middle) + differ(middle, greatest)
}

fn sum(bodies: [f64; 3], costs: [f64; 3]) -> f64 {
    let each = bodies.iter().zip(costs);
    each.map(|(n, cost)| n * cost).sum()
}

/// The numbers of gravity evaluations and drifts in a step of a method of equal steps.
pub(super) fn work(method: Method) -> (u32, u32) {
    match method {
        Method::Nystrom { order } => {
            Splitting::nystrom(order, &[]).map_or((0, 0), |splitting| splitting.work())
        }
        Method::Composition { order, rotor } => {
            let splitting = Splitting::composition(order, rotor, &[]);
            splitting.map_or((0, 0), |splitting| splitting.work())
        }
        Method::WisdomHolman { scheme } => WisdomHolman::work(scheme),
        _ => (1, 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evaluations_are_those_of_the_methods() {
        let nystrom = |order| Method::Nystrom { order };
        let counted = [
            Method::Lgvi(Rotor::Exact),
            nystrom(4),
            nystrom(6),
            nystrom(8),
        ]
        .map(work);
        assert_eq!(counted, [(1, 1), (6, 6), (14, 15), (19, 20)]);
        let rotor = Rotor::Exact;
        let composed = [4, 6, 8].map(|order| work(Method::Composition { order, rotor }));
        assert_eq!(composed, [(5, 5), (13, 13), (21, 21)]);
        let schemes = KeplerScheme::ALL.map(|scheme| work(Method::WisdomHolman { scheme }));
        assert_eq!(schemes, [(1, 1), (4, 5), (7, 8), (8, 9)]);
    }
}
