//! Derivatives by an angular momentum that the body stores.

use nalgebra::Matrix3;

use crate::problem::FEW;

/// The least number of commands with which the first of two groups may have a stored momentum. With fewer this
/// is not checked at run time.
pub(crate) const SPINNING: usize = FEW + 1;

/// First derivatives of the rotation of a drift by the momentum of the first group, if that is stored in the body.
#[derive(Clone, Debug)]
pub(crate) struct StoredTurn {
    /// Of the pose.
    pub(crate) pose: Matrix3<f64>,
    /// Of the momentum.
    pub(crate) momentum: Matrix3<f64>,
}

/// Second derivatives of the rotation of a drift by a stored momentum.
#[derive(Clone, Debug)]
pub(crate) struct StoredCurvature {
    /// By the pose of the last group (rows) and the stored momentum.
    pub(crate) pose: Matrix3<f64>,
    /// By the momentum of the last group (rows) and the stored momentum.
    pub(crate) momentum: Matrix3<f64>,
    /// By the stored momentum twice, symmetric.
    pub(crate) stored: Matrix3<f64>,
}
