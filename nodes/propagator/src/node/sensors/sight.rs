//! What sensors see at an instant.

use lgvi_dynamics::{BodyState, RigidBody};
use lgvi_scene::{Exclusion, RelativePose, Scene, Sensor, SensorKind, StarTracker, Toward};
use nalgebra::{Matrix3, Vector3};

use super::Truth;

/// A sensor among the bodies.
pub(super) struct Sight<'a> {
    pub(super) scene: &'a Scene,
    pub(super) bodies: &'a [RigidBody],
    pub(super) states: &'a [BodyState],
    pub(super) sensor: &'a Sensor,
}

impl Sight<'_> {
    /// What it reads; `None` where it sees nothing.
    pub(super) fn truth(&self) -> Option<Truth> {
        match &self.sensor.kind {
            SensorKind::Imu(_) => None,
            SensorKind::StarTracker(tracker) => {
                let sees = !self.is_dazzled(tracker) && self.rate().norm() <= tracker.max_rate;
                sees.then(|| Truth::Attitude(self.attitude()))
            }
            SensorKind::Gnss(_) => {
                let state = self.state();
                let turning = self.rate().cross(&self.sensor.mount.position);
                Some(Truth::Motion {
                    position: self.position(),
                    velocity: state.velocity(self.body()) + state.attitude * turning,
                })
            }
            SensorKind::RelativePose(camera) => self.pose(camera),
        }
    }

    fn body(&self) -> &RigidBody {
        &self.bodies[self.sensor.body]
    }

    fn state(&self) -> &BodyState {
        &self.states[self.sensor.body]
    }

    /// `Ω` of its body.
    fn rate(&self) -> Vector3<f64> {
        self.state().angular_velocity(self.body())
    }

    /// In the inertial frame.
    fn position(&self) -> Vector3<f64> {
        let state = self.state();
        state.position + state.attitude * self.sensor.mount.position
    }

    /// From its axes to the inertial ones.
    fn attitude(&self) -> Matrix3<f64> {
        self.state().attitude * self.sensor.mount.attitude
    }

    /// Whether its boresight is in a cone that it must stay out of.
    fn is_dazzled(&self, tracker: &StarTracker) -> bool {
        let (position, boresight) = (self.position(), self.attitude().column(2).into_owned());
        tracker.exclusions.iter().any(|exclusion| {
            let Exclusion { toward, half_angle } = exclusion;
            let (direction, radius) = match toward {
                Toward::Direction(direction) => (*direction, 0.0),
                Toward::Body(body) => {
                    let center = self.states[*body].position;
                    (center - position, self.bodies[*body].radius())
                }
                Toward::Attractor => {
                    let Some(attractor) = &self.scene.gravity.central else {
                        return false;
                    };
                    (attractor.position - position, attractor.radius)
                }
            };
            let distance = direction.norm();
            distance <= radius
                || angle(&boresight, &direction) < half_angle + libm::asin(radius / distance)
        })
    }

    /// The pose of the target, if it is in sight.
    fn pose(&self, camera: &RelativePose) -> Option<Truth> {
        let target = &self.states[camera.target];
        let (from, axes) = (self.position(), self.attitude());
        let position = axes.tr_mul(&(target.position - from));
        let distance = position.norm();
        let [nearest, farthest] = camera.range;
        let sees = (nearest..=farthest).contains(&distance)
            && angle(&Vector3::z(), &position) <= camera.field_of_view
            && !self.is_hidden(camera.target, &from);
        sees.then(|| Truth::Pose {
            position,
            attitude: axes.tr_mul(&target.attitude),
        })
    }

    /// Whether something with a radius is between a point and the center of a body.
    fn is_hidden(&self, target: usize, from: &Vector3<f64>) -> bool {
        let others = self.bodies.iter().zip(self.states).enumerate();
        let others = others
            .filter(|(index, _)| *index != target && *index != self.sensor.body)
            .map(|(_, (body, state))| (state.position, body.radius()));
        let attractor = self.scene.gravity.central.iter();
        let attractor = attractor.map(|attractor| (attractor.position, attractor.radius));
        let to = &self.states[target].position;
        others.chain(attractor).any(|(center, radius)| {
            radius > 0.0 && distance(&center, from, to) < (1.0 - ROUNDING) * radius
        })
    }
}

/// How far below a surface, relative to its radius, a point counts as on it.
const ROUNDING: f64 = 1e-9;

/// Between two vectors, in [0, π].
fn angle(one: &Vector3<f64>, other: &Vector3<f64>) -> f64 {
    libm::atan2(one.cross(other).norm(), one.dot(other))
}

/// Of a point from the straight line between two others.
fn distance(point: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> f64 {
    let line = to - from;
    let along = (point - from).dot(&line) / line.norm_squared();
    let nearest = match along {
        along if along >= 1.0 => *to,
        along => from + along.max(0.0) * line,
    };
    (nearest - point).norm()
}
