use nalgebra::{Matrix3x6, SMatrix, SVector};

/// An inequality on the commands of an interval, quadratic or linear: `½ wᵀ Q w + a · w ≤ b`.
#[derive(Clone, Debug)]
pub(crate) struct CommandInequality {
    /// Which constraint it belongs to, from 0.
    pub(crate) constraint: usize,
    /// `Q`
    hessian: SMatrix<f64, 6, 6>,
    /// `a`
    linear: SVector<f64, 6>,
    /// `b`
    bound: f64,
}

impl CommandInequality {
    /// `a · w ≤ 1`.
    pub(super) fn linear(constraint: usize, linear: SVector<f64, 6>) -> Self {
        Self {
            constraint,
            hessian: SMatrix::zeros(),
            linear,
            bound: 1.0,
        }
    }

    /// `|M w| ≤ limit`, as `½ |M w|²/limit² ≤ ½`.
    pub(super) fn norm(constraint: usize, matrix: &Matrix3x6<f64>, limit: f64) -> Self {
        let scaled = matrix / limit;
        Self {
            constraint,
            hessian: scaled.tr_mul(&scaled),
            linear: SVector::zeros(),
            bound: 0.5,
        }
    }

    /// `g(w)`.
    pub(crate) fn value(&self, command: &SVector<f64, 6>) -> f64 {
        (0.5 * (self.hessian * command) + self.linear).dot(command) - self.bound
    }

    /// `∂g/∂w`.
    pub(crate) fn gradient(&self, command: &SVector<f64, 6>) -> SVector<f64, 6> {
        self.hessian * command + self.linear
    }

    /// `∂²g/∂w²`, the same everywhere.
    pub(crate) fn hessian(&self) -> &SMatrix<f64, 6, 6> {
        &self.hessian
    }
}
