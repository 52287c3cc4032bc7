//! Steps that are a kick, a drift and a kick: both schemes, for all motions.
//!
//! A kick over τ adds `τ (load + control)` to the momenta where poses are; a drift over h is free motion. Lie–Euler is a
//! drift and a whole kick, the LGVI a drift between two halves. For changes `p` of pose, `m` of momentum and `v` of command
//! a kick is `m⁺ = m + τ (G p + B v)`, a drift `p⁺ = P_p p + P_m m`, `m⁺ = M_m m`: first derivatives multiply. Second
//! derivatives of a composition are those of the later map, taken along the first derivatives of the earlier, and those of
//! the earlier in the direction of the multipliers before the later.

use std::array;

use lgvi_dynamics::BodyState;
use lgvi_dynamics::gravity::Field;
use lgvi_dynamics::rotation::Unsolvable;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::coordinates::{Blocks, Coordinates, Full, Variations};
use super::drift::{Drift, DriftGradient};
use super::{Curvature, Linearisation, Steps};
use crate::Transfer;
use crate::problem::Dynamics;

/// Steps of the coordinates `C` of a transfer's body.
pub(crate) struct KickDriftKick<'t, F, C, const N: usize, const U: usize> {
    transfer: &'t Transfer<F>,
    coordinates: C,
    /// `B`: force, moment or both of unit commands.
    commands: [SMatrix<f64, 3, U>; N],
    /// Length of the kick before the drift, if there is one.
    before: Option<f64>,
    /// Length of the kick after the drift.
    after: f64,
}

impl<'t, F: Field> KickDriftKick<'t, F, Full, 2, 6> {
    /// Those of position and attitude by the transfer's dynamics.
    pub(crate) fn full(transfer: &'t Transfer<F>) -> Self {
        let matrix = transfer.actuation.matrix();
        let commands = [0, 3].map(|row| matrix.fixed_rows::<3>(row).into_owned());
        Self::new(transfer, Full, commands)
    }
}

/// A step on its way to its last kick, with its first derivatives.
struct Passage<const N: usize> {
    /// Where the drift begins.
    begun: BodyState,
    /// Where it ends.
    drifted: BodyState,
    drifts: [Drift; N],
    gradients: [DriftGradient; N],
    /// `τ G` of the kick before the drift.
    before: Option<Blocks<N>>,
    /// `τ G` of the kick after it.
    after: Blocks<N>,
    /// Momenta at the end by momenta where the drift begins.
    carried: Blocks<N>,
}

/// Where in `z` the pose's coordinates of a block are; those of its momentum are three further on.
const fn row(block: usize) -> usize {
    6 * block
}

impl<'t, F: Field, C: Coordinates<N>, const N: usize, const U: usize>
    KickDriftKick<'t, F, C, N, U>
{
    pub(crate) fn new(
        transfer: &'t Transfer<F>,
        coordinates: C,
        commands: [SMatrix<f64, 3, U>; N],
    ) -> Self {
        let h = transfer.h;
        let (before, after) = match transfer.dynamics {
            Dynamics::LieEuler => (None, h),
            Dynamics::Lgvi => (Some(0.5 * h), 0.5 * h),
        };
        Self {
            transfer,
            coordinates,
            commands,
            before,
            after,
        }
    }

    fn controls(&self, command: &SVector<f64, U>) -> [Vector3<f64>; N] {
        self.commands.map(|columns| columns * command)
    }

    #[inline]
    fn kick(&self, tau: f64, controls: &[Vector3<f64>; N], state: &mut BodyState) {
        let Transfer { field, body, .. } = self.transfer;
        let loads = self.coordinates.load(field, body, state);
        let impulses = array::from_fn(|i| tau * (loads[i] + controls[i]));
        self.coordinates.kick(&impulses, state);
    }

    /// Where the drift of step `k` begins.
    #[inline]
    fn begin(&self, k: usize, state: &BodyState, controls: &[Vector3<f64>; N]) -> BodyState {
        let mut begun = self.coordinates.at(k, state);
        if let Some(tau) = self.before {
            self.kick(tau, controls, &mut begun);
        }
        begun
    }

    #[inline]
    fn drift(&self, k: usize, state: &mut BodyState) -> Result<[Drift; N], Unsolvable> {
        let Transfer { body, h, .. } = self.transfer;
        self.coordinates.drift(k, body, *h, state)
    }

    #[inline]
    fn gradient(&self, tau: f64, state: &BodyState) -> Blocks<N> {
        let Transfer { field, body, .. } = self.transfer;
        let gradient = self.coordinates.gradient(field, body, state);
        gradient.map(|row| row.map(|block| tau * block))
    }

    #[inline]
    fn kick_curvature(
        &self,
        tau: f64,
        state: &BodyState,
        weights: &[Vector3<f64>; N],
    ) -> Blocks<N> {
        let Transfer { field, body, .. } = self.transfer;
        let weights = weights.map(|weight| tau * weight);
        self.coordinates.curvature(field, body, state, &weights)
    }

    #[inline]
    fn passage(
        &self,
        k: usize,
        state: &BodyState,
        controls: &[Vector3<f64>; N],
    ) -> Result<Passage<N>, Unsolvable> {
        let begun = self.begin(k, state, controls);
        let mut drifted = begun;
        let drifts = self.drift(k, &mut drifted)?;
        let gradients = drifts.each_ref().map(Drift::gradient);
        let after = self.gradient(self.after, &drifted);
        let mut carried = [[Matrix3::zeros(); N]; N];
        for j in 0..N {
            for i in 0..N {
                [_, carried[i][j]] = gradients[j].before(&after[i][j]);
            }
            let [_, _, own] = gradients[j].matrices();
            carried[j][j] += own;
        }
        Ok(Passage {
            before: self.before.map(|tau| self.gradient(tau, &begun)),
            begun,
            drifted,
            drifts,
            gradients,
            after,
            carried,
        })
    }

    /// First derivatives of a step.
    #[inline]
    fn first<const X: usize>(&self, passage: &Passage<N>, into: &mut Linearisation<X, U>) {
        let Linearisation { a, b } = into;
        a.fill(0.0);
        b.fill(0.0);
        let mut set = |i: usize, j: usize, block: &Matrix3<f64>| {
            a.fixed_view_mut::<3, 3>(i, j).copy_from(block);
        };
        for j in 0..N {
            let drift = &passage.gradients[j];
            let [pose, pose_by_momentum, _] = drift.matrices();
            set(row(j), row(j), &pose);
            set(row(j), row(j) + 3, &pose_by_momentum);
            for i in 0..N {
                let [turned, _] = drift.before(&passage.after[i][j]);
                set(row(i) + 3, row(j), &turned);
                set(row(i) + 3, row(j) + 3, &passage.carried[i][j]);
            }
            b.fixed_rows_mut::<3>(row(j) + 3)
                .copy_from(&(self.after * self.commands[j]));
        }
        if let (Some(tau), Some(before)) = (self.before, &passage.before) {
            for k in 0..N {
                let momentum = row(k) + 3;
                let by_momentum = a.fixed_columns::<3>(momentum).into_owned();
                for j in 0..N {
                    let mut by_pose = a.fixed_columns_mut::<3>(row(j));
                    by_pose += by_momentum * before[k][j];
                }
                *b += by_momentum * (tau * self.commands[k]);
            }
        }
    }

    /// Second derivatives of `λ` times a step.
    #[inline]
    fn second<const X: usize>(
        &self,
        passage: &Passage<N>,
        lambda: &SVector<f64, X>,
        into: &mut Curvature<X, U>,
    ) {
        let part = |at: usize| lambda.fixed_rows::<3>(at).into_owned();
        let by_momentum: [_; N] = array::from_fn(|i| part(row(i) + 3));
        let by_pose: [_; N] = array::from_fn(|j| {
            (0..N).fold(part(row(j)), |sum, i| {
                sum + passage.after[i][j].tr_mul(&by_momentum[i])
            })
        });
        let Curvature {
            state,
            mixed,
            command,
        } = into;
        let kick = self.kick_curvature(self.after, &passage.drifted, &by_momentum);
        let mut set = |i: usize, j: usize, block: &Matrix3<f64>| {
            state.fixed_view_mut::<3, 3>(i, j).copy_from(block);
            state
                .fixed_view_mut::<3, 3>(j, i)
                .copy_from(&block.transpose());
        };
        for j in 0..N {
            let drift = &passage.gradients[j];
            let own = passage.drifts[j].curvature(drift, &by_pose[j], &by_momentum[j]);
            for i in 0..N {
                let [by_pose, by_momentum] = drift.before(&kick[i][j]);
                let earlier = &passage.gradients[i];
                let [pose_pose, _] = earlier.before(&by_pose.transpose());
                let [momentum_pose, momentum_momentum] = earlier.before(&by_momentum.transpose());
                let [mut momentum_pose, mut momentum_momentum] = [momentum_pose, momentum_momentum];
                if i == j {
                    momentum_pose += own.pose_momentum.transpose();
                    momentum_momentum += own.momentum_momentum;
                }
                set(row(j) + 3, row(i), &momentum_pose);
                if i <= j {
                    set(row(j), row(i), &pose_pose);
                    set(row(j) + 3, row(i) + 3, &momentum_momentum);
                }
            }
        }
        mixed.fill(0.0);
        command.fill(0.0);
        if let (Some(tau), Some(before)) = (self.before, &passage.before) {
            let weights = array::from_fn(|j| {
                let [_, pose_by_momentum, _] = passage.gradients[j].matrices();
                let own = pose_by_momentum.tr_mul(&part(row(j)));
                (0..N).fold(own, |sum, i| {
                    sum + passage.carried[i][j].tr_mul(&by_momentum[i])
                })
            });
            let kick = self.kick_curvature(tau, &passage.begun, &weights);
            for k in 0..N {
                let by_momentum = state.fixed_columns::<3>(row(k) + 3).into_owned();
                for j in 0..N {
                    let mut by_pose = state.fixed_columns_mut::<3>(row(j));
                    by_pose += by_momentum * before[k][j];
                }
            }
            for k in 0..N {
                let by_momentum = state.fixed_rows::<3>(row(k) + 3).into_owned();
                for i in 0..N {
                    let mut by_pose = state.fixed_rows_mut::<3>(row(i));
                    by_pose += before[k][i].transpose() * by_momentum;
                }
            }
            for i in 0..N {
                for j in 0..N {
                    let mut block = state.fixed_view_mut::<3, 3>(row(i), row(j));
                    block += kick[i][j];
                }
            }
            for k in 0..N {
                let by_momentum = state.fixed_columns::<3>(row(k) + 3).into_owned();
                *mixed += by_momentum * (tau * self.commands[k]);
            }
            for k in 0..N {
                let by_momentum = mixed.fixed_rows::<3>(row(k) + 3);
                *command += (tau * self.commands[k]).transpose() * by_momentum;
            }
        }
        state.fill_lower_triangle_with_upper_triangle();
        command.fill_lower_triangle_with_upper_triangle();
    }

    /// Where a step ends.
    fn end(&self, passage: &Passage<N>, controls: &[Vector3<f64>; N]) -> BodyState {
        let mut end = passage.drifted;
        self.kick(self.after, controls, &mut end);
        end
    }
}

impl<F: Field, C, const X: usize, const N: usize, const U: usize> Steps<X, U>
    for KickDriftKick<'_, F, C, N, U>
where
    C: Coordinates<N> + Variations<X>,
{
    fn next(
        &self,
        k: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
    ) -> Result<BodyState, Unsolvable> {
        let controls = self.controls(command);
        let mut state = self.begin(k, state, &controls);
        self.drift(k, &mut state)?;
        self.kick(self.after, &controls, &mut state);
        Ok(state)
    }

    fn linearise(
        &self,
        k: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
        into: &mut Linearisation<X, U>,
    ) -> Result<BodyState, Unsolvable> {
        let controls = self.controls(command);
        let passage = self.passage(k, state, &controls)?;
        self.first(&passage, into);
        Ok(self.end(&passage, &controls))
    }

    fn curvature(
        &self,
        k: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
        lambda: &SVector<f64, X>,
        into: &mut Curvature<X, U>,
    ) -> Result<(), Unsolvable> {
        let passage = self.passage(k, state, &self.controls(command))?;
        self.second(&passage, lambda, into);
        Ok(())
    }

    fn expand(
        &self,
        k: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
        lambda: &SVector<f64, X>,
        first: &mut Linearisation<X, U>,
        second: &mut Curvature<X, U>,
    ) -> Result<BodyState, Unsolvable> {
        let controls = self.controls(command);
        let passage = self.passage(k, state, &controls)?;
        self.first(&passage, first);
        self.second(&passage, lambda, second);
        Ok(self.end(&passage, &controls))
    }

    fn difference(&self, from: &BodyState, to: &BodyState) -> SVector<f64, X> {
        self.coordinates.difference(from, to)
    }

    fn moved(&self, state: &BodyState, z: &SVector<f64, X>) -> BodyState {
        self.coordinates.moved(state, z)
    }
}
