use lgvi_control::{RotationTarget, TranslationTarget};
use lgvi_dynamics::{BodyState, RigidBody};
use lgvi_lie::log;
use nalgebra::{SVector, Vector3};

use crate::Scene;

impl Scene {
    /// By how much the planned body's state `end` misses the target, in the order `[x, γ, R, Π]`, where what is free is
    /// not missed; `None` without a manoeuvre.
    ///
    /// Of an orbit it is the difference of the eccentricity vectors times the distance, and that of the angular momenta
    /// over the distance; of a spin axis the least rotation that points it.
    pub fn miss(&self, end: &BodyState) -> Option<SVector<f64, 12>> {
        let nominal = &self.bodies[self.maneuver.as_ref()?.body].body;
        self.miss_of(nominal, end)
    }

    /// The same of a body that takes the planned one's place: it misses the momenta that it would have at the target's
    /// velocities.
    pub fn miss_of(&self, body: &RigidBody, end: &BodyState) -> Option<SVector<f64, 12>> {
        let maneuver = self.maneuver.as_ref()?;
        let none = Vector3::zeros();
        let nominal = &self.bodies[maneuver.body].body;
        let heavier = body.mass() / nominal.mass();
        let linear = |momentum: &Vector3<f64>| momentum * heavier;
        let angular = |momentum: &Vector3<f64>| match body.inertia() == nominal.inertia() {
            true => *momentum,
            false => body.inertia().matrix() * (nominal.inertia().inverse() * momentum),
        };
        let [x, gamma] = match &maneuver.target.translation {
            TranslationTarget::State {
                position,
                linear_momentum,
            } => [
                end.position - position,
                end.linear_momentum - linear(linear_momentum),
            ],
            TranslationTarget::Position { position } => [end.position - position, none],
            TranslationTarget::Orbit {
                gm,
                center,
                position,
                linear_momentum,
            } => {
                let mass = body.mass();
                let orbit = |x: &Vector3<f64>, gamma: &Vector3<f64>| {
                    let x = x - center;
                    let momentum = x.cross(gamma);
                    let eccentricity = gamma.cross(&momentum) / (gm * mass * mass) - x.normalize();
                    (eccentricity, momentum)
                };
                let found = orbit(&end.position, &end.linear_momentum);
                let wanted = orbit(position, &linear(linear_momentum));
                let distance = (position - center).norm();
                [
                    (found.0 - wanted.0) * distance,
                    (found.1 - wanted.1) / distance,
                ]
            }
            TranslationTarget::Free => [none, none],
        };
        let [rotation, pi] = match &maneuver.target.rotation {
            RotationTarget::State {
                attitude,
                angular_momentum,
            } => [
                log(&attitude.tr_mul(&end.attitude)),
                end.angular_momentum - angular(angular_momentum),
            ],
            RotationTarget::Attitude { attitude } => [log(&attitude.tr_mul(&end.attitude)), none],
            RotationTarget::SpinAxis {
                axis,
                direction,
                angular_momentum,
            } => {
                let wanted = end.attitude.tr_mul(direction);
                let (sine, cosine) = (wanted.cross(axis), wanted.dot(axis));
                let angle = libm::atan2(sine.norm(), cosine);
                let turn = sine.try_normalize(0.0).unwrap_or_else(Vector3::x) * angle;
                [turn, end.angular_momentum - angular(angular_momentum)]
            }
            RotationTarget::Free => [none, none],
        };
        let parts = [x, gamma, rotation, pi];
        Some(SVector::from_fn(|row, _| parts[row / 3][row % 3]))
    }
}
