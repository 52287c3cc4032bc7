//! What two bodies exert on each other, one kind of pair a file.

mod attractor;
mod couple;
mod multipoles;
mod points;

use nalgebra::Vector3;

pub(super) use couple::Couple;

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
    #[inline]
    pub(super) fn add_to(&self, loads: &mut [Load], pair: [usize; 2], constant: f64) {
        let [first, second] = pair;
        let force = constant * self.force;
        loads[first].force += force;
        loads[second].force -= force;
        loads[first].moment += constant * self.moments[0];
        loads[second].moment += constant * self.moments[1];
    }
}

/// The exchange of two bodies, with gravitational constant 1.
#[inline]
pub(super) fn exchange(
    [first, second]: [&RigidBody; 2],
    [at, there]: [&BodyState; 2],
    couples: &mut Vec<Couple>,
) -> Exchange {
    use MassDistribution::{Multipole, Points};
    match (first.distribution(), second.distribution()) {
        (Points(a), Points(b)) => points::exchange([a, b], [at, there], couples),
        (Multipole(a), Multipole(b)) => multipoles::exchange([a, b], [at, there]),
        (Multipole(a), Points(points)) => attractor::exchange(a, at, points, there),
        (Points(points), Multipole(b)) => attractor::exchange(b, there, points, at).swapped(),
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
