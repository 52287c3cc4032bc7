use lgvi_dynamics::BodyState;
use nalgebra::{SMatrix, SVector, Vector3};

use super::{Row, TerminalCondition};
use crate::problem::parameter::point;
use crate::problem::{ParameterError, Place};

/// A final position, optionally with a final momentum: `[x − x_d, γ − γ_d]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FinalPosition {
    position: Vector3<f64>,
    linear_momentum: Option<Vector3<f64>>,
}

impl FinalPosition {
    /// The condition with `x_d` and `γ_d`, both finite and in the inertial frame; any momentum if `linear_momentum` is
    /// `None`.
    pub fn new(
        position: Vector3<f64>,
        linear_momentum: Option<Vector3<f64>>,
    ) -> Result<Self, ParameterError> {
        let momentum = |value| point("linear_momentum", value);
        Ok(Self {
            position: point("position", position)?,
            linear_momentum: linear_momentum.map(momentum).transpose()?,
        })
    }

    /// `x_d`
    pub fn position(&self) -> Vector3<f64> {
        self.position
    }

    /// `γ_d`
    pub fn linear_momentum(&self) -> Option<Vector3<f64>> {
        self.linear_momentum
    }
}

impl TerminalCondition for FinalPosition {
    fn name(&self) -> &'static str {
        match self.linear_momentum {
            Some(_) => "a position and velocity",
            None => "a position",
        }
    }

    fn place(&self) -> Place {
        Place::Position
    }

    fn rows(&self) -> [Row; 6] {
        let momentum = self.linear_momentum.map_or(Row::None, |_| Row::Momentum);
        [
            Row::Pose,
            Row::Pose,
            Row::Pose,
            momentum,
            momentum,
            momentum,
        ]
    }

    fn residual(&self, end: &BodyState) -> SVector<f64, 6> {
        let mut c = SVector::<f64, 6>::zeros();
        c.fixed_rows_mut::<3>(0)
            .copy_from(&(end.position - self.position));
        if let Some(momentum) = self.linear_momentum {
            c.fixed_rows_mut::<3>(3)
                .copy_from(&(end.linear_momentum - momentum));
        }
        c
    }

    fn jacobian(&self, _: &BodyState) -> SMatrix<f64, 6, 6> {
        let conditions = if self.linear_momentum.is_some() { 6 } else { 3 };
        SMatrix::from_fn(|i, j| if i == j && i < conditions { 1.0 } else { 0.0 })
    }

    fn curvature(&self, _: &BodyState, _: &SVector<f64, 6>) -> SMatrix<f64, 6, 6> {
        SMatrix::zeros()
    }

    fn aim(&self, state: &mut BodyState) -> [bool; 2] {
        state.position = self.position;
        if let Some(momentum) = self.linear_momentum {
            state.linear_momentum = momentum;
        }
        [true, self.linear_momentum.is_some()]
    }
}
