use super::extent::Extent;
use super::pair::{self, Couple};
use super::{
    Clearance, CloseApproach, Form, Gravity, Interaction, Kept, Level, Multipole, Separable,
};
use crate::{BodyState, Load, MassDistribution, RigidBody};

/// Newtonian attraction between all bodies, pair by pair. The mass distributions determine how a pair is computed.
///
/// Points attract points exactly. The field of a polyhedron or multipole acts on points. Two multipoles interact to the
/// higher of their orders. A polyhedron attracts points exactly. If the partner is a multipole, or a polyhedron that is
/// not smaller, the polyhedron is attracted through its cloud.
///
/// Each pair exerts equal and opposite forces on its bodies, and moments that balance them, so total linear and angular
/// momentum are conserved to rounding. Fixed and driven bodies attract the others, but interactions among them are
/// omitted.
///
/// # Assumptions and limitations
/// The load between two points at the same position is not finite. The cost grows with the square of the number of
/// bodies. For bodies of points it also grows with the product of their numbers of points, or of the faces of one body
/// and the points of the other that are near it. The truncation error is that of [`Multipole`](super::Multipole) and of
/// [`PolyhedronMass`](super::PolyhedronMass). A point mass or the center of a multipole inside a polyhedron is reported
/// as a close approach. Contact between two surfaces is not detected.
#[derive(Clone, Debug)]
pub struct Mutual {
    /// Gravitational constant `G`.
    constant: f64,
    /// Buffer for the points of two bodies.
    couples: Vec<Couple>,
    /// Second-order multipoles of the bodies, filled by `prepare`.
    series: Vec<Multipole>,
}

impl Mutual {
    /// Mutual attraction with gravitational constant `G`.
    pub fn new(constant: f64) -> Self {
        Self {
            constant,
            couples: Vec::new(),
            series: Vec::new(),
        }
    }
}

/// Returns true if gravity between the two bodies can move at least one of them.
fn matters(pair: [&RigidBody; 2]) -> bool {
    !pair.iter().all(|body| body.mobility().is_given())
}

impl Gravity for Mutual {
    fn form(&self) -> Option<Form> {
        Some(Form::Mutual {
            constant: self.constant,
        })
    }

    fn constant(&self) -> Option<f64> {
        Some(self.constant)
    }

    fn cost(&self, bodies: &[RigidBody]) -> f64 {
        let mut sum = 0.0;
        for (index, first) in bodies.iter().enumerate() {
            let others = bodies[..index]
                .iter()
                .filter(|second| matters([first, *second]));
            sum += others
                .map(|second| pair::cost([first, second]))
                .sum::<f64>();
        }
        sum
    }

    fn add_loads(&mut self, bodies: &[RigidBody], states: &[BodyState], loads: &mut [Load]) {
        let count = bodies.len().min(states.len()).min(loads.len());
        for i in 0..count {
            for j in i + 1..count {
                let pair = [&bodies[i], &bodies[j]];
                if matters(pair) {
                    let at = [&states[i], &states[j]];
                    pair::exchange(pair, at, &mut self.couples, |exchange| {
                        exchange.add_to(loads, [i, j], self.constant);
                    });
                }
            }
        }
    }

    fn potential(&self, bodies: &[RigidBody], states: &[BodyState]) -> f64 {
        let mut sum = 0.0;
        for i in 0..bodies.len() {
            for j in i + 1..bodies.len() {
                if matters([&bodies[i], &bodies[j]]) {
                    sum += pair::potential([&bodies[i], &bodies[j]], [&states[i], &states[j]]);
                }
            }
        }
        self.constant * sum
    }

    fn separable(&mut self) -> Option<&mut dyn Separable> {
        Some(self)
    }

    fn clearance(&self) -> Option<&dyn Clearance> {
        Some(self)
    }
}

impl Separable for Mutual {
    fn interactions(&self, bodies: &[RigidBody]) -> Vec<Interaction> {
        let extents: Vec<_> = bodies.iter().map(Extent::of).collect();
        let mut all = Vec::new();
        for i in 0..bodies.len() {
            for j in i + 1..bodies.len() {
                let pair = [&bodies[i], &bodies[j]];
                let cost = if matters(pair) { pair::cost(pair) } else { 0.0 };
                let extents = [&extents[i], &extents[j]];
                all.push(Interaction::of_pair(
                    [i, j],
                    pair,
                    extents,
                    (self.constant, cost),
                ));
            }
        }
        all
    }

    fn prepare(&mut self, bodies: &[RigidBody]) {
        let couples = bodies.iter().map(|body| body.points().len().div_ceil(2));
        self.couples.clear();
        self.couples.reserve(2 * couples.max().unwrap_or_default());
        self.series = bodies.iter().map(RigidBody::to_second_order).collect();
    }

    fn add_kept_loads(
        &mut self,
        bodies: &[RigidBody],
        states: &[BodyState],
        loads: &mut [Load],
        kept: &[Kept],
    ) {
        for &Kept {
            body: i,
            other: j,
            level,
            masses,
        } in kept
        {
            let at = [&states[i], &states[j]];
            match level {
                Level::Dropped => {}
                Level::Monopole => {
                    let force = self.constant * pair::between_monopoles(masses, at);
                    loads[i].force += force;
                    loads[j].force -= force;
                }
                Level::Quadrupole => {
                    if self.series.len() != bodies.len() {
                        self.prepare(bodies);
                    }
                    pair::between_series([&self.series[i], &self.series[j]], at).add_to(
                        loads,
                        [i, j],
                        self.constant,
                    );
                }
                Level::Full => {
                    pair::exchange(
                        [&bodies[i], &bodies[j]],
                        at,
                        &mut self.couples,
                        |exchange| {
                            exchange.add_to(loads, [i, j], self.constant);
                        },
                    );
                }
            }
        }
    }
}

impl Clearance for Mutual {
    fn has_extents(&self, bodies: &[RigidBody]) -> bool {
        bodies.iter().any(|body| {
            let solid = matches!(body.distribution(), MassDistribution::Polyhedron(_));
            solid || body.radius() > 0.0
        })
    }

    fn check(&self, bodies: &[RigidBody], states: &[BodyState]) -> Result<(), CloseApproach> {
        check_pairs(bodies, states, |_, _| true)
    }

    fn check_apart(
        &self,
        bodies: &[RigidBody],
        states: &[BodyState],
        apart: &dyn Fn(usize, usize) -> bool,
    ) -> Result<(), CloseApproach> {
        check_pairs(bodies, states, apart)
    }
}

/// Checks the pairs of bodies that are `apart`.
fn check_pairs(
    bodies: &[RigidBody],
    states: &[BodyState],
    apart: impl Fn(usize, usize) -> bool,
) -> Result<(), CloseApproach> {
    for (body, (first, at)) in bodies.iter().zip(states).enumerate() {
        for (other, (second, there)) in bodies.iter().zip(states).enumerate().skip(body + 1) {
            if !(matters([first, second]) && apart(body, other)) {
                continue;
            }
            let distance = (at.position - there.position).norm();
            let radii = first.radius() + second.radius();
            let limit = if distance < radii {
                Some(radii)
            } else {
                pair::reach_of_overlap([first, second], [at, there])
            };
            if let Some(limit) = limit {
                return Err(CloseApproach {
                    body,
                    other: Some(other),
                    distance,
                    limit,
                });
            }
        }
    }
    Ok(())
}
