use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, Vector3};

use super::{Coordinates, Region, StateConstraint};
use crate::problem::ParameterError;
use crate::problem::parameter::{length, point, rotation};

/// An ellipsoid that the center of mass must stay out of: `g = ½ (1 − |D⁻¹ Qᵀ (x − c)|²)`, where `D` holds the semi-axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeepOutEllipsoid {
    center: Vector3<f64>,
    semi_axes: Vector3<f64>,
    rotation: Matrix3<f64>,
}

impl KeepOutEllipsoid {
    /// The ellipsoid with positive semi-axes along the columns of `axes`, a rotation matrix to the inertial frame, about
    /// `center` (inertial frame).
    pub fn new(
        center: Vector3<f64>,
        semi_axes: Vector3<f64>,
        axes: Matrix3<f64>,
    ) -> Result<Self, ParameterError> {
        for semi_axis in &semi_axes {
            length("semi_axes", *semi_axis)?;
        }
        Ok(Self {
            center: point("center", center)?,
            semi_axes,
            rotation: rotation("attitude", axes)?,
        })
    }

    /// The center in the inertial frame.
    pub fn center(&self) -> Vector3<f64> {
        self.center
    }

    /// The semi-axes.
    pub fn semi_axes(&self) -> Vector3<f64> {
        self.semi_axes
    }

    /// The rotation matrix from the axes of the ellipsoid to the inertial frame.
    pub fn rotation(&self) -> Matrix3<f64> {
        self.rotation
    }

    /// `D⁻¹ Qᵀ (x − c)`, which is on the unit sphere on the ellipsoid.
    fn arm(&self, state: &BodyState) -> Vector3<f64> {
        let arm = self.rotation.tr_mul(&(state.position - self.center));
        arm.component_div(&self.semi_axes)
    }
}

impl StateConstraint for KeepOutEllipsoid {
    fn name(&self) -> &'static str {
        "keep_out_ellipsoid"
    }

    fn region(&self) -> Option<Region> {
        Some(Region::OutsideEllipsoid {
            center: self.center,
            semi_axes: self.semi_axes,
            axes: self.rotation,
        })
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::Position
    }

    fn value(&self, state: &BodyState) -> f64 {
        0.5 * (1.0 - self.arm(state).norm_squared())
    }

    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        let gradient = self.arm(state).component_div(&self.semi_axes);
        let squares = self.semi_axes.component_mul(&self.semi_axes);
        let inner = Matrix3::from_diagonal(&squares.map(|square| -1.0 / square));
        (
            -(self.rotation * gradient),
            self.rotation * inner * self.rotation.transpose(),
        )
    }

    fn size(&self) -> f64 {
        self.semi_axes.min()
    }

    /// The depth along the ray from the center, in parts of the distance from it to the surface.
    fn excess(&self, g: f64) -> f64 {
        1.0 - (1.0 - 2.0 * g).max(0.0).sqrt()
    }
}
