//! The linear-quadratic problem of a Newton step, solved by a backward sweep over the stages.
//!
//! Stage k has the model `½ [z; v]ᵀ H [z; v] + g · [z; v]` and the dynamics `z⁺ = A z + B v + d`; the end has
//! `½ zᵀ P z + p · z` and the conditions `C z + c = 0` with multipliers ν. The cost to go from stage k is
//! `½ zᵀ P z + p · z + νᵀ (Gᵀ z + m) + ½ νᵀ M ν` (Bryson and Ho's sweep), minimal in the commands, stationary in ν.
//! With `Q_vv = H_vv + BᵀPB = L Lᵀ` the command is `v = −(K z + N ν + κ)`, and −M is a Gram matrix of the commands: it
//! is positive definite where the conditions can be met independently. The problem is convex on what dynamics and
//! conditions leave free if `Q_vv` is positive definite at every stage once the end's P has been augmented by enough of
//! `CᵀC`; that the augmentation is finite keeps P within its own size to the last stage, so that nothing cancels.

use nalgebra::{SMatrix, SVector};

use crate::steps::Linearisation;

/// A quadratic model of a stage: `½ zᵀ H_zz z + zᵀ H_zv v + ½ vᵀ H_vv v + g_z · z + g_v · v`.
#[derive(Clone, Debug)]
pub(crate) struct StageModel<const X: usize, const U: usize> {
    /// `H_zz`, symmetric.
    pub(crate) state: SMatrix<f64, X, X>,
    /// `H_zv`
    pub(crate) mixed: SMatrix<f64, X, U>,
    /// `H_vv`, symmetric.
    pub(crate) command: SMatrix<f64, U, U>,
    /// `g_z`
    pub(crate) state_gradient: SVector<f64, X>,
    /// `g_v`
    pub(crate) command_gradient: SVector<f64, U>,
    /// `A` and `B`.
    pub(crate) dynamics: Linearisation<X, U>,
    /// `d`
    pub(crate) defect: SVector<f64, X>,
}

/// The model at the end: `½ zᵀ P z + p · z` and the conditions `C z + c = 0`; rows without a condition are zero.
#[derive(Clone, Debug)]
pub(crate) struct EndModel<const X: usize> {
    /// `P`, symmetric.
    pub(crate) hessian: SMatrix<f64, X, X>,
    /// `p`
    pub(crate) gradient: SVector<f64, X>,
    /// `C`
    pub(crate) jacobian: SMatrix<f64, X, X>,
    /// `c`
    pub(crate) residual: SVector<f64, X>,
}

/// The command of a stage, `v = −(K z + N ν + κ)`.
#[derive(Clone, Debug)]
pub(crate) struct Policy<const X: usize, const U: usize> {
    /// `K`
    pub(crate) state: SMatrix<f64, U, X>,
    /// `N`
    pub(crate) conditions: SMatrix<f64, U, X>,
    /// `κ`
    pub(crate) constant: SVector<f64, U>,
}

/// The cost to go from a stage.
#[derive(Clone, Debug)]
pub(crate) struct CostToGo<const X: usize> {
    /// `P`
    pub(crate) hessian: SMatrix<f64, X, X>,
    /// `p`
    pub(crate) gradient: SVector<f64, X>,
    /// `Gᵀ`, a row a condition.
    pub(crate) border: SMatrix<f64, X, X>,
    /// `m`
    pub(crate) offset: SVector<f64, X>,
    /// `M`
    pub(crate) gram: SMatrix<f64, X, X>,
}

/// `Q_vv` is not positive definite: the model is not convex from there on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NotConvex;

impl<const X: usize> CostToGo<X> {
    /// At the end.
    pub(crate) fn end(model: &EndModel<X>) -> Self {
        Self {
            hessian: model.hessian,
            gradient: model.gradient,
            border: model.jacobian,
            offset: model.residual,
            gram: SMatrix::zeros(),
        }
    }

    /// Turns the cost to go from the stage's end into that from its start, and gives the command between.
    pub(crate) fn sweep<const U: usize>(
        &mut self,
        stage: &StageModel<X, U>,
        policy: &mut Policy<X, U>,
    ) -> Result<(), NotConvex> {
        let Linearisation { a, b } = &stage.dynamics;
        let pa = product(&self.hessian, a);
        let pb = product(&self.hessian, b);
        let gradient = self.gradient + product(&self.hessian, &stage.defect);

        let mut factor = stage.command + product(&pb.transpose(), b);
        factorise(&mut factor)?;
        let pa_t = pa.transpose();
        let mut by_state = (stage.mixed + product(&pa_t, b)).transpose();
        let mut by_conditions = product(&self.border, b).transpose();
        let mut constant = stage.command_gradient + b.tr_mul(&gradient);
        forward(&factor, &mut by_state);
        forward(&factor, &mut by_conditions);
        forward(&factor, &mut constant);

        let (state_t, conditions_t) = (by_state.transpose(), by_conditions.transpose());
        self.offset += product(&self.border, &stage.defect) - product(&conditions_t, &constant);
        self.gram -= product(&conditions_t, &by_conditions);
        self.border = product(&self.border, a) - product(&conditions_t, &by_state);
        self.gradient = stage.state_gradient + a.tr_mul(&gradient) - product(&state_t, &constant);
        let hessian = stage.state + product(&pa_t, a) - product(&state_t, &by_state);
        self.hessian = 0.5 * (hessian + hessian.transpose());

        backward(&factor, &mut by_state);
        backward(&factor, &mut by_conditions);
        backward(&factor, &mut constant);
        *policy = Policy {
            state: by_state,
            conditions: by_conditions,
            constant,
        };
        Ok(())
    }

    /// The multipliers ν of the conditions, where the state is given and does not vary; zero for rows without one.
    /// `None` where the commands cannot meet the conditions independently.
    pub(crate) fn multipliers(&self) -> Option<SVector<f64, X>> {
        self.correction(&self.offset)
    }

    /// By how much ν must change for the conditions to change by `−miss`.
    pub(crate) fn correction(&self, miss: &SVector<f64, X>) -> Option<SVector<f64, X>> {
        let mut nu = *miss;
        let (factor, scale) = self.gram_factor()?;
        nu.component_mul_assign(&scale);
        forward(&factor, &mut nu);
        backward(&factor, &mut nu);
        nu.component_mul_assign(&scale);
        Some(nu)
    }

    /// Condition number, in the 1-norm, of the map from multipliers to terminal conditions, each condition in the unit
    /// that its augmentation implies; infinite where the map is singular.
    ///
    /// The augmentation, by `½ Σ ρ c²`, is taken out again: `Λ = −M⁻¹ − ρ` is the inverse of the map without it.
    pub(crate) fn condition(&self, augmentation: &SVector<f64, X>) -> f64 {
        let Some((factor, scale)) = self.gram_factor() else {
            return f64::INFINITY;
        };
        let mut inverse = SMatrix::<f64, X, X>::identity();
        forward(&factor, &mut inverse);
        backward(&factor, &mut inverse);
        let unit = augmentation.map(|weight| {
            if weight > 0.0 {
                weight.sqrt().recip()
            } else {
                0.0
            }
        });
        for i in 0..X {
            for j in 0..X {
                inverse[(i, j)] *= scale[i] * unit[i] * scale[j] * unit[j];
            }
            inverse[(i, i)] += if unit[i] > 0.0 { -1.0 } else { 1.0 };
        }
        let norm =
            |m: &SMatrix<f64, X, X>| m.column_iter().map(|c| c.abs().sum()).fold(0.0, f64::max);
        inverse
            .try_inverse()
            .map_or(f64::INFINITY, |map| norm(&inverse) * norm(&map))
    }

    /// The gain `K + N (E − M)⁻¹ Gᵀ` of the policy under which ν follows the state: that of the neighbouring extremals.
    ///
    /// With `E = 0` it is the gain of the fixed end, which grows without bound as the end draws near and fewer stages are
    /// left than conditions. A positive diagonal `E` imposes the conditions with weight `E⁻¹` instead: the same gain as
    /// long as the conditions cost less than that, bounded to the last stage.
    pub(crate) fn gain<const U: usize>(
        &self,
        policy: &Policy<X, U>,
        softness: &SVector<f64, X>,
    ) -> SMatrix<f64, U, X> {
        let soft = Self {
            gram: self.gram - SMatrix::from_diagonal(softness),
            ..self.clone()
        };
        let Some((factor, scale)) = soft.gram_factor() else {
            return policy.state;
        };
        let mut response =
            SMatrix::<f64, X, U>::from_fn(|i, j| scale[i] * policy.conditions[(j, i)]);
        forward(&factor, &mut response);
        backward(&factor, &mut response);
        let response = SMatrix::<f64, U, X>::from_fn(|i, j| response[(j, i)] * scale[j]);
        policy.state + product(&response, &self.border)
    }

    /// The Cholesky factor of `−S M S` with `S` such that its diagonal is 1, and `S`; zero rows count as not there.
    fn gram_factor(&self) -> Option<(SMatrix<f64, X, X>, SVector<f64, X>)> {
        let scale = SVector::from_fn(|i, _| {
            let diagonal = -self.gram[(i, i)];
            if diagonal > 0.0 {
                diagonal.sqrt().recip()
            } else {
                0.0
            }
        });
        let mut factor = SMatrix::from_fn(|i, j| -scale[i] * self.gram[(i, j)] * scale[j]);
        for i in 0..X {
            if scale[i] == 0.0 {
                factor[(i, i)] = 1.0;
            }
        }
        factorise(&mut factor).ok()?;
        Some((factor, scale))
    }
}

impl<const X: usize, const U: usize> Policy<X, U> {
    /// `K = N = 0`, `κ = 0`
    pub(crate) fn zeros() -> Self {
        Self {
            state: SMatrix::zeros(),
            conditions: SMatrix::zeros(),
            constant: SVector::zeros(),
        }
    }

    /// `v = −(K z + N ν + κ)`
    pub(crate) fn command(&self, z: &SVector<f64, X>, nu: &SVector<f64, X>) -> SVector<f64, U> {
        -(self.state * z + self.conditions * nu + self.constant)
    }
}

/// Relative size below which a pivot counts as not positive.
const PIVOT: f64 = 1e-14;

/// Cholesky's factor of `m`, in its lower triangle.
fn factorise<const D: usize>(m: &mut SMatrix<f64, D, D>) -> Result<(), NotConvex> {
    for j in 0..D {
        let diagonal = m[(j, j)];
        let mut pivot = diagonal;
        for k in 0..j {
            pivot -= m[(j, k)] * m[(j, k)];
        }
        // The negation refuses NaN too.
        if !(pivot > PIVOT * diagonal.abs() && pivot.is_finite()) {
            return Err(NotConvex);
        }
        let pivot = pivot.sqrt();
        m[(j, j)] = pivot;
        let reciprocal = pivot.recip();
        for i in j + 1..D {
            let mut entry = m[(i, j)];
            for k in 0..j {
                entry -= m[(i, k)] * m[(j, k)];
            }
            m[(i, j)] = entry * reciprocal;
        }
    }
    Ok(())
}

/// `L⁻¹ rhs`
fn forward<const D: usize, const C: usize>(
    factor: &SMatrix<f64, D, D>,
    rhs: &mut SMatrix<f64, D, C>,
) {
    for i in 0..D {
        let reciprocal = factor[(i, i)].recip();
        for c in 0..C {
            let mut entry = rhs[(i, c)];
            for k in 0..i {
                entry -= factor[(i, k)] * rhs[(k, c)];
            }
            rhs[(i, c)] = entry * reciprocal;
        }
    }
}

/// `L⁻ᵀ rhs`
fn backward<const D: usize, const C: usize>(
    factor: &SMatrix<f64, D, D>,
    rhs: &mut SMatrix<f64, D, C>,
) {
    for i in (0..D).rev() {
        let reciprocal = factor[(i, i)].recip();
        for c in 0..C {
            let mut entry = rhs[(i, c)];
            for k in i + 1..D {
                entry -= factor[(k, i)] * rhs[(k, c)];
            }
            rhs[(i, c)] = entry * reciprocal;
        }
    }
}

/// `a b`, by columns, without what the zeros of `b` would contribute: the derivatives of a step are sparse.
#[inline]
fn product<const R: usize, const K: usize, const C: usize>(
    a: &SMatrix<f64, R, K>,
    b: &SMatrix<f64, K, C>,
) -> SMatrix<f64, R, C> {
    let mut product = SMatrix::<f64, R, C>::zeros();
    for (column, factors) in product.data.0.iter_mut().zip(&b.data.0) {
        let mut sum = [0.0; R];
        for (a, factor) in a.data.0.iter().zip(factors) {
            if *factor == 0.0 {
                continue;
            }
            for (sum, a) in sum.iter_mut().zip(a) {
                *sum += a * factor;
            }
        }
        *column = sum;
    }
    product
}

mod rank;
#[cfg(test)]
mod tests;
