//! Derivatives of whole steps, multiplied out from their factors.

use nalgebra::{DMatrix, Matrix3, SMatrix};

use crate::discrete::linear::{Blocks, CommandRows, KickInputs, groups, momentum, pose};
use crate::discrete::{Curvature, Inputs, Linearization};

/// First derivatives `A`, `B` of a step, and second derivatives of the product of multipliers and the step.
#[derive(Clone, Debug)]
pub(crate) struct Composed<const X: usize, const U: usize> {
    pub(crate) a: SMatrix<f64, X, X>,
    pub(crate) b: SMatrix<f64, X, U>,
    pub(crate) state: SMatrix<f64, X, X>,
    pub(crate) mixed: SMatrix<f64, X, U>,
    pub(crate) command: SMatrix<f64, U, U>,
}

fn add(matrix: &mut DMatrix<f64>, row: usize, column: usize, block: &Matrix3<f64>) {
    let mut view = matrix.view_mut((row, column), (3, 3));
    view += block;
}

/// The kick as a map of coordinates and commands.
fn kick<const X: usize, const U: usize>(t: &Blocks, inputs: &KickInputs<U>) -> DMatrix<f64> {
    let mut map = DMatrix::identity(X + U, X + U);
    for (i, t) in t.iter().enumerate().take(groups(X)) {
        for (j, t) in t.iter().enumerate().take(groups(X)) {
            add(&mut map, momentum(i), pose(j), t);
        }
        map.view_mut((momentum(i), X), (3, U))
            .copy_from(&inputs.columns[i]);
    }
    map
}

/// Second derivatives by poses.
fn by_poses<const X: usize, const U: usize>(blocks: &Blocks) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(X + U, X + U);
    for (i, row) in blocks.iter().enumerate().take(groups(X)) {
        for (j, block) in row.iter().enumerate().take(groups(X)) {
            add(&mut all, pose(i), pose(j), block);
        }
    }
    all
}

/// Adds second derivatives by the attitude and the commands.
fn cross<const X: usize, const U: usize>(all: &mut DMatrix<f64>, rows: Option<&CommandRows>) {
    let attitude = pose(groups(X) - 1);
    for (c, row) in rows.into_iter().flatten().enumerate() {
        for (u, entry) in row.iter().enumerate().take(U) {
            all[(attitude + c, X + u)] += entry;
            all[(X + u, attitude + c)] += entry;
        }
    }
}

impl<const X: usize, const U: usize> Composed<X, U> {
    pub(crate) fn zeros() -> Self {
        Self {
            a: SMatrix::zeros(),
            b: SMatrix::zeros(),
            state: SMatrix::zeros(),
            mixed: SMatrix::zeros(),
            command: SMatrix::zeros(),
        }
    }

    pub(crate) fn of(inputs: &Inputs<U>, first: &Linearization, second: &Curvature) -> Self {
        let inputs = &*first.inputs(inputs);
        let last = groups(X) - 1;
        let mut drift = DMatrix::identity(X + U, X + U);
        let places = [pose(0), momentum(0)];
        if let Some(by_momentum) = first.glide {
            let block = Matrix3::from_diagonal_element(by_momentum);
            add(&mut drift, pose(0), momentum(0), &block);
        }
        if let Some(by) = &first.slowed {
            drift.view_mut((0, 0), (6, 6)).fill(0.0);
            for (row, by) in places.into_iter().zip(&**by) {
                for (column, by) in places.into_iter().zip(by) {
                    add(&mut drift, row, column, by);
                }
            }
        }
        if let Some(turn) = &first.turn {
            drift.view_mut((pose(last), pose(last)), (6, 6)).fill(0.0);
            add(&mut drift, pose(last), pose(last), &turn.pose);
            add(
                &mut drift,
                pose(last),
                momentum(last),
                &turn.pose_by_momentum,
            );
            add(&mut drift, momentum(last), momentum(last), &turn.momentum);
        }
        if let Some(stored) = first.stored::<X, U>() {
            add(&mut drift, pose(last), momentum(0), &stored.pose);
            add(&mut drift, momentum(last), momentum(0), &stored.momentum);
        }
        let after = kick::<X, U>(&first.after, &inputs.after);
        let none = || DMatrix::zeros(X + U, X + U);
        let mut hessian = second.after.as_ref().map_or_else(none, by_poses::<X, U>);
        cross::<X, U>(&mut hessian, second.after_commands.as_ref());
        hessian = drift.transpose() * hessian * &drift;
        for (row, by) in places
            .into_iter()
            .zip(second.slowed.iter().flat_map(|by| &**by))
        {
            for (column, by) in places.into_iter().zip(by) {
                add(&mut hessian, row, column, by);
            }
        }
        if let Some(curvature) = &second.turn {
            let (from, to) = (pose(last), momentum(last));
            add(&mut hessian, from, to, &curvature.pose_momentum);
            add(&mut hessian, to, from, &curvature.pose_momentum.transpose());
            add(&mut hessian, to, to, &curvature.momentum_momentum);
        }
        if let Some(curvature) = &second.stored {
            let stored = momentum(0);
            for (row, block) in [
                (pose(last), &curvature.pose),
                (momentum(last), &curvature.momentum),
            ] {
                add(&mut hessian, row, stored, block);
                add(&mut hessian, stored, row, &block.transpose());
            }
            add(&mut hessian, stored, stored, &curvature.stored);
        }
        let mut map = after * drift;
        if let (Some(t), Some(inputs)) = (&first.before, &inputs.before) {
            let before = kick::<X, U>(t, inputs);
            map *= &before;
            hessian = before.transpose() * hessian * before;
            if let Some(blocks) = &second.before {
                hessian += by_poses::<X, U>(blocks);
            }
            cross::<X, U>(&mut hessian, second.before_commands.as_ref());
        }
        if let Some(exchange) = inputs.exchange::<X>() {
            let mut exchanged = map.view_mut((pose(0), X), (3, U));
            exchanged += exchange.columns;
        }
        Self {
            a: map.fixed_view::<X, X>(0, 0).into_owned(),
            b: map.fixed_view::<X, U>(0, X).into_owned(),
            state: hessian.fixed_view::<X, X>(0, 0).into_owned(),
            mixed: hessian.fixed_view::<X, U>(0, X).into_owned(),
            command: hessian.fixed_view::<U, U>(X, X).into_owned(),
        }
    }
}
