use std::sync::Arc;

use lgvi_dynamics::BodyState;
use lgvi_lie::hat;
use nalgebra::{Matrix3, Vector3};

use super::{BySecond, Coordinates, FrameMotion, Region, StateConstraint};
use crate::problem::ParameterError;
use crate::problem::parameter::length;

/// A limit on the speed of the center of mass, `v = γ/m`: `g = ½ (|v|²/limit² − 1)`. In a frame that moves, `v` is the velocity as
/// it is seen from there, `γ/m − v_f − ω × (x − x_f)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speed {
    limit: f64,
    mass: f64,
    /// The frame that the speed is relative to, if it is not the inertial one.
    frame: Option<FrameMotion>,
}

impl Speed {
    /// `|v| ≤ limit` for a body of this mass; both are positive.
    pub fn new(limit: f64, mass: f64) -> Result<Self, ParameterError> {
        Ok(Self {
            limit: length("limit", limit)?,
            mass: length("mass", mass)?,
            frame: None,
        })
    }

    /// The limit.
    pub fn limit(&self) -> f64 {
        self.limit
    }

    /// The momentum relative to the frame, in inertial axes.
    fn momentum(&self, state: &BodyState) -> Vector3<f64> {
        let own = state.linear_momentum;
        match &self.frame {
            Some(frame) => own - self.mass * frame.velocity_at(&state.position),
            None => own,
        }
    }
}

impl StateConstraint for Speed {
    fn name(&self) -> &'static str {
        "speed"
    }

    fn region(&self) -> Option<Region> {
        Some(Region::Speed {
            frame: self.frame.unwrap_or(FrameMotion::INERTIAL),
            limit: self.limit,
        })
    }

    fn coordinates(&self) -> Coordinates {
        match self.frame {
            Some(_) => Coordinates::Translation,
            None => Coordinates::LinearMomentum,
        }
    }

    fn value(&self, state: &BodyState) -> f64 {
        0.5 * ((self.momentum(state) / self.size()).norm_squared() - 1.0)
    }

    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        let scale = 1.0 / (self.size() * self.size());
        let momentum = self.momentum(state);
        match &self.frame {
            Some(frame) => {
                let turn = self.mass * hat(&frame.turn);
                (scale * turn * momentum, scale * turn.tr_mul(&turn))
            }
            None => (scale * momentum, Matrix3::from_diagonal_element(scale)),
        }
    }

    fn by_second(&self, state: &BodyState) -> Option<BySecond> {
        let frame = self.frame.as_ref()?;
        let scale = 1.0 / (self.size() * self.size());
        Some(BySecond {
            gradient: scale * self.momentum(state),
            hessian: Matrix3::from_diagonal_element(scale),
            mixed: scale * self.mass * hat(&frame.turn),
        })
    }

    fn relative_to(&self, frame: &FrameMotion) -> Option<Arc<dyn StateConstraint>> {
        let frame = Some(*frame);
        Some(Arc::new(Self { frame, ..*self }))
    }

    fn size(&self) -> f64 {
        self.mass * self.limit
    }

    /// The speed beyond the limit, in parts of it.
    fn excess(&self, g: f64) -> f64 {
        (1.0 + 2.0 * g).max(0.0).sqrt() - 1.0
    }
}
