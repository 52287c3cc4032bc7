use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, Vector3};

use super::{Coordinates, Region, StateConstraint};
use crate::problem::ParameterError;
use crate::problem::parameter::{length, point};

/// A sphere that the center of mass must stay out of: `g = ½ (1 − |x − c|²/r²)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeepOutSphere {
    center: Vector3<f64>,
    radius: f64,
}

impl KeepOutSphere {
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

impl StateConstraint for KeepOutSphere {
    fn name(&self) -> &'static str {
        "keep_out_sphere"
    }

    fn region(&self) -> Option<Region> {
        Some(Region::OutsideEllipsoid {
            center: self.center,
            semi_axes: Vector3::repeat(self.radius),
            axes: Matrix3::identity(),
        })
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::Position
    }

    fn value(&self, state: &BodyState) -> f64 {
        0.5 * (1.0 - ((state.position - self.center) / self.radius).norm_squared())
    }

    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        let scale = -1.0 / (self.radius * self.radius);
        (
            scale * (state.position - self.center),
            Matrix3::from_diagonal_element(scale),
        )
    }

    fn size(&self) -> f64 {
        self.radius
    }

    /// The depth inside the sphere, in parts of the radius.
    fn excess(&self, g: f64) -> f64 {
        1.0 - (1.0 - 2.0 * g).max(0.0).sqrt()
    }
}
