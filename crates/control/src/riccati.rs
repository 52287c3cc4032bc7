//! The linear-quadratic problem of a Newton step, solved by a backward sweep over the stages.
//!
//! Stage k has the model `½ [z; v]ᵀ H [z; v] + g · [z; v]` and the dynamics `z⁺ = A z + B v + d`. The end has
//! `½ zᵀ P z + p · z` and the conditions `C z + c = 0` with multipliers ν. The cost to go from stage k is
//! `½ zᵀ P z + p · z + νᵀ (Gᵀ z + m) + ½ νᵀ M ν` (the sweep of Bryson and Ho), minimal in the commands and stationary in ν.
//!
//! With `Q_vv = H_vv + BᵀPB = L D Lᵀ` the command is `v = K z + N ν + κ`. −M is a Gram matrix of the commands: it is
//! positive definite if the conditions can be met independently. Add a sufficient multiple of `CᵀC` to the end's P. The
//! problem is convex on the subspace that dynamics and conditions leave free if `Q_vv` is then positive definite at
//! every stage. As the augmentation is finite, P keeps its size down to the last stage, and nothing cancels.

use fearless_simd::Level;
use nalgebra::{SMatrix, SVector};

use crate::discrete::{Curvature, Inputs, Linearization};
use crate::problem::Off;

/// A quadratic model of a stage: that of its step, and `½ zᵀ H_zz z + vᵀ H_vz z + ½ vᵀ H_vv v + g_z · z + g_v · v`.
#[derive(Clone, Debug)]
pub(crate) struct StageModel<const X: usize, const U: usize> {
    /// The model of the step.
    pub(crate) curvature: Curvature,
    /// `H_zz`, symmetric.
    pub(crate) state: SMatrix<f64, X, X>,
    /// `H_vz`
    pub(crate) mixed: SMatrix<f64, U, X>,
    /// `H_vv`, symmetric.
    pub(crate) command: SMatrix<f64, U, U>,
    /// `g_z`
    pub(crate) state_gradient: SVector<f64, X>,
    /// `g_v`
    pub(crate) command_gradient: SVector<f64, U>,
    /// `d`
    pub(crate) defect: SVector<f64, X>,
}

impl<const X: usize, const U: usize> StageModel<X, U> {
    /// No cost.
    pub(crate) fn zeros() -> Self {
        Self {
            curvature: Curvature::default(),
            state: SMatrix::zeros(),
            mixed: SMatrix::zeros(),
            command: SMatrix::zeros(),
            state_gradient: SVector::zeros(),
            command_gradient: SVector::zeros(),
            defect: SVector::zeros(),
        }
    }

    /// Leaves commands that are off out: they stay where they are, and cost their `weight` alone.
    #[cold]
    #[inline(never)]
    pub(crate) fn shut(&mut self, off: Off, weight: &SMatrix<f64, U, U>) {
        off.clear_rows(&mut self.mixed);
        off.decouple(&mut self.command, |command| weight[(command, command)]);
        off.clear(&mut self.command_gradient);
    }
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

/// The policy of a stage, `v = K z + N ν + κ`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Policy<const X: usize, const U: usize> {
    /// `Kᵀ`
    pub(crate) state: SMatrix<f64, X, U>,
    /// `Nᵀ`
    pub(crate) conditions: SMatrix<f64, X, U>,
    /// `κ`
    pub(crate) constant: SVector<f64, U>,
    /// The factors of `Q_vv`.
    factor: Square<U>,
}

/// Sizes of the quantities of a problem.
pub(crate) struct Scale<const X: usize, const U: usize> {
    pub(crate) variations: SVector<f64, X>,
    pub(crate) commands: SVector<f64, U>,
    /// Of the terminal conditions.
    pub(crate) conditions: SVector<f64, X>,
    pub(crate) cost: f64,
}

impl<const X: usize, const U: usize> Scale<X, U> {
    /// The ratios of these sizes to others.
    pub(crate) fn over(&self, other: &Self) -> Self {
        Self {
            variations: self.variations.component_div(&other.variations),
            commands: self.commands.component_div(&other.commands),
            conditions: self.conditions.component_div(&other.conditions),
            cost: self.cost / other.cost,
        }
    }

    /// The sizes of the multipliers of the terminal conditions.
    pub(crate) fn multipliers(&self) -> SVector<f64, X> {
        self.conditions.map(|size| self.cost / size)
    }
}

/// The cost to go from a stage.
#[derive(Clone, Debug)]
pub(crate) struct CostToGo<const X: usize> {
    /// `P`
    pub(crate) hessian: SMatrix<f64, X, X>,
    /// `p`
    pub(crate) gradient: SVector<f64, X>,
    /// `Gᵀ`, with one row per condition.
    pub(crate) border: SMatrix<f64, X, X>,
    /// `m`
    pub(crate) offset: SVector<f64, X>,
    /// `M`
    pub(crate) gram: SMatrix<f64, X, X>,
    /// The instructions that lanes may use.
    level: Level,
}

pub(crate) use sweep::Stage;

/// The error that `Q_vv` is not positive definite, so that the model is not convex at this stage. The constant of the
/// stage's policy is then a command along which the model is not convex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NotConvex;

impl<const X: usize> CostToGo<X> {
    /// The cost to go at the end.
    pub(crate) fn end(model: &EndModel<X>) -> Self {
        Self {
            hessian: model.hessian,
            gradient: model.gradient,
            border: model.jacobian,
            offset: model.residual,
            gram: SMatrix::zeros(),
            level: Level::new(),
        }
    }

    /// The multipliers ν of the conditions for a fixed state; zero for rows without a condition. Returns `None` if the
    /// commands cannot meet the conditions independently.
    pub(crate) fn multipliers(&self) -> Option<SVector<f64, X>> {
        self.correction(&self.offset)
    }

    /// The change of ν that changes the conditions by `−miss`.
    pub(crate) fn correction(&self, miss: &SVector<f64, X>) -> Option<SVector<f64, X>> {
        let (factor, scale) = self.gram_factor(&SVector::zeros())?;
        let mut nu: [[f64; 1]; X] = std::array::from_fn(|i| [scale[i] * miss[i]]);
        solve(&factor, &mut nu);
        Some(SVector::from_fn(|i, _| scale[i] * nu[i][0]))
    }

    /// Condition number, in the 1-norm, of the map from multipliers to terminal conditions, with each condition in the
    /// unit that the augmentation `units` implies; infinite if the map is singular.
    ///
    /// The augmentation by `½ Σ ρ c²` is removed: `Λ = −M⁻¹ − ρ` is the inverse of the map without it.
    pub(crate) fn condition(&self, augmentation: &SVector<f64, X>, units: &SVector<f64, X>) -> f64 {
        let Some((factor, scale)) = self.gram_factor(&SVector::zeros()) else {
            return f64::INFINITY;
        };
        let mut inverse = SMatrix::<f64, X, X>::identity();
        solve(&factor, &mut inverse.data.0);
        let unit = units.map(|weight| {
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
            inverse[(i, i)] += if unit[i] > 0.0 {
                -augmentation[i] / units[i]
            } else {
                1.0
            };
        }
        let norm =
            |m: &SMatrix<f64, X, X>| m.column_iter().map(|c| c.abs().sum()).fold(0.0, f64::max);
        inverse
            .try_inverse()
            .map_or(f64::INFINITY, |map| norm(&inverse) * norm(&map))
    }

    /// The diagonal `S` that makes the diagonal of `S (E − M) S` 1. It is zero for zero rows of M.
    #[inline(always)]
    fn gram_scale(&self, softness: &SVector<f64, X>) -> SVector<f64, X> {
        let mut scale = SVector::zeros();
        for i in 0..X {
            let diagonal = softness[i] - self.gram[(i, i)];
            if diagonal > 0.0 {
                scale[i] = diagonal.sqrt().recip();
            }
        }
        scale
    }

    /// The factors of `S (E − M) S` and `S` (see [`CostToGo::gram_scale`]). Zero rows of M are ignored.
    fn gram_factor(&self, softness: &SVector<f64, X>) -> Option<(Square<X>, SVector<f64, X>)> {
        let scale = self.gram_scale(softness);
        let mut factor: Square<X> = std::array::from_fn(|j| {
            std::array::from_fn(|i| -scale[i] * self.gram.data.0[j][i] * scale[j])
        });
        for (i, column) in factor.iter_mut().enumerate() {
            column[i] = 1.0;
        }
        factorize(&mut factor).ok()?;
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
            factor: [[0.0; U]; U],
        }
    }

    /// Updates gradient `p` and offset `m` of the cost to go from the stage's end to its start, if only the gradient
    /// `g_v` of the commands has changed since the sweep, and computes the corresponding κ.
    pub(crate) fn follow(
        &mut self,
        command_gradient: &SVector<f64, U>,
        step: &Linearization,
        inputs: &Inputs<U>,
        gradient: &mut SVector<f64, X>,
        offset: &mut SVector<f64, X>,
    ) {
        let (by_state, by_command) = step.backward(inputs, gradient);
        let slope = command_gradient + by_command;
        let mut constant = (-slope).transpose().data.0;
        solve(&self.factor, &mut constant);
        *gradient = by_state + self.state * slope;
        *offset += self.conditions * slope;
        self.constant.data.0 = transposed(&constant);
    }

    /// `−Q_vv⁻¹ slope`
    pub(crate) fn answer(&self, slope: &SVector<f64, U>) -> SVector<f64, U> {
        let mut answer = (-slope).transpose().data.0;
        solve(&self.factor, &mut answer);
        SVector::from_fn(|i, _| answer[i][0])
    }

    /// Adds a multiple of the part of the stage, `−Nᵀ Q_vv N`, to the Gram matrix M of the cost to go.
    pub(crate) fn add_gram(&self, gram: &mut SMatrix<f64, X, X>, times: f64) {
        for u in 0..U {
            let mut row = self.conditions.column(u).into_owned();
            for i in u + 1..U {
                row.axpy(self.factor[u][i], &self.conditions.column(i), 1.0);
            }
            let pivot = self.factor[u][u].recip();
            gram.ger(-times * pivot, &row, &row, 1.0);
        }
    }

    /// Converts to units in which quantities have the values of `to` if they are 1 now.
    pub(crate) fn convert(&mut self, to: &Scale<X, U>) {
        for u in 0..U {
            let own = to.commands[u];
            for i in 0..X {
                self.state[(i, u)] *= own / to.variations[i];
                self.conditions[(i, u)] *= own * to.conditions[i] / to.cost;
            }
            self.constant[u] *= own;
            self.factor[u][u] *= own * own / to.cost;
            for i in u + 1..U {
                self.factor[u][i] *= own / to.commands[i];
            }
        }
    }

    /// Returns true if the pivots of `Q_vv` are at least these.
    pub(crate) fn exceeds(&self, pivots: &SVector<f64, U>) -> bool {
        (0..U).all(|u| self.factor[u][u] * pivots[u] <= 1.0)
    }

    /// `v = K z + N ν + κ`
    pub(crate) fn command(&self, z: &SVector<f64, X>, nu: &SVector<f64, X>) -> SVector<f64, U> {
        self.state.tr_mul(z) + self.conditions.tr_mul(nu) + self.constant
    }
}

/// Relative size below which a pivot counts as not positive.
const PIVOT: f64 = 1e-14;

/// A square matrix, stored by columns.
type Square<const D: usize> = [[f64; D]; D];

/// Factorizes the symmetric `m = L D Lᵀ` in place. The lower triangle holds L, whose diagonal is 1, and the diagonal
/// holds `D⁻¹`. Returns the index of the row if a pivot is not positive.
#[inline(always)]
fn factorize<const D: usize>(m: &mut Square<D>) -> Result<(), usize> {
    let diagonal: [f64; D] = std::array::from_fn(|i| m[i][i]);
    for j in 0..D {
        let pivot = m[j][j];
        // The negated comparison also rejects NaN.
        if !(pivot > PIVOT * diagonal[j].abs() && pivot.is_finite()) {
            return Err(j);
        }
        let reciprocal = pivot.recip();
        let column = m[j];
        for c in j + 1..D {
            let factor = reciprocal * column[c];
            for i in c..D {
                m[c][i] -= factor * column[i];
            }
            m[j][c] = factor;
        }
        m[j][j] = reciprocal;
    }
    Ok(())
}

/// The pivots D of `m = L D Lᵀ`, or `None` if one is not positive.
pub(crate) fn pivots<const D: usize>(m: &SMatrix<f64, D, D>) -> Option<SVector<f64, D>> {
    let mut factor = m.data.0;
    factorize(&mut factor).ok()?;
    Some(SVector::from_fn(|i, _| factor[i][i].recip()))
}

/// The vector `v` with `Lᵀ v = e_row`. `vᵀ m v` is the pivot at which the factorization of `m` failed.
fn not_convex<const D: usize>(factor: &Square<D>, row: usize) -> SVector<f64, D> {
    let mut v = SVector::zeros();
    v[row] = 1.0;
    for i in (0..row).rev() {
        v[i] = -(i + 1..=row).map(|k| factor[i][k] * v[k]).sum::<f64>();
    }
    v
}

/// `L⁻¹ rows`
#[inline(always)]
fn forward<const D: usize, const C: usize>(factor: &Square<D>, rows: &mut [[f64; C]; D]) {
    for i in 1..D {
        let mut row = rows[i];
        for k in 0..i {
            add(&mut row, -factor[k][i], &rows[k]);
        }
        rows[i] = row;
    }
}

/// `L⁻ᵀ rows`
#[inline(always)]
fn backward<const D: usize, const C: usize>(factor: &Square<D>, rows: &mut [[f64; C]; D]) {
    for i in (0..D).rev() {
        let mut row = rows[i];
        for k in i + 1..D {
            add(&mut row, -factor[i][k], &rows[k]);
        }
        rows[i] = row;
    }
}

/// `(L D Lᵀ)⁻¹ rows`
fn solve<const D: usize, const C: usize>(factor: &Square<D>, rows: &mut [[f64; C]; D]) {
    forward(factor, rows);
    for (i, row) in rows.iter_mut().enumerate() {
        for entry in row {
            *entry *= factor[i][i];
        }
    }
    backward(factor, rows);
}

/// `sum += factor · part`
#[inline(always)]
fn add<const D: usize>(sum: &mut [f64; D], factor: f64, part: &[f64; D]) {
    for (sum, part) in sum.iter_mut().zip(part) {
        *sum += factor * part;
    }
}

#[inline(always)]
fn transposed<const R: usize, const C: usize>(m: &[[f64; R]; C]) -> [[f64; C]; R] {
    std::array::from_fn(|r| std::array::from_fn(|c| m[c][r]))
}

mod columns;
mod gain;
mod rank;
mod sweep;
#[cfg(test)]
mod tests;
