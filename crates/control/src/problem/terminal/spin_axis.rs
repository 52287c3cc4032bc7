use lgvi_dynamics::BodyState;
use lgvi_lie::exp;
use nalgebra::{SMatrix, SVector, Vector3};

use super::direction::Direction;
use super::{Row, TerminalCondition};
use crate::problem::parameter::{direction, point};
use crate::problem::{ParameterError, Place};

/// Any attitude that aligns a body axis with a direction, and one angular momentum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpinAxis {
    direction: Direction,
    angular_momentum: Vector3<f64>,
}

impl SpinAxis {
    /// The condition that aligns the body axis `axis` with the inertial direction `along`, with the momentum `Π_d`
    /// (body frame). Both vectors may have any length but zero.
    pub fn new(
        axis: Vector3<f64>,
        along: Vector3<f64>,
        angular_momentum: Vector3<f64>,
    ) -> Result<Self, ParameterError> {
        let axis = direction("axis", axis)?;
        Ok(Self {
            direction: Direction::new(axis, direction("direction", along)?),
            angular_momentum: point("angular_momentum", angular_momentum)?,
        })
    }

    /// The unit vector of the axis in the body frame.
    pub fn axis(&self) -> Vector3<f64> {
        self.direction.axis
    }

    /// The unit vector of the direction in the inertial frame.
    pub fn direction(&self) -> Vector3<f64> {
        self.direction.direction
    }

    /// `Π_d`
    pub fn angular_momentum(&self) -> Vector3<f64> {
        self.angular_momentum
    }
}

impl TerminalCondition for SpinAxis {
    fn name(&self) -> &'static str {
        "a spin axis"
    }

    fn place(&self) -> Place {
        Place::Attitude
    }

    fn rows(&self) -> [Row; 6] {
        use Row::{Momentum, None, Number};
        [Number, Number, None, Momentum, Momentum, Momentum]
    }

    fn residual(&self, end: &BodyState) -> SVector<f64, 6> {
        let mut c = SVector::<f64, 6>::zeros();
        c.fixed_rows_mut::<2>(0)
            .copy_from(&self.direction.residual(&end.attitude));
        c.fixed_rows_mut::<3>(3)
            .copy_from(&(end.angular_momentum - self.angular_momentum));
        c
    }

    fn jacobian(&self, end: &BodyState) -> SMatrix<f64, 6, 6> {
        let mut jacobian = SMatrix::<f64, 6, 6>::zeros();
        jacobian
            .fixed_view_mut::<2, 3>(0, 0)
            .copy_from(&self.direction.jacobian(&end.attitude));
        jacobian.fixed_view_mut::<3, 3>(3, 3).fill_with_identity();
        jacobian
    }

    fn curvature(&self, end: &BodyState, nu: &SVector<f64, 6>) -> SMatrix<f64, 6, 6> {
        let nu = nu.fixed_rows::<2>(0).into_owned();
        let mut curvature = SMatrix::<f64, 6, 6>::zeros();
        curvature
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&self.direction.curvature(&end.attitude, &nu));
        curvature
    }

    /// Turns the axis by the shortest way.
    fn aim(&self, state: &mut BodyState) -> [bool; 2] {
        let pointing = state.attitude * self.axis();
        state.attitude = exp(&between(&pointing, &self.direction())) * state.attitude;
        state.angular_momentum = self.angular_momentum;
        [true; 2]
    }

    /// The smallest rotation that aligns the axis, and the difference of the momenta.
    fn miss(&self, end: &BodyState) -> SVector<f64, 6> {
        let wanted = end.attitude.tr_mul(&self.direction());
        let (sine, cosine) = (wanted.cross(&self.axis()), wanted.dot(&self.axis()));
        let angle = libm::atan2(sine.norm(), cosine);
        let turn = sine.try_normalize(0.0).unwrap_or_else(Vector3::x) * angle;
        let momentum = end.angular_momentum - self.angular_momentum;
        SVector::from_fn(|row, _| {
            if row < 3 {
                turn[row]
            } else {
                momentum[row - 3]
            }
        })
    }
}

/// The rotation vector of the shortest rotation from one direction to another.
fn between(from: &Vector3<f64>, to: &Vector3<f64>) -> Vector3<f64> {
    let cross = from.cross(to);
    let (sine, cosine) = (cross.norm(), from.dot(to));
    if sine > 0.0 {
        return cross * (libm::atan2(sine, cosine) / sine);
    }
    if cosine > 0.0 {
        return Vector3::zeros();
    }
    // Half a turn about any perpendicular axis.
    let least = Vector3::ith(from.iamin(), 1.0);
    from.cross(&least).normalize() * std::f64::consts::PI
}
