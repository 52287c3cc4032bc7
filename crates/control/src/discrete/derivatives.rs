//! Derivatives of a step, composed of those of its kicks and its drift.
//!
//! First derivatives are multiplied. The second derivatives of a composition are those of the later map, taken along
//! the first derivatives of the earlier map, plus those of the earlier map in the direction of the multipliers before
//! the later map.

use std::array;

use lgvi_dynamics::BodyState;
use lgvi_dynamics::rotation::Unsolvable;
use nalgebra::{Matrix3, SVector, Vector3};

use super::coordinates::{Blocks, Coordinates};
use super::drift::{Drift, DriftGradient};
use super::kick::{Kick, momentum, pose};
use super::{Curvature, KickDriftKick, Linearization};

/// A step up to its last kick, with the first derivatives of its parts.
pub(super) struct StepDerivatives<'s, C, const N: usize, const U: usize> {
    steps: &'s KickDriftKick<'s, C, N, U>,
    /// The state at the beginning of the drift.
    begun: BodyState,
    /// The state at the end of the drift.
    drifted: BodyState,
    drifts: [Drift; N],
    gradients: [DriftGradient; N],
    /// The kick before the drift, if there is one.
    before: Option<Kick<'s, N, U>>,
    /// The kick after the drift.
    after: Kick<'s, N, U>,
    /// Derivatives of the final momenta by the momenta at the beginning of the drift.
    carried: Blocks<N>,
}

impl<'s, C: Coordinates<N>, const N: usize, const U: usize> StepDerivatives<'s, C, N, U> {
    #[inline(always)]
    pub(super) fn new(
        steps: &'s KickDriftKick<'s, C, N, U>,
        k: usize,
        state: &BodyState,
        controls: &[Vector3<f64>; N],
    ) -> Result<Self, Unsolvable> {
        let begun = steps.begin(k, state, controls);
        let mut drifted = begun;
        let drifts = steps.drift(k, &mut drifted)?;
        let gradients: [DriftGradient; N] = array::from_fn(|i| drifts[i].gradient());
        let after = steps.kick_gradient(steps.after, &drifted);
        let mut carried = [[Matrix3::zeros(); N]; N];
        for (i, row) in carried.iter_mut().enumerate() {
            for (j, block) in row.iter_mut().enumerate() {
                [_, *block] = gradients[j].before(&after.by_pose[i][j]);
            }
            let [_, _, own] = gradients[i].matrices();
            row[i] += own;
        }
        Ok(Self {
            steps,
            before: steps.before.map(|tau| steps.kick_gradient(tau, &begun)),
            begun,
            drifted,
            drifts,
            gradients,
            after,
            carried,
        })
    }

    /// First derivatives of a step.
    #[inline(always)]
    pub(super) fn first<const X: usize>(&self, into: &mut Linearization<X, U>) {
        let Linearization { a, b } = into;
        a.fill(0.0);
        b.fill(0.0);
        let mut set = |row: usize, column: usize, block: &Matrix3<f64>| {
            a.fixed_view_mut::<3, 3>(row, column).copy_from(block);
        };
        for (j, drift) in self.gradients.iter().enumerate() {
            let [pose_by_pose, pose_by_momentum, _] = drift.matrices();
            set(pose(j), pose(j), &pose_by_pose);
            set(pose(j), momentum(j), &pose_by_momentum);
            for i in 0..N {
                let [turned, _] = drift.before(&self.after.by_pose[i][j]);
                set(momentum(i), pose(j), &turned);
                set(momentum(i), momentum(j), &self.carried[i][j]);
            }
            b.fixed_rows_mut::<3>(momentum(j))
                .copy_from(&(self.steps.after * self.steps.commands[j]));
        }
        if let Some(before) = &self.before {
            before.precede(into);
        }
    }

    /// Second derivatives of the product of `λ` and a step.
    #[inline(always)]
    pub(super) fn second<const X: usize>(
        &self,
        lambda: &SVector<f64, X>,
        into: &mut Curvature<X, U>,
    ) {
        let part = |at: usize| lambda.fixed_rows::<3>(at).into_owned();
        let by_momentum: [_; N] = array::from_fn(|i| part(momentum(i)));
        let by_pose: [_; N] = array::from_fn(|j| {
            (0..N).fold(part(pose(j)), |sum, i| {
                sum + self.after.by_pose[i][j].tr_mul(&by_momentum[i])
            })
        });
        let kick = self
            .steps
            .kick_curvature(self.steps.after, &self.drifted, &by_momentum);
        into.mixed.fill(0.0);
        into.command.fill(0.0);
        let mut set = |row: usize, column: usize, transposed: &Matrix3<f64>| {
            let state = &mut into.state;
            state
                .fixed_view_mut::<3, 3>(column, row)
                .copy_from(transposed);
            state
                .fixed_view_mut::<3, 3>(row, column)
                .copy_from(&transposed.transpose());
        };
        for (j, drift) in self.gradients.iter().enumerate() {
            let own = self.drifts[j].curvature(drift, &by_pose[j], &by_momentum[j]);
            for (i, other) in self.gradients.iter().enumerate() {
                let [by_pose, by_momentum] = drift.before(&kick[i][j]);
                let [pose_pose, _] = other.before(&by_pose.transpose());
                let [mut momentum_pose, mut momentum_momentum] =
                    other.before(&by_momentum.transpose());
                if i == j {
                    momentum_pose += own.pose_momentum.transpose();
                    momentum_momentum += own.momentum_momentum;
                }
                set(pose(i), momentum(j), &momentum_pose);
                if i <= j {
                    set(pose(i), pose(j), &pose_pose);
                    set(momentum(i), momentum(j), &momentum_momentum);
                }
            }
        }
        if let (Some(tau), Some(before)) = (self.steps.before, &self.before) {
            let weights = array::from_fn(|j| {
                let [_, pose_by_momentum, _] = self.gradients[j].matrices();
                let own = pose_by_momentum.tr_mul(&part(pose(j)));
                (0..N).fold(own, |sum, i| {
                    sum + self.carried[i][j].tr_mul(&by_momentum[i])
                })
            });
            let own = self.steps.kick_curvature(tau, &self.begun, &weights);
            before.precede_twice(&own, into);
        }
        into.state.fill_lower_triangle_with_upper_triangle();
        into.command.fill_lower_triangle_with_upper_triangle();
    }

    /// The state at the end of the step.
    pub(super) fn end(&self, controls: &[Vector3<f64>; N]) -> BodyState {
        let mut end = self.drifted;
        self.steps.kick(self.steps.after, controls, &mut end);
        end
    }
}
