use lgvi_dynamics::BodyState;
use lgvi_lie::{log, log_curvature, right_jacobian_inverse};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::error::{finite, rotation, unit};
use super::{Direction, RotationTarget, TerminalError};
use crate::newton::Ending;

/// Terminal conditions on `[ζ, δΠ]`: three rows of attitude, three of momentum.
#[derive(Clone, Debug)]
pub(crate) struct RotationSet {
    attitude: AttitudeSet,
    /// `Π_d`
    momentum: Option<Vector3<f64>>,
}

#[derive(Clone, Debug)]
enum AttitudeSet {
    /// `log(R_dᵀ R)`
    Attitude(Matrix3<f64>),
    Direction(Direction),
    Free,
}

impl RotationSet {
    /// The conditions of `target`.
    pub(super) fn new(target: &RotationTarget) -> Result<Self, TerminalError> {
        let momentum = |value| finite("angular momentum", value).map(Some);
        Ok(match target {
            RotationTarget::State {
                attitude,
                angular_momentum,
            } => Self {
                attitude: AttitudeSet::Attitude(rotation(attitude)?),
                momentum: momentum(angular_momentum)?,
            },
            RotationTarget::Attitude { attitude } => Self {
                attitude: AttitudeSet::Attitude(rotation(attitude)?),
                momentum: None,
            },
            RotationTarget::SpinAxis {
                axis,
                direction,
                angular_momentum,
            } => Self {
                attitude: AttitudeSet::Direction(Direction::new(
                    unit("axis", axis)?,
                    unit("direction", direction)?,
                )),
                momentum: momentum(angular_momentum)?,
            },
            RotationTarget::Free => Self::FREE,
        })
    }

    /// Without conditions.
    pub(crate) const FREE: Self = Self {
        attitude: AttitudeSet::Free,
        momentum: None,
    };

    /// Whether the attitude at the end is one rotation.
    pub(crate) fn fixes_attitude(&self) -> bool {
        matches!(self.attitude, AttitudeSet::Attitude(_))
    }
}

impl Ending<6> for RotationSet {
    fn residual(&self, state: &BodyState) -> SVector<f64, 6> {
        let mut c = SVector::<f64, 6>::zeros();
        match &self.attitude {
            AttitudeSet::Attitude(attitude) => {
                c.fixed_rows_mut::<3>(0)
                    .copy_from(&log(&attitude.tr_mul(&state.attitude)));
            }
            AttitudeSet::Direction(direction) => {
                c.fixed_rows_mut::<2>(0)
                    .copy_from(&direction.residual(&state.attitude));
            }
            AttitudeSet::Free => {}
        }
        if let Some(momentum) = self.momentum {
            c.fixed_rows_mut::<3>(3)
                .copy_from(&(state.angular_momentum - momentum));
        }
        c
    }

    fn jacobian(&self, state: &BodyState) -> SMatrix<f64, 6, 6> {
        let mut jacobian = SMatrix::<f64, 6, 6>::zeros();
        match &self.attitude {
            AttitudeSet::Attitude(attitude) => {
                let e = log(&attitude.tr_mul(&state.attitude));
                jacobian
                    .fixed_view_mut::<3, 3>(0, 0)
                    .copy_from(&right_jacobian_inverse(&e));
            }
            AttitudeSet::Direction(direction) => {
                jacobian
                    .fixed_view_mut::<2, 3>(0, 0)
                    .copy_from(&direction.jacobian(&state.attitude));
            }
            AttitudeSet::Free => {}
        }
        if self.momentum.is_some() {
            jacobian.fixed_view_mut::<3, 3>(3, 3).fill_with_identity();
        }
        jacobian
    }

    fn curvature(&self, state: &BodyState, nu: &SVector<f64, 6>) -> SMatrix<f64, 6, 6> {
        let mut curvature = SMatrix::<f64, 6, 6>::zeros();
        let attitude = match &self.attitude {
            AttitudeSet::Attitude(attitude) => {
                let e = log(&attitude.tr_mul(&state.attitude));
                log_curvature(&e, &nu.fixed_rows::<3>(0).into_owned())
            }
            AttitudeSet::Direction(direction) => {
                direction.curvature(&state.attitude, &nu.fixed_rows::<2>(0).into_owned())
            }
            AttitudeSet::Free => Matrix3::zeros(),
        };
        curvature.fixed_view_mut::<3, 3>(0, 0).copy_from(&attitude);
        curvature
    }
}
