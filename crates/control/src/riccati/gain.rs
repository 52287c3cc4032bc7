//! The gain of the neighboring extremals.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch, f64x4};
use nalgebra::{SMatrix, SVector};

use super::columns::{Column, add, entry, load, load_all, scaled, store, take, transposed};
use super::{CostToGo, PIVOT, Policy};

impl<const X: usize> CostToGo<X> {
    /// The gain `−K − N (E − M)⁻¹ Gᵀ` of the policy in which ν follows the state. It is the gain of the neighboring
    /// extremals.
    ///
    /// With `E = 0` it is the gain of the fixed end. It grows without bound towards the end, when fewer stages are left
    /// than conditions. A positive diagonal `E` imposes the conditions with weight `E⁻¹` instead. The gain is then
    /// nearly the same as long as meeting the conditions costs less than that, and it is bounded to the last stage.
    pub(crate) fn gain<const U: usize>(
        &self,
        policy: &Policy<X, U>,
        softness: &SVector<f64, X>,
        gain: &mut SMatrix<f64, U, X>,
    ) {
        // As in `CostToGo::sweep`.
        if X <= 6 && U < 4 {
            dispatch!(self.level, simd => self.gain_in::<_, U, 2, 1>(simd, policy, softness, gain));
        } else if U < 8 {
            dispatch!(self.level, simd => self.gain_in::<_, U, 3, 2>(simd, policy, softness, gain));
        } else {
            dispatch!(self.level, simd => self.gain_in::<_, U, 3, 4>(simd, policy, softness, gain));
        }
    }

    #[inline(always)]
    fn gain_in<S: Simd, const U: usize, const V: usize, const W: usize>(
        &self,
        simd: S,
        policy: &Policy<X, U>,
        softness: &SVector<f64, X>,
        gain: &mut SMatrix<f64, U, X>,
    ) {
        let state: [Column<S, V>; U] = load_all(simd, &policy.state.data.0);
        let state: [Column<S, W>; X] = transposed(simd, &state);
        let scale = self.gram_scale(softness);
        let response = self.response::<S, U, V, W>(simd, policy, &scale);
        for (c, state) in state.into_iter().enumerate() {
            let mut column = scaled(state, -1.0);
            if let Some(response) = &response {
                for i in 0..X {
                    let weight = scale[i] * self.border.data.0[c][i];
                    add(&mut column, weight, &response[i]);
                }
            }
            store(&column, &mut gain.data.0[c]);
        }
    }

    /// `−(S (E − M) S)⁻¹ S Nᵀ`, or `None` if the conditions depend on each other.
    #[inline(always)]
    fn response<S: Simd, const U: usize, const V: usize, const W: usize>(
        &self,
        simd: S,
        policy: &Policy<X, U>,
        scale: &SVector<f64, X>,
    ) -> Option<[Column<S, W>; X]> {
        let rows: Column<S, V> = load(simd, &scale.data.0[0]);
        let mut factor: [Column<S, V>; X] = load_all(simd, &self.gram.data.0);
        for (j, column) in factor.iter_mut().enumerate() {
            *column = scaled(*column, -scale[j]);
            for (four, rows) in column.iter_mut().zip(&rows) {
                *four *= *rows;
            }
            // The diagonal is 1, also where there is no condition.
            let [mut others, mut own] = [[1.0; 4], [0.0; 4]];
            (others[j % 4], own[j % 4]) = (0.0, 1.0);
            let four = &mut column[j / 4];
            *four = *four * f64x4::simd_from(simd, others) + f64x4::simd_from(simd, own);
        }
        let mut reciprocals = [0.0; X];
        let mut lower = [[0.0; X]; X];
        for j in 0..X {
            let pivot = entry(&factor[j], j);
            // The negated comparison also rejects NaN.
            if !(pivot > PIVOT && pivot.is_finite()) {
                return None;
            }
            reciprocals[j] = pivot.recip();
            let column = factor[j];
            store(&scaled(column, reciprocals[j]), &mut lower[j]);
            for c in j + 1..X {
                take(&mut factor[c], lower[j][c], &column);
            }
        }
        let conditions: [Column<S, V>; U] = load_all(simd, &policy.conditions.data.0);
        let mut response: [Column<S, W>; X] = transposed(simd, &conditions);
        for (row, scale) in response.iter_mut().zip(scale) {
            *row = scaled(*row, -scale);
        }
        for k in 0..X {
            let row = response[k];
            for i in k + 1..X {
                take(&mut response[i], lower[k][i], &row);
            }
        }
        for (row, reciprocal) in response.iter_mut().zip(reciprocals) {
            *row = scaled(*row, reciprocal);
        }
        for k in (0..X).rev() {
            let row = response[k];
            for i in 0..k {
                take(&mut response[i], lower[i][k], &row);
            }
        }
        Some(response)
    }
}
