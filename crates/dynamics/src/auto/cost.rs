use crate::integrator::{Rotor, Splitting};
use crate::{Inertia, Method, Mobility, RigidBody, System};

// Costs in nanoseconds of one core of the machine that they were measured on; only their ratios matter. To measure
// them again: `lgvi_bench costs`.

/// A step without stages.
const STEP: f64 = 15.0;

/// Per body and step: copying and checking states.
const BODY: f64 = 8.0;

/// Per body and drift, a kick and a drift by the discrete rotor.
const DISCRETE: f64 = 40.0;

/// The same by the exact rotor, of bodies with three equal principal moments, two and none.
const EXACT: [f64; 3] = [42.0, 31.0, 145.0];

/// More than that for a body that is not free but pivoted, by the discrete rotor: its steps turn it by some tenths of a
/// radian, and the rotor's equation takes more iterations.
const PIVOTED: f64 = 45.0;

/// Per body and step of the closed form, likewise.
const CLOSED_FORM: [f64; 3] = [60.0, 80.0, 302.0];

/// A stage of an adaptive method, of its own and per body.
const ADAPTIVE: [f64; 2] = [15.0, 31.0];

/// Evaluations of gravity in a step of Dormand and Prince's method, and more in one within which states are shown.
pub(super) const STAGES: u32 = 12;
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

    /// A flight in closed form.
    pub(super) fn closed_form(&self, steps: f64) -> f64 {
        steps * (STEP + self.of(CLOSED_FORM))
    }

    /// A step of kicks and drifts.
    pub(super) fn step(&self, splitting: &Splitting, rotor: Rotor) -> f64 {
        let (evaluations, drifts) = splitting.work();
        let drift = match rotor {
            Rotor::Exact => self.of(EXACT),
            Rotor::Discrete => DISCRETE * self.bodies() + PIVOTED * self.pivoted,
        };
        let own = STEP + BODY * self.bodies();
        own + f64::from(evaluations) * self.gravity + f64::from(drifts) * drift
    }

    /// An internal step of Dormand and Prince's method.
    pub(super) fn internal_step(&self) -> f64 {
        f64::from(STAGES) * self.stage()
    }

    /// What is shown of a flight of so many internal steps.
    pub(super) fn shown(&self, internal: f64, shown: f64) -> f64 {
        DENSE * internal.min(shown) * self.stage() + shown * (STEP + SHOWN * self.bodies())
    }

    fn stage(&self) -> f64 {
        let [own, body] = ADAPTIVE;
        self.gravity + own + body * self.bodies()
    }

    /// The sum over the bodies of a cost by the number of different moments.
    fn of(&self, costs: [f64; 3]) -> f64 {
        let each = self.moving.iter().zip(costs);
        each.map(|(n, cost)| n * cost).sum()
    }

    fn bodies(&self) -> f64 {
        self.moving.iter().sum()
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

/// The method of kicks and drifts, and how it turns bodies; none for others.
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
