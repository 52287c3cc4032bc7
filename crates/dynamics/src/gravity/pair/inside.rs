use crate::gravity::PolyhedronField;
use crate::{BodyState, MassDistribution, RigidBody};

/// The sum of the two bodies' reaches if one body is a polyhedron and a point of the other is inside it, else `None`.
/// The reach is the radius of the sphere about the origin that contains the body. A multipole's only point is its
/// origin.
pub(in super::super) fn reach_of_overlap(
    bodies: [&RigidBody; 2],
    states: [&BodyState; 2],
) -> Option<f64> {
    let [first, second] = bodies;
    let [at, there] = states;
    (enters(first, at, second, there) || enters(second, there, first, at))
        .then(|| reach(first) + reach(second))
}

fn field(body: &RigidBody) -> Option<&PolyhedronField> {
    match body.distribution() {
        MassDistribution::Polyhedron(mass) => Some(mass.field()),
        _ => None,
    }
}

fn reach(body: &RigidBody) -> f64 {
    let points = body.points().iter();
    let furthest = points.fold(0.0, |reach: f64, point| reach.max(point.position.norm()));
    field(body).map_or(furthest, PolyhedronField::bounding_radius)
}

/// Returns true if a point of `other` is inside `body`.
fn enters(body: &RigidBody, at: &BodyState, other: &RigidBody, there: &BodyState) -> bool {
    let Some(field) = field(body) else {
        return false;
    };
    let separation = at.attitude.tr_mul(&(there.position - at.position));
    if separation.norm() > field.bounding_radius() + reach(other) {
        return false;
    }
    let turn = at.attitude.tr_mul(&there.attitude);
    let mut points = other.points().iter();
    field.contains(&separation)
        || points.any(|point| field.contains(&(separation + turn * point.position)))
}
