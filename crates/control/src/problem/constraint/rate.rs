use lgvi_dynamics::{BodyState, Inertia};
use nalgebra::{Matrix3, Vector3};

use super::{Coordinates, Region, StateConstraint};
use crate::problem::ParameterError;
use crate::problem::parameter::{direction, length};

/// A limit on the angular velocity `Ω = J⁻¹ Π`: `g = ½ (|Ω|²/limit² − 1)`, or with `a · Ω` in the place of `|Ω|`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngularRate {
    limit: f64,
    axis: Option<Vector3<f64>>,
    inverse: Matrix3<f64>,
}

impl AngularRate {
    /// `|Ω| ≤ limit` for a body with this inertia; the limit is positive.
    pub fn new(limit: f64, inertia: &Inertia) -> Result<Self, ParameterError> {
        Ok(Self {
            limit: length("limit", limit)?,
            axis: None,
            inverse: *inertia.inverse(),
        })
    }

    /// The limit on the rate about one axis only, `|a · Ω| ≤ limit`, in the body frame and of any length but zero.
    pub fn about(self, axis: Vector3<f64>) -> Result<Self, ParameterError> {
        Ok(Self {
            axis: Some(direction("axis", axis)?),
            ..self
        })
    }

    /// The limit.
    pub fn limit(&self) -> f64 {
        self.limit
    }

    /// The unit vector of the axis in the body frame, if the limit is about one.
    pub fn axis(&self) -> Option<Vector3<f64>> {
        self.axis
    }

    /// The matrix `M` of `g = ½ (|M Π|² − 1)`.
    fn matrix(&self) -> Matrix3<f64> {
        let matrix = self.inverse / self.limit;
        self.axis
            .map_or(matrix, |axis| axis * axis.transpose() * matrix)
    }
}

impl StateConstraint for AngularRate {
    fn name(&self) -> &'static str {
        "angular_rate"
    }

    fn region(&self) -> Option<Region> {
        Some(Region::AngularRate {
            axis: self.axis,
            limit: self.limit,
        })
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::AngularMomentum
    }

    fn value(&self, state: &BodyState) -> f64 {
        0.5 * ((self.matrix() * state.angular_momentum).norm_squared() - 1.0)
    }

    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        let matrix = self.matrix();
        let hessian = matrix.tr_mul(&matrix);
        (hessian * state.angular_momentum, hessian)
    }

    fn size(&self) -> f64 {
        self.matrix().norm().recip()
    }

    /// The rate beyond the limit, in parts of it.
    fn excess(&self, g: f64) -> f64 {
        (1.0 + 2.0 * g).max(0.0).sqrt() - 1.0
    }
}
