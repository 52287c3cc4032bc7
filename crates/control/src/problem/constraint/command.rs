use nalgebra::{Matrix3x6, SMatrix, SVector};

/// An inequality on the commands of an interval, quadratic or linear: `½ wᵀ Q w + a · w ≤ b`.
#[derive(Clone, Debug)]
pub(crate) struct CommandInequality<const U: usize = 6> {
    /// Which constraint it belongs to, from 0.
    pub(crate) constraint: usize,
    /// `Q`
    hessian: SMatrix<f64, U, U>,
    /// `a`
    linear: SVector<f64, U>,
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

    /// The same with `slack` of room, `g ≤ slack`.
    pub(super) fn relaxed(&self, slack: f64) -> Self {
        Self {
            bound: self.bound + slack,
            ..self.clone()
        }
    }

    /// The same of the commands that `selection` (6×U) makes of others, `w = E v`.
    pub(crate) fn of<const V: usize>(
        &self,
        selection: &SMatrix<f64, 6, V>,
    ) -> CommandInequality<V> {
        CommandInequality {
            constraint: self.constraint,
            hessian: selection.tr_mul(&(self.hessian * selection)),
            linear: selection.tr_mul(&self.linear),
            bound: self.bound,
        }
    }
}

impl<const U: usize> CommandInequality<U> {
    /// `g(w)`.
    pub(crate) fn value(&self, command: &SVector<f64, U>) -> f64 {
        (0.5 * (self.hessian * command) + self.linear).dot(command) - self.bound
    }

    /// By what part of the limit a command exceeds it where the inequality has the value `g`.
    pub(crate) fn excess(&self, g: f64) -> f64 {
        let reached = g + self.bound;
        if self.hessian.amax() == 0.0 {
            reached - 1.0
        } else {
            (2.0 * reached).max(0.0).sqrt() - 1.0
        }
    }

    /// `∂g/∂w`.
    pub(crate) fn gradient(&self, command: &SVector<f64, U>) -> SVector<f64, U> {
        self.hessian * command + self.linear
    }

    /// `∂²g/∂w²`, the same everywhere.
    pub(crate) fn hessian(&self) -> &SMatrix<f64, U, U> {
        &self.hessian
    }
}
