use lgvi_lie::{Quaternion, exp, left_jacobian};
use nalgebra::{Matrix3, Vector3};

use crate::{BodyState, RigidBody};

/// The ways in which a body may move.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Mobility {
    /// Moves and rotates under forces and moments.
    #[default]
    Free,
    /// Rotates about the origin of its frame, which is held in place: a pendulum or a top. Inertia and points are
    /// relative to that pivot.
    Pivoted,
    /// Does not move under any load.
    Fixed,
    /// Moves on a prescribed path, regardless of loads.
    Driven(Drive),
}

impl Mobility {
    /// Returns true if the motion is prescribed and independent of loads.
    pub fn is_given(&self) -> bool {
        matches!(self, Self::Fixed | Self::Driven(_))
    }
}

/// A prescribed motion: a constant twist of the inertial frame and a constant spin in the body, `ẋ = v + ω × x`, `Ω =
/// Rᵀω + s`. It covers uniform motion, circular orbits and any uniform spin.
///
/// The twist moves the body along its orbit, and the spin rotates it about itself. Both are one-parameter groups that
/// commute, so the motion over any time has a closed form that does not depend on absolute time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drive {
    /// `v`: velocity of the twist at the inertial origin, inertial frame.
    pub velocity: Vector3<f64>,
    /// `ω`: angular velocity of the twist, inertial frame.
    pub rate: Vector3<f64>,
    /// `s`: additional angular velocity, body frame.
    pub spin: Vector3<f64>,
}

impl Drive {
    /// Uniform motion with velocity `v` (inertial frame) and angular velocity `s` (body frame).
    pub fn uniform(velocity: Vector3<f64>, spin: Vector3<f64>) -> Self {
        Self {
            velocity,
            rate: Vector3::zeros(),
            spin,
        }
    }

    /// A circle about `center` with angular velocity `ω` (inertial frame). The body rotates with it, and additionally
    /// by `s` (body frame).
    pub fn circle(center: Vector3<f64>, rate: Vector3<f64>, spin: Vector3<f64>) -> Self {
        Self {
            velocity: center.cross(&rate),
            rate,
            spin,
        }
    }

    /// The state after time `t`, which depends only on the pose and the path. Its momenta are those of the path.
    pub fn advance(&self, body: &RigidBody, state: &BodyState, t: f64) -> BodyState {
        let turn = self.rate * t;
        let twist = exp(&turn);
        let spin = Quaternion::from_rotation_vector(&(self.spin * t));
        let attitude = spin.compose(&(twist * state.attitude));
        let position = twist * state.position + left_jacobian(&turn) * (self.velocity * t);
        self.state(body, position, attitude)
    }

    /// The state at a pose on the path.
    pub fn state(
        &self,
        body: &RigidBody,
        position: Vector3<f64>,
        attitude: Matrix3<f64>,
    ) -> BodyState {
        let velocity = self.velocity + self.rate.cross(&position);
        let angular_velocity = attitude.tr_mul(&self.rate) + self.spin;
        BodyState::from_velocities(body, position, velocity, attitude, angular_velocity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Inertia;
    use lgvi_lie::hat;

    /// The derivative of the path is its velocity, and two consecutive advances equal a single one.
    #[test]
    fn a_driven_body_follows_its_twist() {
        let inertia = Inertia::principal([1.0, 2.0, 2.5]).unwrap();
        let body = RigidBody::new(2.0, inertia, vec![]).unwrap();
        let drive = Drive {
            velocity: Vector3::new(0.3, -0.2, 0.5),
            rate: Vector3::new(0.4, 0.1, -0.7),
            spin: Vector3::new(-1.0, 2.0, 0.3),
        };
        let start = drive.state(
            &body,
            Vector3::new(1.0, 2.0, -0.5),
            exp(&Vector3::new(0.3, 1.0, -0.4)),
        );
        for t in [1e-3, 0.7, 5.0] {
            let now = drive.advance(&body, &start, t);
            let e = 1e-5;
            let ahead = drive.advance(&body, &start, t + e);
            let behind = drive.advance(&body, &start, t - e);
            let velocity = (ahead.position - behind.position) / (2.0 * e);
            assert!((velocity - now.velocity(&body)).norm() < 1e-9);
            let rate = now.attitude.tr_mul(&(ahead.attitude - behind.attitude)) / (2.0 * e);
            let omega = now.angular_velocity(&body);
            assert!((rate - hat(&omega)).norm() < 1e-8);
            let twice = drive.advance(&body, &drive.advance(&body, &start, 0.5 * t), 0.5 * t);
            assert!((twice.position - now.position).norm() < 1e-14);
            assert!((twice.attitude - now.attitude).norm() < 1e-14);
        }
    }

    #[test]
    fn a_circle_keeps_its_distance_from_its_center() {
        let inertia = Inertia::principal([1.0; 3]).unwrap();
        let body = RigidBody::new(1.0, inertia, vec![]).unwrap();
        let center = Vector3::new(5.0, -1.0, 2.0);
        let rate = Vector3::new(0.0, 0.0, 0.5);
        let drive = Drive::circle(center, rate, Vector3::zeros());
        let start = drive.state(
            &body,
            center + Vector3::new(2.0, 0.0, 0.0),
            Matrix3::identity(),
        );
        let quarter = drive.advance(&body, &start, std::f64::consts::PI);
        assert!((quarter.position - center - Vector3::new(0.0, 2.0, 0.0)).norm() < 1e-14);
        assert!((quarter.velocity(&body) - Vector3::new(-1.0, 0.0, 0.0)).norm() < 1e-14);
    }
}
