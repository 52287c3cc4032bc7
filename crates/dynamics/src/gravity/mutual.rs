use nalgebra::Vector3;

use super::{CloseApproach, Gravity};
use crate::{BodyState, Load, RigidBody};

/// Newtonian attraction of all bodies on each other, point by point:
/// `U = −Σ_{i<j} Σ_{p,q} G m_p m_q / |x_i + R_i ρ_p − x_j − R_j ρ_q|` (§3.4).
///
/// Each pair of points enters both bodies with the same force and opposite sign, so that total linear and angular
/// momentum are kept to rounding.
///
/// # Assumptions and limitations
/// Two points at one place have no finite load. The cost grows with the product of the bodies' numbers of points.
#[derive(Clone, Debug)]
pub struct Mutual {
    /// Gravitational constant `G`.
    constant: f64,
    /// Arms `R ρ` of all bodies' points, body after body.
    arms: Vec<Vector3<f64>>,
}

impl Mutual {
    /// Mutual attraction with gravitational constant `G`.
    pub fn new(constant: f64) -> Self {
        Self {
            constant,
            arms: Vec::new(),
        }
    }
}

impl Gravity for Mutual {
    fn add_loads(&mut self, bodies: &[RigidBody], states: &[BodyState], loads: &mut [Load]) {
        self.arms.clear();
        for (body, state) in bodies.iter().zip(states) {
            self.arms.extend(
                body.points()
                    .iter()
                    .map(|point| state.attitude * point.position),
            );
        }
        let mut rest = self.arms.as_slice();
        for (i, body) in bodies.iter().enumerate() {
            let (arms, others) = rest.split_at(body.points().len());
            rest = others;
            let mut others = others;
            for j in i + 1..bodies.len() {
                let (other_arms, further) = others.split_at(bodies[j].points().len());
                others = further;
                let separation = states[i].position - states[j].position;
                let mut force = Vector3::zeros();
                let mut torque = [Vector3::zeros(); 2];
                for (p, arm) in body.points().iter().zip(arms) {
                    for (q, other_arm) in bodies[j].points().iter().zip(other_arms) {
                        let d = separation + arm - other_arm;
                        let squared = d.norm_squared();
                        let pull = self.constant * p.mass * q.mass / (squared * squared.sqrt());
                        let pair = -pull * d;
                        force += pair;
                        torque[0] += arm.cross(&pair);
                        torque[1] -= other_arm.cross(&pair);
                    }
                }
                loads[i].force += force;
                loads[j].force -= force;
                loads[i].moment += states[i].attitude.tr_mul(&torque[0]);
                loads[j].moment += states[j].attitude.tr_mul(&torque[1]);
            }
        }
    }

    fn potential(&self, bodies: &[RigidBody], states: &[BodyState]) -> f64 {
        let mut sum = 0.0;
        for i in 0..bodies.len() {
            for j in i + 1..bodies.len() {
                for p in bodies[i].points() {
                    let from = states[i].position + states[i].attitude * p.position;
                    for q in bodies[j].points() {
                        let to = states[j].position + states[j].attitude * q.position;
                        sum -= self.constant * p.mass * q.mass / (from - to).norm();
                    }
                }
            }
        }
        sum
    }

    fn check_clearance(
        &self,
        bodies: &[RigidBody],
        states: &[BodyState],
    ) -> Result<(), CloseApproach> {
        for (body, (first, at)) in bodies.iter().zip(states).enumerate() {
            for (other, (second, there)) in bodies.iter().zip(states).enumerate().skip(body + 1) {
                let limit = first.radius() + second.radius();
                let distance = (at.position - there.position).norm();
                if distance < limit {
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
}
