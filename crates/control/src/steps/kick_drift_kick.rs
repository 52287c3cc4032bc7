//! Steps that are a kick, a drift and a kick: both schemes, for all motions.
//!
//! A kick over τ adds `τ (load + control)` to the momenta where poses are; a drift over h is free motion. Lie–Euler is a
//! drift and a whole kick, the LGVI a drift between two halves. With `z = [p, m]`, changes of pose and momentum,
//! a kick is `m⁺ = m + τ (G p + B v)` and a drift `p⁺ = P_p p + P_m m`, `m⁺ = M_m m`: first derivatives multiply. Second
//! derivatives of a composition are those of the later map, taken along the first derivatives of the earlier, and those of
//! the earlier in the direction of the multipliers before the later.

use lgvi_dynamics::BodyState;
use lgvi_dynamics::gravity::Field;
use lgvi_dynamics::rotation::Unsolvable;
use nalgebra::{SMatrix, SVector};

use super::coordinates::{Coordinates, Full, Variations};
use super::drift::DriftGradient;
use super::{Curvature, Linearisation, Steps};
use crate::Transfer;
use crate::problem::Dynamics;

/// Steps of the coordinates `C` of a transfer's body.
pub(crate) struct KickDriftKick<'t, F, C, const P: usize, const U: usize> {
    transfer: &'t Transfer<F>,
    coordinates: C,
    /// `B`: loads of unit commands.
    commands: SMatrix<f64, P, U>,
    /// Length of the kick before the drift, if there is one.
    before: Option<f64>,
    /// Length of the kick after the drift.
    after: f64,
}

/// Row of a coordinate of pose in `[δx, δγ, ζ, δΠ]` or in either half; that of its momentum is three rows on.
fn row(coordinate: usize) -> usize {
    6 * (coordinate / 3) + coordinate % 3
}

/// Where a step has arrived, with what its derivatives need.
struct Passage<D, const P: usize, const U: usize> {
    /// Where the drift begins.
    begun: BodyState,
    /// Where the drift ends.
    drifted: BodyState,
    drift: D,
    gradient: DriftGradient<P>,
    /// `τ G` and `τ B` of the kick before the drift.
    before: Option<(SMatrix<f64, P, P>, SMatrix<f64, P, U>)>,
    /// `τ G` of the kick after it.
    after: SMatrix<f64, P, P>,
}

impl<'t, F: Field, C: Coordinates<P>, const P: usize, const U: usize>
    KickDriftKick<'t, F, C, P, U>
{
    pub(crate) fn new(
        transfer: &'t Transfer<F>,
        coordinates: C,
        commands: SMatrix<f64, P, U>,
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

    fn kick(&self, tau: f64, control: &SVector<f64, P>, state: &mut BodyState) {
        let load = self
            .coordinates
            .load(&self.transfer.field, &self.transfer.body, state);
        self.coordinates.kick(&(tau * (load + control)), state);
    }

    /// Where the drift of step `k` begins.
    fn begin(&self, k: usize, state: &BodyState, control: &SVector<f64, P>) -> BodyState {
        let mut begun = self.coordinates.at(k, state);
        if let Some(tau) = self.before {
            self.kick(tau, control, &mut begun);
        }
        begun
    }

    fn kick_gradient(&self, tau: f64, state: &BodyState) -> SMatrix<f64, P, P> {
        let Transfer { field, body, .. } = self.transfer;
        tau * self.coordinates.gradient(field, body, state)
    }

    fn kick_curvature(
        &self,
        tau: f64,
        state: &BodyState,
        weights: &SVector<f64, P>,
    ) -> SMatrix<f64, P, P> {
        let Transfer { field, body, .. } = self.transfer;
        self.coordinates
            .curvature(field, body, state, &(tau * weights))
    }

    fn passage(
        &self,
        k: usize,
        state: &BodyState,
        control: &SVector<f64, P>,
    ) -> Result<Passage<C::Drift, P, U>, Unsolvable> {
        let (body, h) = (&self.transfer.body, self.transfer.h);
        let begun = self.begin(k, state, control);
        let mut drifted = begun;
        let drift = self.coordinates.drift(k, body, h, &mut drifted)?;
        Ok(Passage {
            gradient: self.coordinates.drift_gradient(body, h, &drift),
            before: self
                .before
                .map(|tau| (self.kick_gradient(tau, &begun), tau * self.commands)),
            after: self.kick_gradient(self.after, &drifted),
            begun,
            drifted,
            drift,
        })
    }
}

impl<F: Field, C, const X: usize, const P: usize, const U: usize> Steps<X, U>
    for KickDriftKick<'_, F, C, P, U>
where
    C: Coordinates<P> + Variations<X>,
{
    fn next(
        &self,
        k: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
    ) -> Result<BodyState, Unsolvable> {
        let control = self.commands * command;
        let mut state = self.begin(k, state, &control);
        let (body, h) = (&self.transfer.body, self.transfer.h);
        self.coordinates.drift(k, body, h, &mut state)?;
        self.kick(self.after, &control, &mut state);
        Ok(state)
    }

    fn linearise(
        &self,
        k: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
        into: &mut Linearisation<X, U>,
    ) -> Result<BodyState, Unsolvable> {
        let control = self.commands * command;
        let passage = self.passage(k, state, &control)?;
        let DriftGradient {
            pose_by_pose,
            pose_by_momentum,
            momentum_by_momentum,
        } = passage.gradient;
        let momentum_by_momentum = momentum_by_momentum + passage.after * pose_by_momentum;
        let mut pose = [pose_by_pose, pose_by_momentum];
        let mut momentum = [passage.after * pose_by_pose, momentum_by_momentum];
        let mut commands = [SMatrix::zeros(), self.after * self.commands];
        if let Some((gradient, by_command)) = passage.before {
            pose[0] += pose_by_momentum * gradient;
            momentum[0] += momentum_by_momentum * gradient;
            commands[0] = pose_by_momentum * by_command;
            commands[1] += momentum_by_momentum * by_command;
        }
        for i in 0..P {
            for j in 0..P {
                for by in [0, 1] {
                    into.a[(row(i), row(j) + 3 * by)] = pose[by][(i, j)];
                    into.a[(row(i) + 3, row(j) + 3 * by)] = momentum[by][(i, j)];
                }
            }
            for j in 0..U {
                into.b[(row(i), j)] = commands[0][(i, j)];
                into.b[(row(i) + 3, j)] = commands[1][(i, j)];
            }
        }
        let mut end = passage.drifted;
        self.kick(self.after, &control, &mut end);
        Ok(end)
    }

    fn curvature(
        &self,
        k: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
        lambda: &SVector<f64, X>,
        into: &mut Curvature<X, U>,
    ) -> Result<(), Unsolvable> {
        let control = self.commands * command;
        let passage = self.passage(k, state, &control)?;
        let drift = &passage.gradient;
        let by_momentum = SVector::from_fn(|i, _| lambda[row(i) + 3]);
        let by_pose = SVector::from_fn(|i, _| lambda[row(i)]) + passage.after.tr_mul(&by_momentum);
        let own = self
            .coordinates
            .drift_curvature(&passage.drift, drift, &by_pose, &by_momentum);
        let after = self.kick_curvature(self.after, &passage.drifted, &by_momentum);
        let along = after * drift.pose_by_momentum;
        let mut pose_pose = drift.pose_by_pose.tr_mul(&(after * drift.pose_by_pose));
        let mut pose_momentum = drift.pose_by_pose.tr_mul(&along) + own.pose_momentum;
        let mut momentum_momentum = drift.pose_by_momentum.tr_mul(&along) + own.momentum_momentum;
        let mut mixed = [SMatrix::zeros(); 2];
        into.command.fill(0.0);
        if let (Some(tau), Some((gradient, by_command))) = (self.before, &passage.before) {
            let weights = drift.pose_by_momentum.tr_mul(&by_pose)
                + drift.momentum_by_momentum.tr_mul(&by_momentum);
            let kicked = pose_momentum * gradient;
            let carried = gradient.tr_mul(&momentum_momentum);
            pose_pose += kicked
                + kicked.transpose()
                + carried * gradient
                + self.kick_curvature(tau, &passage.begun, &weights);
            pose_momentum += carried;
            mixed = [pose_momentum * by_command, momentum_momentum * by_command];
            into.command = by_command.tr_mul(&mixed[1]);
        }
        into.command.fill_lower_triangle_with_upper_triangle();
        pose_pose.fill_lower_triangle_with_upper_triangle();
        momentum_momentum.fill_lower_triangle_with_upper_triangle();
        for i in 0..P {
            for j in 0..P {
                into.state[(row(i), row(j))] = pose_pose[(i, j)];
                into.state[(row(i), row(j) + 3)] = pose_momentum[(i, j)];
                into.state[(row(j) + 3, row(i))] = pose_momentum[(i, j)];
                into.state[(row(i) + 3, row(j) + 3)] = momentum_momentum[(i, j)];
            }
            for j in 0..U {
                into.mixed[(row(i), j)] = mixed[0][(i, j)];
                into.mixed[(row(i) + 3, j)] = mixed[1][(i, j)];
            }
        }
        Ok(())
    }

    fn difference(&self, from: &BodyState, to: &BodyState) -> SVector<f64, X> {
        self.coordinates.difference(from, to)
    }

    fn moved(&self, state: &BodyState, z: &SVector<f64, X>) -> BodyState {
        self.coordinates.moved(state, z)
    }
}

impl<'t, F: Field> KickDriftKick<'t, F, Full, 6, 6> {
    /// Those of position and attitude by the transfer's dynamics.
    pub(crate) fn full(transfer: &'t Transfer<F>) -> Self {
        Self::new(transfer, Full, *transfer.actuation.matrix())
    }
}
