use lgvi_dynamics::BodyState;
use lgvi_lie::{log, log_curvature, right_jacobian_inverse};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::{Row, TerminalCondition};
use crate::problem::parameter::{point, rotation};
use crate::problem::{ParameterError, Place};

/// A final attitude, optionally with a final momentum: `[log(R_dᵀ R), Π − Π_d]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FinalAttitude {
    attitude: Matrix3<f64>,
    angular_momentum: Option<Vector3<f64>>,
}

impl FinalAttitude {
    /// The condition with the rotation `R_d` and the momentum `Π_d` (body frame), or any momentum if `None`.
    pub fn new(
        attitude: Matrix3<f64>,
        angular_momentum: Option<Vector3<f64>>,
    ) -> Result<Self, ParameterError> {
        let momentum = |value| point("angular_momentum", value);
        Ok(Self {
            attitude: rotation("attitude", attitude)?,
            angular_momentum: angular_momentum.map(momentum).transpose()?,
        })
    }

    /// `R_d`
    pub fn attitude(&self) -> Matrix3<f64> {
        self.attitude
    }

    /// `Π_d`
    pub fn angular_momentum(&self) -> Option<Vector3<f64>> {
        self.angular_momentum
    }

    /// `log(R_dᵀ R)`
    fn error(&self, end: &BodyState) -> Vector3<f64> {
        log(&self.attitude.tr_mul(&end.attitude))
    }
}

impl TerminalCondition for FinalAttitude {
    fn name(&self) -> &'static str {
        match self.angular_momentum {
            Some(_) => "an attitude and angular velocity",
            None => "an attitude",
        }
    }

    fn place(&self) -> Place {
        Place::Attitude
    }

    fn rows(&self) -> [Row; 6] {
        let momentum = self.angular_momentum.map_or(Row::None, |_| Row::Momentum);
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
        c.fixed_rows_mut::<3>(0).copy_from(&self.error(end));
        if let Some(momentum) = self.angular_momentum {
            c.fixed_rows_mut::<3>(3)
                .copy_from(&(end.angular_momentum - momentum));
        }
        c
    }

    fn jacobian(&self, end: &BodyState) -> SMatrix<f64, 6, 6> {
        let mut jacobian = SMatrix::<f64, 6, 6>::zeros();
        jacobian
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&right_jacobian_inverse(&self.error(end)));
        if self.angular_momentum.is_some() {
            jacobian.fixed_view_mut::<3, 3>(3, 3).fill_with_identity();
        }
        jacobian
    }

    fn curvature(&self, end: &BodyState, nu: &SVector<f64, 6>) -> SMatrix<f64, 6, 6> {
        let nu = nu.fixed_rows::<3>(0).into_owned();
        let mut curvature = SMatrix::<f64, 6, 6>::zeros();
        curvature
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&log_curvature(&self.error(end), &nu));
        curvature
    }

    fn aim(&self, state: &mut BodyState) -> [bool; 2] {
        state.attitude = self.attitude;
        if let Some(momentum) = self.angular_momentum {
            state.angular_momentum = momentum;
        }
        [true, self.angular_momentum.is_some()]
    }
}
