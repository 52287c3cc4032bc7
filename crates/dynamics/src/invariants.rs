use lgvi_lie::orthogonality_error;
use nalgebra::Vector3;

use crate::{BodyState, System};

/// Quantities conserved by the exact flow of a system.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Invariants {
    /// Sum of kinetic and potential energy of all bodies and their wheels.
    pub energy: f64,
    /// Total linear momentum, inertial frame. Conserved if all gravity is mutual.
    pub linear_momentum: Vector3<f64>,
    /// Total angular momentum about the origin, inertial frame.
    pub angular_momentum: Vector3<f64>,
    /// Largest Frobenius norm of `RᵀR − I` over the bodies.
    pub orthogonality_error: f64,
}

impl Invariants {
    /// Computes the invariants of `system` in `states`.
    pub fn of(system: &System, states: &[BodyState]) -> Self {
        let mut sum = Self {
            energy: system.potential(states),
            linear_momentum: Vector3::zeros(),
            angular_momentum: Vector3::zeros(),
            orthogonality_error: 0.0,
        };
        for (body, state) in system.bodies().iter().zip(states) {
            sum.energy += 0.5 * state.linear_momentum.dot(&state.velocity(body))
                + 0.5 * state.angular_momentum.dot(&state.angular_velocity(body));
            sum.linear_momentum += state.linear_momentum;
            sum.angular_momentum += state.position.cross(&state.linear_momentum)
                + state.attitude * state.angular_momentum;
            if let Some(wheels) = body.wheels() {
                sum.energy += wheels.energy();
                sum.angular_momentum += state.attitude * wheels.momentum();
            }
            sum.orthogonality_error = sum
                .orthogonality_error
                .max(orthogonality_error(&state.attitude));
        }
        sum
    }
}
