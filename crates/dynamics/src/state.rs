use nalgebra::{Matrix3, Vector3};

use crate::RigidBody;

/// The state of one rigid body in T*SE(3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyState {
    /// `x`: center of mass, inertial frame.
    pub position: Vector3<f64>,
    /// `γ = m ẋ`: linear momentum, inertial frame.
    pub linear_momentum: Vector3<f64>,
    /// `R`: rotation matrix, body to inertial.
    pub attitude: Matrix3<f64>,
    /// `Π = J Ω`: angular momentum about the center of mass, body frame, without that of [`wheels`](crate::wheels) about
    /// their axes.
    pub angular_momentum: Vector3<f64>,
}

impl BodyState {
    /// Creates the state of `body` with velocity `ẋ` (inertial frame) and angular velocity `Ω` (body frame).
    pub fn from_velocities(
        body: &RigidBody,
        position: Vector3<f64>,
        velocity: Vector3<f64>,
        attitude: Matrix3<f64>,
        angular_velocity: Vector3<f64>,
    ) -> Self {
        Self {
            position,
            linear_momentum: body.mass() * velocity,
            attitude,
            angular_momentum: body.inertia().matrix() * angular_velocity,
        }
    }

    /// `ẋ`, inertial frame.
    pub fn velocity(&self, body: &RigidBody) -> Vector3<f64> {
        self.linear_momentum / body.mass()
    }

    /// `Ω = J⁻¹ Π`, body frame.
    pub fn angular_velocity(&self, body: &RigidBody) -> Vector3<f64> {
        body.inertia().inverse() * self.angular_momentum
    }

    /// The state with the same velocities, to the bit if the bodies are alike, of the second of two bodies instead of the first.
    pub fn of_other(&self, [own, other]: [&RigidBody; 2]) -> Self {
        if own.mass() == other.mass() && own.inertia() == other.inertia() {
            return *self;
        }
        let (velocity, rate) = (self.velocity(own), self.angular_velocity(own));
        Self::from_velocities(other, self.position, velocity, self.attitude, rate)
    }

    /// Returns true if all components are finite.
    #[inline]
    pub fn is_finite(&self) -> bool {
        // 0 × x is 0 for finite x and NaN otherwise.
        let sum = |v: &Vector3<f64>| v.x + v.y + v.z;
        let vectors =
            sum(&self.position) + sum(&self.linear_momentum) + sum(&self.angular_momentum);
        let zero = 0.0 * (vectors + self.attitude.sum());
        zero == 0.0 || self.all_finite()
    }

    /// Checks each component, because a sum of finite numbers may overflow.
    #[cold]
    fn all_finite(&self) -> bool {
        let vectors = [
            &self.position,
            &self.linear_momentum,
            &self.angular_momentum,
        ];
        let mut components = vectors.into_iter().flatten().chain(&self.attitude);
        components.all(|component| component.is_finite())
    }
}
