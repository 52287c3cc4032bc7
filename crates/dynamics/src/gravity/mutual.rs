use nalgebra::Vector3;

use super::pair::{self, Member};
use super::{CloseApproach, Gravity};
use crate::{BodyState, Load, RigidBody};

/// Newtonian attraction of all bodies on each other, pair by pair as their mass distributions tell: points with points
/// exactly, a multipole's field with points, and two multipoles to the order of the greater.
///
/// Each pair enters both bodies with the same force and opposite sign and with moments that balance it, so that total
/// linear and angular momentum are kept to rounding. Fixed and driven bodies attract the others; among themselves they are
/// left out.
///
/// # Assumptions and limitations
/// Two points at one place have no finite load. The cost grows with the square of the number of bodies and, for bodies of
/// points, with the product of their numbers of points. The truncation is that of [`Multipole`](super::Multipole).
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

/// Whether gravity between the two can move any of them.
fn matters(first: &RigidBody, second: &RigidBody) -> bool {
    !(first.mobility().is_given() && second.mobility().is_given())
}

impl Gravity for Mutual {
    fn cost(&self, bodies: &[RigidBody]) -> f64 {
        let mut sum = 0.0;
        for (index, first) in bodies.iter().enumerate() {
            let others = bodies[..index]
                .iter()
                .filter(|second| matters(first, second));
            sum += others.map(|second| pair::cost(first, second)).sum::<f64>();
        }
        sum
    }

    fn add_loads(&mut self, bodies: &[RigidBody], states: &[BodyState], loads: &mut [Load]) {
        self.arms.clear();
        for (body, state) in bodies.iter().zip(states) {
            for point in body.points() {
                self.arms.push(state.attitude * point.position);
            }
        }
        let mut rest = self.arms.as_slice();
        for (i, (body, state)) in bodies.iter().zip(states).enumerate() {
            let (arms, others) = rest.split_at(body.points().len());
            rest = others;
            let first = Member { body, state, arms };
            let mut others = others;
            let (before, after) = loads.split_at_mut(i + 1);
            for (j, load) in (i + 1..).zip(after) {
                let body = &bodies[j];
                let (arms, further) = others.split_at(body.points().len());
                others = further;
                if matters(first.body, body) {
                    let state = &states[j];
                    let second = Member { body, state, arms };
                    pair::exchange(first, second).add_to([&mut before[i], load], self.constant);
                }
            }
        }
    }

    fn potential(&self, bodies: &[RigidBody], states: &[BodyState]) -> f64 {
        let mut sum = 0.0;
        for i in 0..bodies.len() {
            for j in i + 1..bodies.len() {
                if matters(&bodies[i], &bodies[j]) {
                    sum += pair::potential([&bodies[i], &bodies[j]], [&states[i], &states[j]]);
                }
            }
        }
        self.constant * sum
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
                if distance < limit && matters(first, second) {
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
