//! Columns of matrices in lanes. Nothing is fused, so that the results do not depend on the instruction set.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4};

use crate::discrete::Linearization;
use crate::discrete::linear::{Blocks, groups, momentum, pose};
use crate::discrete::stored::StoredTurn;

/// The rows of a column, four in each of the `V` elements. Rows beyond the last one are zero.
pub(super) type Column<S, const V: usize> = [f64x4<S>; V];

#[inline(always)]
pub(super) fn zero<S: Simd, const V: usize>(simd: S) -> Column<S, V> {
    [f64x4::splat(simd, 0.0); V]
}

#[inline(always)]
pub(super) fn load<S: Simd, const V: usize, const R: usize>(
    simd: S,
    rows: &[f64; R],
) -> Column<S, V> {
    let mut column = zero(simd);
    let (whole, rest) = rows.as_chunks::<4>();
    for (four, rows) in column.iter_mut().zip(whole) {
        *four = f64x4::simd_from(simd, *rows);
    }
    if !rest.is_empty() {
        let mut last = [0.0; 4];
        last[..rest.len()].copy_from_slice(rest);
        column[whole.len()] = f64x4::simd_from(simd, last);
    }
    column
}

#[inline(always)]
pub(super) fn load_all<S: Simd, const V: usize, const R: usize, const C: usize>(
    simd: S,
    matrix: &[[f64; R]; C],
) -> [Column<S, V>; C] {
    let mut columns = [zero(simd); C];
    for (column, rows) in columns.iter_mut().zip(matrix) {
        *column = load(simd, rows);
    }
    columns
}

#[inline(always)]
pub(super) fn store<S: Simd, const V: usize, const R: usize>(
    column: &Column<S, V>,
    rows: &mut [f64; R],
) {
    let (whole, rest) = rows.as_chunks_mut::<4>();
    for (four, rows) in column.iter().zip(&mut *whole) {
        four.store_slice(rows);
    }
    if !rest.is_empty() {
        let left = rest.len();
        rest.copy_from_slice(&column[whole.len()].as_slice()[..left]);
    }
}

/// The entry of a row.
#[inline(always)]
pub(super) fn entry<S: Simd, const V: usize>(column: &Column<S, V>, row: usize) -> f64 {
    column[row / 4][row % 4]
}

/// `sum += factor · part`
#[inline(always)]
pub(super) fn add<S: Simd, const V: usize>(
    sum: &mut Column<S, V>,
    factor: f64,
    part: &Column<S, V>,
) {
    for (sum, part) in sum.iter_mut().zip(part) {
        *sum += *part * factor;
    }
}

/// `sum −= factor · part`
#[inline(always)]
pub(super) fn take<S: Simd, const V: usize>(
    sum: &mut Column<S, V>,
    factor: f64,
    part: &Column<S, V>,
) {
    for (sum, part) in sum.iter_mut().zip(part) {
        *sum -= *part * factor;
    }
}

/// `sum += part`
#[inline(always)]
pub(super) fn plus<S: Simd, const V: usize>(sum: &mut Column<S, V>, part: &Column<S, V>) {
    for (sum, part) in sum.iter_mut().zip(part) {
        *sum += *part;
    }
}

/// `factor · column`
#[inline(always)]
pub(super) fn scaled<S: Simd, const V: usize>(
    mut column: Column<S, V>,
    factor: f64,
) -> Column<S, V> {
    for four in &mut column {
        *four *= factor;
    }
    column
}

/// The first `D` rows as columns.
#[inline(always)]
pub(super) fn transposed<
    S: Simd,
    const V: usize,
    const W: usize,
    const C: usize,
    const D: usize,
>(
    simd: S,
    columns: &[Column<S, V>; C],
) -> [Column<S, W>; D] {
    let none = f64x4::splat(simd, 0.0);
    let mut rows = [[none; W]; D];
    for v in 0..V {
        for w in 0..W {
            let mut block = [none; 4];
            for (k, column) in block.iter_mut().enumerate() {
                if 4 * w + k < C {
                    *column = columns[4 * w + k][v];
                }
            }
            let [a, b, c, d] = block;
            let (low_even, high_even) = simd.interleave_f64x4(a, c);
            let (low_odd, high_odd) = simd.interleave_f64x4(b, d);
            let (first, second) = simd.interleave_f64x4(low_even, low_odd);
            let (third, fourth) = simd.interleave_f64x4(high_even, high_odd);
            let block = [first, second, third, fourth];
            for (k, row) in block.iter().enumerate() {
                if 4 * v + k < D {
                    rows[4 * v + k][w] = *row;
                }
            }
        }
    }
    rows
}

/// `M K`, where K are the first derivatives of a kick.
#[inline(always)]
pub(super) fn before_kick<S: Simd, const V: usize, const X: usize>(
    columns: &mut [Column<S, V>; X],
    by_pose: &Blocks,
) {
    for j in 0..groups(X) {
        for c in 0..3 {
            let mut sum = columns[pose(j) + c];
            for i in 0..groups(X) {
                for r in 0..3 {
                    let factor = by_pose[i][j].data.0[c][r];
                    add(&mut sum, factor, &columns[momentum(i) + r]);
                }
            }
            columns[pose(j) + c] = sum;
        }
    }
}

/// `M D`, where D are the first derivatives of a step's drift.
#[inline(always)]
pub(super) fn before_drift<S: Simd, const V: usize, const X: usize>(
    simd: S,
    columns: &mut [Column<S, V>; X],
    step: &Linearization,
) {
    if let Some(by_momentum) = step.glide {
        for c in 0..3 {
            let part = columns[pose(0) + c];
            add(&mut columns[momentum(0) + c], by_momentum, &part);
        }
    }
    if let Some(turn) = &step.turn {
        let last = groups(X) - 1;
        let mut zeta = [zero(simd); 3];
        let mut delta = [zero(simd); 3];
        for c in 0..3 {
            let (mut by_zeta, mut by_delta) = (zero(simd), zero(simd));
            for r in 0..3 {
                let (by_pose, by_momentum) =
                    (&columns[pose(last) + r], &columns[momentum(last) + r]);
                add(&mut by_zeta, turn.pose.data.0[c][r], by_pose);
                add(&mut by_delta, turn.pose_by_momentum.data.0[c][r], by_pose);
                add(&mut by_delta, turn.momentum.data.0[c][r], by_momentum);
            }
            (zeta[c], delta[c]) = (by_zeta, by_delta);
        }
        for c in 0..3 {
            columns[pose(last) + c] = zeta[c];
            columns[momentum(last) + c] = delta[c];
        }
    }
}

/// `M G`, where G are the first derivatives of the drift of a center of mass with drag.
#[inline(always)]
pub(super) fn before_slowing<S: Simd, const V: usize, const X: usize>(
    simd: S,
    columns: &mut [Column<S, V>; X],
    by: &Blocks,
) {
    let mut sums = [[zero(simd); 3]; 2];
    for (j, sums) in sums.iter_mut().enumerate() {
        for (c, sum) in sums.iter_mut().enumerate() {
            for (by, at) in by.iter().zip([pose(0), momentum(0)]) {
                for r in 0..3 {
                    add(sum, by[j].data.0[c][r], &columns[at + r]);
                }
            }
        }
    }
    for (sums, at) in sums.iter().zip([pose(0), momentum(0)]) {
        columns[at..at + 3].copy_from_slice(sums);
    }
}

/// What a stored momentum adds to [`before_drift`], which follows.
#[inline(always)]
pub(super) fn before_stored<S: Simd, const V: usize, const X: usize>(
    columns: &mut [Column<S, V>; X],
    stored: &StoredTurn,
) {
    let last = groups(X) - 1;
    for c in 0..3 {
        let mut by_stored = columns[momentum(0) + c];
        for r in 0..3 {
            let by_pose = stored.pose.data.0[c][r];
            add(&mut by_stored, by_pose, &columns[pose(last) + r]);
            let by_momentum = stored.momentum.data.0[c][r];
            add(&mut by_stored, by_momentum, &columns[momentum(last) + r]);
        }
        columns[momentum(0) + c] = by_stored;
    }
}
