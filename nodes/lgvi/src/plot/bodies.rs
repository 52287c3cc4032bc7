//! A body as it is drawn: its points of mass and the bars between them, or its axes.

use lgvi_dynamics::RigidBody;
use nalgebra::Vector3;

use super::data::Pose;

/// What is drawn of a body, body frame (m).
pub(super) struct Shape {
    /// Points of mass, with their share of the mass; none where gravity acts at the center alone.
    points: Vec<(Vector3<f64>, f64)>,
}

impl Shape {
    /// `length` is the scene's unit (m).
    pub(super) fn of(body: &RigidBody, length: f64) -> Self {
        let points = body.points().iter();
        let points: Vec<_> = points
            .map(|point| (point.position * length, point.mass / body.mass()))
            .collect();
        let extended = points
            .iter()
            .any(|(position, _)| *position != Vector3::zeros());
        Self {
            points: if extended { points } else { Vec::new() },
        }
    }

    /// Whether its points of mass can be shown.
    pub(super) fn has_points(&self) -> bool {
        !self.points.is_empty()
    }

    /// Farthest point from the center of mass (m).
    pub(super) fn reach(&self) -> f64 {
        self.points
            .iter()
            .map(|(position, _)| position.norm())
            .fold(0.0, f64::max)
    }

    /// The points of mass in the inertial frame (m), `enlarged` by a factor, with their share of the mass.
    pub(super) fn at(&self, pose: &Pose, enlarged: f64) -> Vec<(Vector3<f64>, f64)> {
        let place = |arm: &Vector3<f64>| pose.position + enlarged * (pose.attitude * arm);
        self.points
            .iter()
            .map(|(arm, share)| (place(arm), *share))
            .collect()
    }
}
