use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, Vector3};

use super::{Coordinates, Region, StateConstraint};
use crate::problem::ParameterError;
use crate::problem::parameter::{length, point};

/// A sphere that the center of mass must stay in, such as a hold point: `g = ½ (|x − c|²/r² − 1)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeepInSphere {
    center: Vector3<f64>,
    radius: f64,
}

impl KeepInSphere {
    /// The sphere with a positive `radius` about `center` (inertial frame).
    pub fn new(center: Vector3<f64>, radius: f64) -> Result<Self, ParameterError> {
        Ok(Self {
            center: point("center", center)?,
            radius: length("radius", radius)?,
        })
    }

    /// The center in the inertial frame.
    pub fn center(&self) -> Vector3<f64> {
        self.center
    }

    /// The radius.
    pub fn radius(&self) -> f64 {
        self.radius
    }
}

impl StateConstraint for KeepInSphere {
    fn name(&self) -> &'static str {
        "keep_in_sphere"
    }

    fn region(&self) -> Option<Region> {
        let Self { center, radius } = *self;
        Some(Region::InsideSphere { center, radius })
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::Position
    }

    fn value(&self, state: &BodyState) -> f64 {
        0.5 * (((state.position - self.center) / self.radius).norm_squared() - 1.0)
    }

    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        let scale = 1.0 / (self.radius * self.radius);
        (
            scale * (state.position - self.center),
            Matrix3::from_diagonal_element(scale),
        )
    }

    fn size(&self) -> f64 {
        self.radius
    }

    /// The distance outside the sphere, in parts of the radius.
    fn excess(&self, g: f64) -> f64 {
        (1.0 + 2.0 * g).max(0.0).sqrt() - 1.0
    }
}
