use std::f64::consts::PI;

use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, Vector3};

use super::sight::Sight;
use super::{BySecond, Coordinates, Region, StateConstraint};
use crate::problem::ParameterError;
use crate::problem::parameter::{angle, direction, point};

/// A point that a body axis must point at to within an angle: `g = (cos α − R a · u)/sin α`, with the direction `u` from the
/// center of mass to the point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineOfSight {
    axis: Vector3<f64>,
    point: Vector3<f64>,
    half_angle: f64,
    cosine: f64,
    sine: f64,
}

impl LineOfSight {
    /// The constraint for the body axis `axis`, of any length but zero, and a `point` (inertial frame) that must be within
    /// the half-angle of it, in `(0, π)` (rad).
    pub fn new(
        axis: Vector3<f64>,
        at: Vector3<f64>,
        half_angle: f64,
    ) -> Result<Self, ParameterError> {
        let half_angle = angle(half_angle, PI, "π")?;
        Ok(Self {
            axis: direction("axis", axis)?,
            point: point("point", at)?,
            half_angle,
            cosine: libm::cos(half_angle),
            sine: libm::sin(half_angle),
        })
    }

    /// The unit vector of the axis in the body frame.
    pub fn axis(&self) -> Vector3<f64> {
        self.axis
    }

    /// The point in the inertial frame.
    pub fn point(&self) -> Vector3<f64> {
        self.point
    }

    /// The half-angle (rad).
    pub fn half_angle(&self) -> f64 {
        self.half_angle
    }
}

impl StateConstraint for LineOfSight {
    fn name(&self) -> &'static str {
        "line_of_sight"
    }

    fn region(&self) -> Option<Region> {
        Some(Region::InSight {
            axis: self.axis,
            point: self.point,
            half_angle: self.half_angle,
        })
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::Pose
    }

    fn value(&self, state: &BodyState) -> f64 {
        (self.cosine - Sight::new(state, &self.axis, &self.point).cosine) / self.sine
    }

    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        let (gradient, hessian) = Sight::new(state, &self.axis, &self.point).by_position();
        (gradient / -self.sine, hessian / -self.sine)
    }

    fn by_second(&self, state: &BodyState) -> Option<BySecond> {
        let cosine = Sight::new(state, &self.axis, &self.point).by_attitude();
        Some(BySecond {
            gradient: cosine.gradient / -self.sine,
            hessian: cosine.hessian / -self.sine,
            mixed: cosine.mixed / -self.sine,
        })
    }

    fn size(&self) -> f64 {
        1.0
    }

    /// The angle by which the point is out of sight (rad).
    fn excess(&self, g: f64) -> f64 {
        let cosine = (self.cosine - self.sine * g).clamp(-1.0, 1.0);
        libm::acos(cosine) - self.half_angle
    }
}
