use std::f64::consts::PI;

use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, Vector3};

use super::{Coordinates, Region, StateConstraint};
use crate::problem::ParameterError;
use crate::problem::parameter::{angle, direction};
use crate::problem::pointing::Pointing;

/// A cone that a body axis must stay out of: `g = (d · R a − cos α)/sin α`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeepOutCone {
    axis: Vector3<f64>,
    direction: Vector3<f64>,
    half_angle: f64,
    cosine: f64,
    sine: f64,
}

impl KeepOutCone {
    /// A constraint for the body axis `axis` and the cone about the inertial direction `along`, with a half-angle in
    /// `(0, π)` (rad). Both vectors may have any length but zero.
    pub fn new(
        axis: Vector3<f64>,
        along: Vector3<f64>,
        half_angle: f64,
    ) -> Result<Self, ParameterError> {
        let half_angle = angle(half_angle, PI, "π")?;
        Ok(Self {
            axis: direction("axis", axis)?,
            direction: direction("direction", along)?,
            half_angle,
            cosine: libm::cos(half_angle),
            sine: libm::sin(half_angle),
        })
    }

    /// The unit vector of the axis in the body frame.
    pub fn axis(&self) -> Vector3<f64> {
        self.axis
    }

    /// The unit vector of the direction in the inertial frame.
    pub fn direction(&self) -> Vector3<f64> {
        self.direction
    }

    /// The half-angle of the cone (rad).
    pub fn half_angle(&self) -> f64 {
        self.half_angle
    }
}

impl StateConstraint for KeepOutCone {
    fn name(&self) -> &'static str {
        "keep_out_cone"
    }

    fn region(&self) -> Option<Region> {
        Some(Region::OutsideCone {
            axis: self.axis,
            direction: self.direction,
            half_angle: self.half_angle,
        })
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::Attitude
    }

    fn value(&self, state: &BodyState) -> f64 {
        ((state.attitude * self.axis).dot(&self.direction) - self.cosine) / self.sine
    }

    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        let pointing = Pointing::new(&state.attitude, &self.axis, &self.direction);
        (pointing.gradient / self.sine, pointing.hessian / self.sine)
    }

    fn size(&self) -> f64 {
        1.0
    }

    /// The angle by which the axis is inside the cone (rad).
    fn excess(&self, g: f64) -> f64 {
        let cosine = (self.cosine + self.sine * g).clamp(-1.0, 1.0);
        libm::atan2(self.sine, self.cosine) - libm::acos(cosine)
    }
}
