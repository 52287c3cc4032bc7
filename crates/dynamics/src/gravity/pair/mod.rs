//! Forces and moments between two bodies, one kind of pair per file.

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

/// The forces and moments that two bodies exert on each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exchange {
    /// Force on the first body, inertial frame. The force on the second is its opposite.
    force: Vector3<f64>,
    /// Moment on each body, in its own frame.
    moments: [Vector3<f64>; 2],
}

impl Exchange {
    /// The exchange with the bodies in reverse order.
    fn swapped(self) -> Self {
        let [first, second] = self.moments;
        Self {
            force: -self.force,
            moments: [second, first],
        }
    }

    /// Adds `constant` times this exchange to the loads of the two bodies.
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

/// The kind of interaction between two bodies.
enum Meeting<'a> {
    Points([&'a [PointMass]; 2]),
    Multipoles([&'a Multipole; 2]),
    /// A multipole and the other body's points.
    Multipole(&'a Multipole, &'a [PointMass], Order),
    /// A polyhedron's field and the other body's points.
    Polyhedron(&'a PolyhedronField, &'a [PointMass], Order),
}

/// The position of the attractor in the pair.
#[derive(Clone, Copy, PartialEq)]
enum Order {
    First,
    Second,
}

impl<'a> Meeting<'a> {
    /// The interaction of a pair. Of two polyhedra, the larger one is the attractor, because the error decreases with
    /// the size of the body that is represented by its cloud.
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

/// Approximate cost of an exchange, in multiples of a point in a central field.
pub(super) fn cost(bodies: [&RigidBody; 2]) -> f64 {
    match Meeting::of(bodies) {
        Meeting::Points([a, b]) => 2.0 + 0.8 * (a.len() * b.len()) as f64,
        Meeting::Multipoles(_) => 2.5,
        Meeting::Multipole(_, points, _) => 2.0 * points.len() as f64,
        Meeting::Polyhedron(field, points, _) => Attractor::cost(field) * points.len() as f64,
    }
}

/// Computes the exchange of two bodies with gravitational constant 1 and passes it to `to`.
// A closure, because an exchange returned from several branches would pass through memory.
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

/// The force on the first of two point masses, given the product of their masses, with gravitational constant 1.
/// Bitwise equal to the result of [`exchange`].
#[inline]
pub(super) fn between_monopoles(masses: f64, [first, second]: [&BodyState; 2]) -> Vector3<f64> {
    let d = second.position - first.position;
    let squared = d.x * d.x + d.y * d.y + d.z * d.z;
    let inverse = 1.0 / squared;
    d * (masses * (inverse * inverse) * squared.sqrt())
}

/// The exchange of two multipoles, with gravitational constant 1.
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

/// The potential of a pair, with gravitational constant 1.
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
