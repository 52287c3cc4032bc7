//! A kick before a map whose derivatives are known.

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

/// Where in `z` the pose of a block of three coordinates begins.
pub(crate) const fn pose(block: usize) -> usize {
    6 * block
}

/// Where in `z` the momentum of a block of three coordinates begins.
pub(crate) const fn momentum(block: usize) -> usize {
    6 * block + 3
}

/// Adds `part` to the three rows and columns from those given on.
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
    /// Rows of the kick by the momentum that they kick: where that is in `z`, `τ G` and `τ B`.
    #[inline]
    fn rows(&self) -> impl Iterator<Item = (usize, &[Matrix3<f64>; N], SMatrix<f64, 3, U>)> {
        let rows = self.by_pose.iter().zip(self.commands).enumerate();
        rows.map(|(block, (by_pose, columns))| (momentum(block), by_pose, self.tau * columns))
    }

    /// Puts the kick before the map that has the first derivatives `a`, `b`.
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

    /// Puts the kick before the map that has the second derivatives `into.state` and whose commands do nothing else;
    /// `own` are the kick's own second derivatives by poses.
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
