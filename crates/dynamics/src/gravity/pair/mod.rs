//! What two bodies exert on each other, one kind of pair a file.

mod attractor;
mod multipoles;
mod points;

use nalgebra::Vector3;

use crate::{BodyState, Load, MassDistribution, PointMass, RigidBody};

/// What two bodies exert on each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exchange {
    /// Force on the first, inertial frame; that on the second is its opposite.
    force: Vector3<f64>,
    /// Moment on each, in its own frame.
    moments: [Vector3<f64>; 2],
}

impl Exchange {
    /// Seen from the other body.
    fn swapped(self) -> Self {
        let [first, second] = self.moments;
        Self {
            force: -self.force,
            moments: [second, first],
        }
    }

    /// Adds `constant` times this to the loads of the two.
    pub(super) fn add_to(&self, loads: [&mut Load; 2], constant: f64) {
        let [first, second] = loads;
        let force = constant * self.force;
        first.force += force;
        second.force -= force;
        first.moment += constant * self.moments[0];
        second.moment += constant * self.moments[1];
    }
}

/// One of a pair: its mass, where it is, and the arms `R ρ` of its points.
#[derive(Clone, Copy)]
pub(super) struct Member<'a> {
    pub(super) body: &'a RigidBody,
    pub(super) state: &'a BodyState,
    pub(super) arms: &'a [Vector3<f64>],
}

/// The exchange of two bodies, with gravitational constant 1.
#[inline]
pub(super) fn exchange(first: Member, second: Member) -> Exchange {
    use MassDistribution::{Multipole, Points};
    match (first.body.distribution(), second.body.distribution()) {
        (Points(_), Points(_)) => points::exchange(first, second),
        (Multipole(a), Multipole(b)) => multipoles::exchange([a, b], [first.state, second.state]),
        (Multipole(a), Points(points)) => attractor::exchange(a, first.state, points, second.state),
        (Points(points), Multipole(b)) => {
            attractor::exchange(b, second.state, points, first.state).swapped()
        }
    }
}

/// What an exchange costs, in multiples of a point in a central field, roughly.
pub(super) fn cost(first: &RigidBody, second: &RigidBody) -> f64 {
    use MassDistribution::{Multipole, Points};
    match (first.distribution(), second.distribution()) {
        (Points(a), Points(b)) => 1.25 * (a.len() * b.len()) as f64,
        (Multipole(_), Multipole(_)) => 3.0,
        (Multipole(_), Points(points)) | (Points(points), Multipole(_)) => {
            2.0 * points.len() as f64
        }
    }
}

/// Their potential, with gravitational constant 1.
pub(super) fn potential(bodies: [&RigidBody; 2], states: [&BodyState; 2]) -> f64 {
    use MassDistribution::{Multipole, Points};
    let [first, second] = states;
    match bodies.map(RigidBody::distribution) {
        [Points(a), Points(b)] => points::potential([a, b], states),
        [Multipole(a), Multipole(b)] => multipoles::potential([a, b], states),
        [Multipole(a), Points(points)] => attractor::potential(a, first, points, second),
        [Points(points), Multipole(b)] => attractor::potential(b, second, points, first),
    }
}
