//! What two bodies exert on each other, one kind of pair a file.

mod attractor;
mod couple;
mod inside;
mod multipoles;
mod points;

use nalgebra::Vector3;

pub(super) use couple::Couple;
pub(super) use inside::reach_of_overlap;

use super::{Attractor, Multipole, PolyhedronField};
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
    #[inline(always)]
    pub(super) fn add_to(&self, loads: &mut [Load], pair: [usize; 2], constant: f64) {
        let [first, second] = pair;
        let force = constant * self.force;
        loads[first].force += force;
        loads[second].force -= force;
        loads[first].moment += constant * self.moments[0];
        loads[second].moment += constant * self.moments[1];
    }
}

/// How two bodies meet.
enum Meeting<'a> {
    Points([&'a [PointMass]; 2]),
    Multipoles([&'a Multipole; 2]),
    /// A multipole and the other's points.
    Multipole(&'a Multipole, &'a [PointMass], Order),
    /// A polyhedron's field and the other's points.
    Polyhedron(&'a PolyhedronField, &'a [PointMass], Order),
}

/// Which of the two is the attractor.
#[derive(Clone, Copy, PartialEq)]
enum Order {
    First,
    Second,
}

impl<'a> Meeting<'a> {
    /// Of two polyhedra the greater is the attractor, for the error falls with the size of the other's cloud.
    #[inline]
    fn of([first, second]: [&'a RigidBody; 2]) -> Self {
        use MassDistribution as Of;
        match (first.distribution(), second.distribution()) {
            (Of::Points(a), Of::Points(b)) => Self::Points([a, b]),
            (Of::Multipole(a), Of::Multipole(b)) => Self::Multipoles([a, b]),
            (Of::Multipole(a), _) => Self::Multipole(a, second.points(), Order::First),
            (_, Of::Multipole(b)) => Self::Multipole(b, first.points(), Order::Second),
            (Of::Polyhedron(a), Of::Polyhedron(b))
                if a.field().bounding_radius() < b.field().bounding_radius() =>
            {
                Self::Polyhedron(b.field(), a.cloud(), Order::Second)
            }
            (Of::Polyhedron(a), _) => Self::Polyhedron(a.field(), second.points(), Order::First),
            (Of::Points(points), Of::Polyhedron(b)) => {
                Self::Polyhedron(b.field(), points, Order::Second)
            }
        }
    }
}

/// What an exchange costs, in multiples of a point in a central field, roughly.
pub(super) fn cost(bodies: [&RigidBody; 2]) -> f64 {
    match Meeting::of(bodies) {
        Meeting::Points([a, b]) => 0.8 * (a.len() * b.len()) as f64,
        Meeting::Multipoles(_) => 2.5,
        Meeting::Multipole(_, points, _) => 2.0 * points.len() as f64,
        Meeting::Polyhedron(field, points, _) => Attractor::cost(field) * points.len() as f64,
    }
}

/// Gives `to` the exchange of two bodies, with gravitational constant 1.
// a closure, for an exchange that is returned from several branches passes through memory
#[inline]
pub(super) fn exchange(
    bodies: [&RigidBody; 2],
    states: [&BodyState; 2],
    couples: &mut Vec<Couple>,
    to: impl FnOnce(Exchange),
) {
    match Meeting::of(bodies) {
        Meeting::Points(points) => to(points::exchange(points, states, couples)),
        Meeting::Multipoles(multipoles) => to(multipoles::exchange(multipoles, states)),
        Meeting::Multipole(field, points, order) => to(attracted(field, points, states, order)),
        Meeting::Polyhedron(field, points, order) => to(attracted(field, points, states, order)),
    }
}

/// The force on the first of two points of mass, with the product of their masses and gravitational constant 1: to the bit what
/// [`exchange`] finds.
#[inline]
pub(super) fn between_monopoles(masses: f64, [first, second]: [&BodyState; 2]) -> Vector3<f64> {
    let d = second.position - first.position;
    let squared = d.x * d.x + d.y * d.y + d.z * d.z;
    let inverse = 1.0 / squared;
    d * (masses * (inverse * inverse) * squared.sqrt())
}

/// The exchange of two series, with gravitational constant 1.
pub(super) fn between_series(series: [&Multipole; 2], states: [&BodyState; 2]) -> Exchange {
    multipoles::exchange(series, states)
}

#[inline]
fn attracted<A: Attractor>(
    field: &A,
    points: &[PointMass],
    [first, second]: [&BodyState; 2],
    order: Order,
) -> Exchange {
    match order {
        Order::First => attractor::exchange(field, first, points, second),
        Order::Second => attractor::exchange(field, second, points, first).swapped(),
    }
}

/// Their potential, with gravitational constant 1.
pub(super) fn potential(bodies: [&RigidBody; 2], states: [&BodyState; 2]) -> f64 {
    match Meeting::of(bodies) {
        Meeting::Points(points) => points::potential(points, states),
        Meeting::Multipoles(multipoles) => multipoles::potential(multipoles, states),
        Meeting::Multipole(field, points, order) => energy(field, points, states, order),
        Meeting::Polyhedron(field, points, order) => energy(field, points, states, order),
    }
}

fn energy<A: Attractor>(
    field: &A,
    points: &[PointMass],
    [first, second]: [&BodyState; 2],
    order: Order,
) -> f64 {
    match order {
        Order::First => attractor::potential(field, first, points, second),
        Order::Second => attractor::potential(field, second, points, first),
    }
}
