use crate::integrator::{ExpansionSize as Size, Rotor, Splitting};
use crate::{Inertia, Method, Mobility, RigidBody, System};

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

/// Cost of a step of a Taylor series: in all, and per order for a body, for its rotation, and for a group of forces.
const EXPANSION: f64 = 120.0;
const EXPANDED_BODY: f64 = 10.0;
const EXPANDED_ROTATION: f64 = 6.0;
const EXPANDED_FORCES: f64 = 20.0;

/// Cost of a term of a product of Taylor series, in all lanes.
const TERM: f64 = 0.36;

/// Cost per body and output state of a Taylor series: in all, and per order.
const EVALUATED: [f64; 2] = [50.0, 2.5];

/// Cost of a point mass in a central field.
const POINT: f64 = 11.0;

/// Predicts the cost of flights of a system.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cost {
    gravity: f64,
    /// Numbers of moving bodies with three equal principal moments, with two, and with none.
    moving: [f64; 3],
    pivoted: f64,
    /// Size of the Taylor series, if they can be used.
    expansion: Option<Size>,
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
            expansion: Size::of(system),
        }
    }

    /// The cost of a flight in closed form.
    pub(super) fn closed_form(&self, steps: f64) -> f64 {
        steps * (STEP + self.of(CLOSED_FORM))
    }

    /// The cost of a step of a splitting method.
    pub(super) fn step(&self, splitting: &Splitting, rotor: Rotor) -> f64 {
        let (evaluations, drifts) = splitting.work();
        let drift = match rotor {
            Rotor::Exact => self.of(EXACT),
            Rotor::Discrete => DISCRETE * self.bodies() + PIVOTED * self.pivoted,
        };
        let own = STEP + BODY * self.bodies();
        own + f64::from(evaluations) * self.gravity + f64::from(drifts) * drift
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
        let Some(size) = &self.expansion else {
            return f64::INFINITY;
        };
        let order = f64::from(order);
        let bodies = EXPANDED_BODY * size.bodies + EXPANDED_ROTATION * size.rotations;
        let own = bodies + EXPANDED_FORCES * size.forces;
        EXPANSION + order * (own + 0.5 * order * TERM * size.terms)
    }

    /// The cost of `shown` output states of a Taylor series of this order.
    pub(super) fn evaluated(&self, order: u32, shown: f64) -> f64 {
        let [own, each] = EVALUATED;
        shown * (STEP + self.bodies() * (own + each * f64::from(order)))
    }

    fn stage(&self) -> f64 {
        let [own, body] = ADAPTIVE;
        self.gravity + own + body * self.bodies()
    }

    /// The sum of `costs` over the bodies, indexed by the number of distinct principal moments.
    fn of(&self, costs: [f64; 3]) -> f64 {
        let each = self.moving.iter().zip(costs);
        each.map(|(n, cost)| n * cost).sum()
    }

    fn bodies(&self) -> f64 {
        self.moving.iter().sum()
    }
}

/// The number of distinct principal moments.
fn different(inertia: &Inertia) -> usize {
    let mut moments = inertia.principal_moments();
    moments.sort_by(f64::total_cmp);
    let [least, middle, greatest] = moments;
    let differ = |a: f64, b: f64| usize::from(b - a > 4.0 * f64::EPSILON * greatest);
    1 + differ(least, middle) + differ(middle, greatest)
}

/// The splitting of a method and its rotor, or `None` if the method is not a splitting.
pub(super) fn splitting(method: Method) -> Option<(Splitting, Rotor)> {
    match method {
        Method::Lgvi(rotor) => Some((Splitting::lgvi(rotor, &[]), rotor)),
        Method::Nystrom { order } => {
            let splitting = Splitting::nystrom(order, &[]).ok()?;
            Some((splitting, Rotor::Exact))
        }
        _ => None,
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
        .map(|method| splitting(method).unwrap().0.work());
        assert_eq!(counted, [(1, 1), (6, 6), (14, 15), (19, 20)]);
    }
}
