use lgvi_dynamics::BodyState;
use nalgebra::{SMatrix, SVector, Vector3};

use super::error::finite;
use super::{KeplerOrbit, TerminalError, TranslationTarget};
use crate::newton::Ending;

/// Terminal conditions on `[δx, δγ]`.
#[derive(Clone, Debug)]
pub(crate) enum TranslationSet {
    State {
        position: Vector3<f64>,
        linear_momentum: Vector3<f64>,
    },
    Position(Vector3<f64>),
    Orbit(KeplerOrbit),
    Free,
}

impl TranslationSet {
    /// The conditions of `target` on a body of `mass`.
    pub(super) fn new(target: &TranslationTarget, mass: f64) -> Result<Self, TerminalError> {
        Ok(match target {
            TranslationTarget::State {
                position,
                linear_momentum,
            } => Self::State {
                position: finite("position", position)?,
                linear_momentum: finite("linear momentum", linear_momentum)?,
            },
            TranslationTarget::Position { position } => {
                Self::Position(finite("position", position)?)
            }
            TranslationTarget::Orbit {
                gm,
                center,
                position,
                linear_momentum,
            } => {
                let arm = finite("position", position)? - finite("center", center)?;
                let velocity = finite("linear momentum", linear_momentum)? / mass;
                Self::Orbit(KeplerOrbit::new(*gm, *center, mass, &arm, &velocity)?)
            }
            TranslationTarget::Free => Self::Free,
        })
    }

    /// Whether the position at the end is one point.
    pub(crate) fn fixes_position(&self) -> bool {
        matches!(self, Self::State { .. } | Self::Position(_))
    }
}

impl Ending<6> for TranslationSet {
    fn residual(&self, state: &BodyState) -> SVector<f64, 6> {
        let mut c = SVector::<f64, 6>::zeros();
        match self {
            Self::State {
                position,
                linear_momentum,
            } => {
                c.fixed_rows_mut::<3>(0)
                    .copy_from(&(state.position - position));
                c.fixed_rows_mut::<3>(3)
                    .copy_from(&(state.linear_momentum - linear_momentum));
            }
            Self::Position(position) => {
                c.fixed_rows_mut::<3>(0)
                    .copy_from(&(state.position - position));
            }
            Self::Orbit(orbit) => {
                c.fixed_rows_mut::<5>(0).copy_from(&orbit.residual(state));
            }
            Self::Free => {}
        }
        c
    }

    fn jacobian(&self, state: &BodyState) -> SMatrix<f64, 6, 6> {
        let mut jacobian = SMatrix::<f64, 6, 6>::zeros();
        match self {
            Self::State { .. } => jacobian.fill_with_identity(),
            Self::Position(_) => jacobian.fixed_view_mut::<3, 3>(0, 0).fill_with_identity(),
            Self::Orbit(orbit) => {
                jacobian
                    .fixed_rows_mut::<5>(0)
                    .copy_from(&orbit.jacobian(state));
            }
            Self::Free => {}
        }
        jacobian
    }

    fn curvature(&self, state: &BodyState, nu: &SVector<f64, 6>) -> SMatrix<f64, 6, 6> {
        match self {
            Self::Orbit(orbit) => orbit.curvature(state, &nu.fixed_rows::<5>(0).into_owned()),
            _ => SMatrix::zeros(),
        }
    }
}
