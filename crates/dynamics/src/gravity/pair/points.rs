use nalgebra::Vector3;

use super::{Exchange, Member, PointMass};
use crate::BodyState;

/// Point by point: `U = −Σ_{p,q} m_p m_q / |x_i + R_i ρ_p − x_j − R_j ρ_q|` (§3.4).
#[inline]
pub(super) fn exchange(first: Member, second: Member) -> Exchange {
    let separation = first.state.position - second.state.position;
    let mut force = Vector3::zeros();
    let mut torques = [Vector3::zeros(); 2];
    for (p, arm) in first.body.points().iter().zip(first.arms) {
        for (q, other_arm) in second.body.points().iter().zip(second.arms) {
            let d = separation + arm - other_arm;
            let squared = d.norm_squared();
            let pull = p.mass * q.mass / (squared * squared.sqrt());
            let pair = -pull * d;
            force += pair;
            torques[0] += arm.cross(&pair);
            torques[1] -= other_arm.cross(&pair);
        }
    }
    Exchange {
        force,
        moments: [
            first.state.attitude.tr_mul(&torques[0]),
            second.state.attitude.tr_mul(&torques[1]),
        ],
    }
}

pub(super) fn potential(points: [&[PointMass]; 2], states: [&BodyState; 2]) -> f64 {
    let mut sum = 0.0;
    for p in points[0] {
        let from = states[0].position + states[0].attitude * p.position;
        for q in points[1] {
            let to = states[1].position + states[1].attitude * q.position;
            sum -= p.mass * q.mass / (from - to).norm();
        }
    }
    sum
}
