use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, Vector3};

use super::{Coordinates, Region, StateConstraint};
use crate::problem::ParameterError;
use crate::problem::parameter::{angle, direction, point};

/// A cone that the center of mass must stay in: `g = (cos α (r − ε) − n · ρ)/L` with `ρ = x − apex`, `r = √(|ρ|² +
/// ε²)`. `g` is convex, and smooth at the apex.
///
/// `L` is the distance of start or target from the apex, whichever is farther, or 1 if both are at the apex. The apex
/// is rounded off by `ε = 1e-12 L`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corridor {
    apex: Vector3<f64>,
    axis: Vector3<f64>,
    half_angle: f64,
    cosine: f64,
    length: f64,
}

/// `ε/L`
const ROUNDING: f64 = 1e-12;
/// The least distance from the apex used to scale `g`, in parts of `L`.
const NEAREST: f64 = 1e-4;

impl Corridor {
    /// The cone from `apex` along `axis` (inertial frame, of any length but zero), with a half-angle in `(0, π/2)`
    /// (rad).
    pub fn new(
        apex: Vector3<f64>,
        axis: Vector3<f64>,
        half_angle: f64,
    ) -> Result<Self, ParameterError> {
        let half_angle = angle(half_angle, FRAC_PI_2, "π/2")?;
        Ok(Self {
            apex: point("apex", apex)?,
            axis: direction("axis", axis)?,
            half_angle,
            cosine: libm::cos(half_angle),
            length: 1.0,
        })
    }

    /// The apex, in the inertial frame.
    pub fn apex(&self) -> Vector3<f64> {
        self.apex
    }

    /// The unit vector from the apex into the cone, in the inertial frame.
    pub fn axis(&self) -> Vector3<f64> {
        self.axis
    }

    /// The half-angle of the cone (rad).
    pub fn half_angle(&self) -> f64 {
        self.half_angle
    }

    /// `ρ/L` and `r/L`.
    fn arm(&self, state: &BodyState) -> (Vector3<f64>, f64) {
        let rho = (state.position - self.apex) / self.length;
        (rho, (rho.norm_squared() + ROUNDING * ROUNDING).sqrt())
    }
}

impl StateConstraint for Corridor {
    fn name(&self) -> &'static str {
        "corridor"
    }

    fn region(&self) -> Option<Region> {
        Some(Region::Corridor {
            apex: self.apex,
            axis: self.axis,
            half_angle: self.half_angle,
        })
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::Position
    }

    fn value(&self, state: &BodyState) -> f64 {
        let (rho, r) = self.arm(state);
        self.cosine * (r - ROUNDING) - self.axis.dot(&rho)
    }

    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        let (rho, r) = self.arm(state);
        let unit = rho / r;
        let across = Matrix3::identity() - unit * unit.transpose();
        (
            (self.cosine * unit - self.axis) / self.length,
            across * (self.cosine / (r * self.length * self.length)),
        )
    }

    fn size(&self) -> f64 {
        self.length
    }

    /// A factor that makes `g` relative to the distance from the apex.
    fn scale(&self, state: &BodyState) -> f64 {
        1.0 / ((state.position - self.apex).norm() / self.length).clamp(NEAREST, 1.0)
    }

    fn between(
        &self,
        start: &Vector3<f64>,
        end: Option<&Vector3<f64>>,
    ) -> Option<Arc<dyn StateConstraint>> {
        let from_start = (start - self.apex).norm();
        let length = end.map_or(from_start, |end| from_start.max((end - self.apex).norm()));
        let length = if length > 0.0 { length } else { 1.0 };
        Some(Arc::new(Self { length, ..*self }))
    }
}
