//! Derivatives of a kick followed by a map whose derivatives are known.

use nalgebra::{Matrix3, SMatrix};

use super::coordinates::Blocks;
use super::{Curvature, Linearization};

/// First derivatives of a kick, `m⁺ = m + τ (G p + B v)`.
pub(crate) struct Kick<'c, const N: usize, const U: usize> {
    pub(crate) tau: f64,
    /// `τ G`
    pub(crate) by_pose: Blocks<N>,
    /// `B`
    pub(crate) commands: &'c [SMatrix<f64, 3, U>; N],
}

/// The index in `z` of the pose of a block.
pub(crate) const fn pose(block: usize) -> usize {
    6 * block
}

/// The index in `z` of the momentum of a block.
pub(crate) const fn momentum(block: usize) -> usize {
    6 * block + 3
}

/// Adds `part` to the 3×3 block at `row` and `column`.
fn add<const X: usize>(
    sum: &mut SMatrix<f64, X, X>,
    row: usize,
    column: usize,
    part: &Matrix3<f64>,
) {
    let mut block = sum.fixed_view_mut::<3, 3>(row, column);
    block += part;
}

impl<const N: usize, const U: usize> Kick<'_, N, U> {
    /// The rows of the kick by block: the index of the momentum in `z`, `τ G` and `τ B`.
    #[inline]
    fn rows(&self) -> impl Iterator<Item = (usize, &[Matrix3<f64>; N], SMatrix<f64, 3, U>)> {
        let rows = self.by_pose.iter().zip(self.commands).enumerate();
        rows.map(|(block, (by_pose, columns))| (momentum(block), by_pose, self.tau * columns))
    }

    /// Composes the kick with a following map that has the first derivatives `a`, `b`.
    #[inline]
    pub(crate) fn precede<const X: usize>(&self, Linearization { a, b }: &mut Linearization<X, U>) {
        for (at, by_pose, by_command) in self.rows() {
            let by_momentum = a.fixed_columns::<3>(at).into_owned();
            for (block, kick) in by_pose.iter().enumerate() {
                let mut columns = a.fixed_columns_mut::<3>(pose(block));
                columns += by_momentum * kick;
            }
            *b += by_momentum * by_command;
        }
    }

    /// Composes the kick with a following map that has the second derivatives `into.state` and does not depend on the
    /// commands otherwise. `own` are the second derivatives of the kick by poses.
    #[inline]
    pub(crate) fn precede_twice<const X: usize>(
        &self,
        own: &Blocks<N>,
        into: &mut Curvature<X, U>,
    ) {
        let Curvature {
            state,
            mixed,
            command,
        } = into;
        for (at, by_pose, _) in self.rows() {
            let by_momentum = state.fixed_columns::<3>(at).into_owned();
            for (block, kick) in by_pose.iter().enumerate() {
                let mut columns = state.fixed_columns_mut::<3>(pose(block));
                columns += by_momentum * kick;
            }
        }
        for (at, by_pose, by_command) in self.rows() {
            let by_momentum = state.fixed_rows::<3>(at).into_owned();
            for (block, kick) in by_pose.iter().enumerate() {
                let mut rows = state.fixed_rows_mut::<3>(pose(block));
                rows += kick.transpose() * by_momentum;
            }
            *mixed += by_momentum.transpose() * by_command;
        }
        for (at, _, by_command) in self.rows() {
            *command += by_command.transpose() * mixed.fixed_rows::<3>(at);
        }
        for (i, row) in own.iter().enumerate() {
            for (j, block) in row.iter().enumerate() {
                add(state, pose(i), pose(j), block);
            }
        }
    }
}
