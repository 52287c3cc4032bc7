use nalgebra::Vector3;

use super::{Exchange, PointMass};
use crate::BodyState;
use crate::gravity::Attractor;

/// The exchange between an attractor and another body's points, `d = R_iᵀ(x_j + R_j ρ − x_i)`: `U = Σ m φ(d)`. Each
/// point exerts the opposite force on the attractor, so total momenta are conserved.
#[inline]
pub(super) fn exchange<A: Attractor>(
    attractor: &A,
    at: &BodyState,
    points: &[PointMass],
    there: &BodyState,
) -> Exchange {
    let separation = at.attitude.tr_mul(&(there.position - at.position));
    let turn = at.attitude.tr_mul(&there.attitude);
    let mut recoil = Vector3::zeros();
    let mut torques = [Vector3::zeros(); 2];
    for PointMass { mass, position } in points {
        let arm = turn * position;
        let d = separation + arm;
        let force = *mass * attractor.acceleration(&d);
        recoil -= force;
        torques[0] += force.cross(&d);
        torques[1] += arm.cross(&force);
    }
    Exchange {
        force: at.attitude * recoil,
        moments: [torques[0], turn.tr_mul(&torques[1])],
    }
}

pub(super) fn potential<A: Attractor>(
    attractor: &A,
    at: &BodyState,
    points: &[PointMass],
    there: &BodyState,
) -> f64 {
    let each = |point: &PointMass| {
        let place = there.position + there.attitude * point.position;
        point.mass * attractor.potential(&at.attitude.tr_mul(&(place - at.position)))
    };
    points.iter().map(each).sum()
}
