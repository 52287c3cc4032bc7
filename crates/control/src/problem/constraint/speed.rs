use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, Vector3};

use super::{Coordinates, Region, StateConstraint};
use crate::problem::ParameterError;
use crate::problem::parameter::length;

/// A limit on the speed of the center of mass, `v = γ/m`: `g = ½ (|v|²/limit² − 1)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speed {
    limit: f64,
    mass: f64,
}

impl Speed {
    /// `|v| ≤ limit` for a body of this mass; both are positive.
    pub fn new(limit: f64, mass: f64) -> Result<Self, ParameterError> {
        Ok(Self {
            limit: length("limit", limit)?,
            mass: length("mass", mass)?,
        })
    }

    /// The limit.
    pub fn limit(&self) -> f64 {
        self.limit
    }
}

impl StateConstraint for Speed {
    fn name(&self) -> &'static str {
        "speed"
    }

    fn region(&self) -> Option<Region> {
        Some(Region::Speed { limit: self.limit })
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::LinearMomentum
    }

    fn value(&self, state: &BodyState) -> f64 {
        0.5 * ((state.linear_momentum / self.size()).norm_squared() - 1.0)
    }

    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        let scale = 1.0 / (self.size() * self.size());
        (
            scale * state.linear_momentum,
            Matrix3::from_diagonal_element(scale),
        )
    }

    fn size(&self) -> f64 {
        self.mass * self.limit
    }

    /// The speed beyond the limit, in parts of it.
    fn excess(&self, g: f64) -> f64 {
        (1.0 + 2.0 * g).max(0.0).sqrt() - 1.0
    }
}
