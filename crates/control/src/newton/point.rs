use lgvi_dynamics::BodyState;
use lgvi_lie::right_jacobian_inverse;
use nalgebra::{SMatrix, SVector};

use super::conditions::Ending;
use crate::problem::{block, miss};

/// A state as terminal set.
pub(crate) struct Point(pub(crate) BodyState);

impl Ending<12> for Point {
    fn residual(&self, end: &BodyState) -> SVector<f64, 12> {
        miss(&self.0, end)
    }

    fn jacobian(&self, end: &BodyState) -> SMatrix<f64, 12, 12> {
        let mut jacobian = SMatrix::<f64, 12, 12>::identity();
        jacobian
            .fixed_view_mut::<3, 3>(6, 6)
            .copy_from(&right_jacobian_inverse(&block(&self.residual(end), 2)));
        jacobian
    }

    fn curvature(&self, _: &BodyState, _: &SVector<f64, 12>) -> SMatrix<f64, 12, 12> {
        SMatrix::zeros()
    }
}
