use lgvi_dynamics::gravity::Field;
use lgvi_dynamics::{BodyState, Load, RigidBody};
use lgvi_lie::log;
use nalgebra::{Matrix3, SVector, Vector3};
use thiserror::Error;

/// Components in the order `[x, γ, R, Π]`, three each.
pub(crate) type Vector12 = SVector<f64, 12>;

/// The discrete optimal control problem (§4.2): between two states in a fixed number of Lie–Euler steps, at the least
/// `Σ (h/2) (uᶠᵀ W_f uᶠ + uᵐᵀ W_m uᵐ)`.
pub struct Transfer<F> {
    pub(crate) body: RigidBody,
    pub(crate) field: F,
    pub(crate) h: f64,
    pub(crate) intervals: usize,
    pub(crate) initial: BodyState,
    pub(crate) target: BodyState,
    pub(crate) force_weight: Matrix3<f64>,
    pub(crate) moment_weight: Matrix3<f64>,
    pub(crate) force_gain: Matrix3<f64>,
    pub(crate) moment_gain: Matrix3<f64>,
}

/// Why a transfer is not a problem.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum TransferError {
    /// The step is not a positive number.
    #[error("the step is {0}, expected a finite number > 0")]
    Step(f64),
    /// There are no steps.
    #[error(
        "the transfer has 0 steps, expected at least 2: one interval cannot reach all twelve coordinates"
    )]
    Steps,
    /// A weight is not symmetric positive definite.
    #[error("the {which} weight is not symmetric positive definite: {rows:?}")]
    Weight {
        /// Which weight.
        which: &'static str,
        /// Its rows.
        rows: [[f64; 3]; 3],
    },
}

impl<F: Field> Transfer<F> {
    /// From `initial` to `target` in `intervals` steps of `h`; weights (3×3, symmetric positive definite) in the inertial
    /// frame for forces and in the body frame for moments.
    #[allow(clippy::too_many_arguments)]
    pub fn new(
        body: RigidBody,
        field: F,
        h: f64,
        intervals: usize,
        initial: BodyState,
        target: BodyState,
        force_weight: Matrix3<f64>,
        moment_weight: Matrix3<f64>,
    ) -> Result<Self, TransferError> {
        if !(h.is_finite() && h > 0.0) {
            return Err(TransferError::Step(h));
        }
        if intervals < 2 {
            return Err(TransferError::Steps);
        }
        let force_gain = invert("force", &force_weight)?;
        let moment_gain = invert("moment", &moment_weight)?;
        Ok(Self {
            body,
            field,
            h,
            intervals,
            initial,
            target,
            force_weight,
            moment_weight,
            force_gain,
            moment_gain,
        })
    }
}

impl<F> Transfer<F> {
    /// Number of control intervals `N`.
    pub fn intervals(&self) -> usize {
        self.intervals
    }

    /// The control that multipliers `λ_k` call for: `u_{k+1} = −[W_f⁻¹ λ², W_m⁻¹ λ⁴]` (4.24), (4.25).
    pub(crate) fn control(&self, lambda: &Vector12) -> Load {
        Load {
            force: -self.force_gain * block(lambda, 1),
            moment: -self.moment_gain * block(lambda, 3),
        }
    }
}

/// By how much `end` misses `target`: `[x − x_d, γ − γ_d, log(R_dᵀ R), Π − Π_d]`.
pub fn miss(target: &BodyState, end: &BodyState) -> SVector<f64, 12> {
    let mut miss = Vector12::zeros();
    let parts = [
        end.position - target.position,
        end.linear_momentum - target.linear_momentum,
        log(&target.attitude.tr_mul(&end.attitude)),
        end.angular_momentum - target.angular_momentum,
    ];
    for (which, part) in parts.iter().enumerate() {
        miss.fixed_rows_mut::<3>(3 * which).copy_from(part);
    }
    miss
}

/// What one interval's control costs: `(h/2) (uᶠᵀ W_f uᶠ + uᵐᵀ W_m uᵐ)`.
pub fn interval_cost(
    h: f64,
    force_weight: &Matrix3<f64>,
    moment_weight: &Matrix3<f64>,
    control: &Load,
) -> f64 {
    let quadratic = |weight: &Matrix3<f64>, u: &Vector3<f64>| u.dot(&(weight * u));
    0.5 * h * (quadratic(force_weight, &control.force) + quadratic(moment_weight, &control.moment))
}

/// Block `which` (0 … 3) of a vector of twelve.
pub(crate) fn block(v: &Vector12, which: usize) -> Vector3<f64> {
    v.fixed_rows::<3>(3 * which).into_owned()
}

fn invert(which: &'static str, weight: &Matrix3<f64>) -> Result<Matrix3<f64>, TransferError> {
    let refuse = || {
        let rows = std::array::from_fn(|i| std::array::from_fn(|j| weight[(i, j)]));
        TransferError::Weight { which, rows }
    };
    if *weight != weight.transpose() {
        return Err(refuse());
    }
    weight
        .cholesky()
        .map(|factors| factors.inverse())
        .ok_or_else(refuse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_symmetric_positive_definite_weights_are_weights() {
        let definite = Matrix3::new(2.0, 0.5, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0, 3.0);
        assert!(
            (invert("force", &definite).unwrap() * definite - Matrix3::identity()).norm() < 1e-15
        );
        let mut skewed = definite;
        skewed[(0, 2)] = 0.1;
        let indefinite = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, 1.0));
        let not_a_number = Matrix3::from_diagonal_element(f64::NAN);
        for bad in [skewed, indefinite, Matrix3::zeros(), not_a_number] {
            assert!(matches!(
                invert("moment", &bad),
                Err(TransferError::Weight {
                    which: "moment",
                    ..
                })
            ));
        }
    }
}
