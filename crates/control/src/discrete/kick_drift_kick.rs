//! Steps that consist of a kick, a drift and a kick: both schemes, for all motions.
//!
//! A kick over τ adds `τ (load + control)` to the momenta at fixed poses; a drift over h is free motion. Lie–Euler is a
//! drift and a whole kick, the LGVI a drift between two half kicks. For variations `p` of pose, `m` of momentum and `v`
//! of command a kick is `m⁺ = m + τ (G p + B v)`, and a drift is `p⁺ = P_p p + P_m m`, `m⁺ = M_m m`.

use std::array;
use std::sync::Arc;

use lgvi_dynamics::drag::GlideDerivatives;
use lgvi_dynamics::rotation::Unsolvable;
use lgvi_dynamics::{BodyState, Load, RigidBody};
use lgvi_lie::hat;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::DiscreteDynamics;
use super::coordinates::{Coordinates, Full, Variations};
use super::linear::{
    Blocks, CommandRows, Curvature, Exchange, Inputs, KickInputs, Linearization, command_rows,
};
use crate::Transfer;
use crate::problem::{ByStep, Dynamics, Off};

/// Steps of the coordinates `C` of a transfer's body.
pub(crate) struct KickDriftKick<'t, C, const N: usize, const U: usize> {
    transfer: &'t Transfer,
    coordinates: C,
    /// `B`: force, moment or both of unit commands.
    pub(super) commands: [SMatrix<f64, 3, U>; N],
    /// Duration of the kick before the drift, if there is one.
    pub(super) before: Option<f64>,
    /// Duration of the kick after the drift.
    pub(super) after: f64,
    /// True if the first group of controls, the force, turns with the body.
    pub(super) turns: bool,
    /// Loads beside those of the commands, where forces turn with the body.
    known: Option<Arc<ByStep>>,
    /// True if the center of mass is planned and the body has drag.
    pub(super) slows: bool,
    /// What changes from step to step with the mass, if the body has drag.
    densities: Option<Arc<ByStep>>,
    /// True if the effects of the commands differ from step to step.
    pub(super) own_inputs: bool,
    /// The commands that are off in each step; empty if none ever is.
    off: Vec<Off>,
    /// `h N`: what unit commands exchange among the wheels, if that is planned.
    exchange: Option<Box<SMatrix<f64, 3, U>>>,
}

/// The ends of a step.
#[derive(Clone, Copy)]
enum End {
    Beginning,
    Ending,
}

impl<'t, const U: usize> KickDriftKick<'t, Full, 2, U> {
    /// The steps of position and attitude with the transfer's dynamics, under the first `U` commands of its actuation.
    pub(crate) fn full(transfer: &'t Transfer) -> Self {
        let matrix = transfer.actuation.matrix();
        let commands = [0, 3].map(|row| matrix.fixed_view::<3, U>(row, 0).into_owned());
        Self::new(transfer, Full, commands, transfer.off_by_step(Some))
    }
}

impl<'t, C: Coordinates<N>, const N: usize, const U: usize> KickDriftKick<'t, C, N, U> {
    pub(crate) fn new(
        transfer: &'t Transfer,
        coordinates: C,
        commands: [SMatrix<f64, 3, U>; N],
        off: Vec<Off>,
    ) -> Self {
        let h = transfer.h;
        let (before, after) = match transfer.dynamics {
            Dynamics::LieEuler => (None, h),
            Dynamics::Lgvi => (Some(0.5 * h), 0.5 * h),
        };
        let turns = N == 2 && transfer.actuation.is_fixed_to_body();
        let by_step = transfer.by_step.as_ref();
        let by_step = by_step.map(|by_step| by_step.in_intervals(transfer.intervals));
        Self {
            transfer,
            coordinates,
            commands,
            before,
            after,
            turns,
            known: by_step.clone().filter(|_| N == 2),
            slows: C::GLIDES && transfer.body.drag().is_some(),
            densities: by_step.filter(|_| transfer.body.drag().is_some()),
            own_inputs: turns || !off.is_empty(),
            off,
            exchange: None,
        }
    }

    /// The same with momenta that the wheels exchange among each other.
    pub(super) fn exchanging(mut self, per_time: &SMatrix<f64, 3, U>) -> Self {
        self.exchange = Some(Box::new(self.transfer.h * per_time));
        self
    }

    /// Completes the state at the end of a step that began at `start`: sets the momenta that the wheels exchange.
    #[inline(always)]
    fn settle(&self, start: &BodyState, command: &SVector<f64, U>, end: &mut BodyState) {
        if C::STORES
            && let Some(exchange) = &self.exchange
        {
            end.position = start.position + **exchange * command;
        }
    }

    /// The commands that are off in step `k`.
    pub(super) fn off_in(&self, k: usize) -> Off {
        self.off.get(k).copied().unwrap_or_default()
    }

    pub(super) fn controls(&self, command: &SVector<f64, U>) -> [Vector3<f64>; N] {
        self.commands.map(|columns| columns * command)
    }

    #[inline(always)]
    fn kick(
        &self,
        (k, end): (usize, End),
        tau: f64,
        controls: &[Vector3<f64>; N],
        state: &mut BodyState,
    ) {
        let Transfer { field, body, .. } = self.transfer;
        let loads = self.coordinates.load(field.as_ref(), body, state);
        let turned;
        let controls = if self.turns || self.known.is_some() {
            let known = self.known.as_deref().map(|known| &known.loads[k]);
            let attitude = self.turns.then_some(&state.attitude);
            turned = turned_force(controls, attitude, known, end);
            &turned
        } else {
            controls
        };
        let impulses = array::from_fn(|i| tau * (loads[i] + controls[i]));
        self.coordinates.kick(&impulses, state);
    }

    /// The state at the beginning of the drift of step `k`.
    #[inline(always)]
    pub(super) fn begin(
        &self,
        k: usize,
        state: &BodyState,
        controls: &[Vector3<f64>; N],
    ) -> BodyState {
        let mut begun = self.coordinates.at(k, state);
        if let Some(tau) = self.before {
            self.kick((k, End::Beginning), tau, controls, &mut begun);
        }
        begun
    }

    #[inline(always)]
    pub(super) fn drift(
        &self,
        k: usize,
        state: &mut BodyState,
    ) -> Result<Option<C::Drift>, Unsolvable> {
        let Transfer { body, h, .. } = self.transfer;
        self.coordinates
            .drift(k, body, [*h, self.density(k)], state)
    }

    pub(super) fn body(&self) -> &RigidBody {
        &self.transfer.body
    }

    /// The factor of the air's density in step `k`: with the momenta in proportion to the mass, drag is in proportion to its
    /// reciprocal.
    #[inline]
    fn density(&self, k: usize) -> f64 {
        self.densities.as_ref().map_or(1.0, |all| all.limits[k])
    }

    /// `h/m`, if the center of mass is planned and the body has no drag.
    #[inline]
    pub(super) fn glide(&self) -> Option<f64> {
        let Transfer { body, h, .. } = self.transfer;
        (C::GLIDES && !self.slows).then(|| h / body.mass())
    }

    /// The derivatives of the drift of the center of mass of step `k` from the state `begun`, if it is planned and the body has
    /// drag.
    #[cold]
    #[inline(never)]
    pub(super) fn slowing(&self, k: usize, begun: &BodyState) -> Option<GlideDerivatives> {
        let Transfer { body, h, .. } = self.transfer;
        let slowing = || body.glide_derivatives(begun, *h, self.density(k));
        self.slows.then(slowing).flatten()
    }

    /// `τ G`: first derivatives of a kick at `state` by poses. A force that turns with the body, `R f`, has `−R S(f)` by
    /// the attitude.
    #[inline(always)]
    pub(super) fn kick_gradient(
        &self,
        tau: f64,
        state: &BodyState,
        controls: &[Vector3<f64>; N],
    ) -> Blocks {
        let Transfer { field, body, .. } = self.transfer;
        let mut by_pose = self.coordinates.gradient(field.as_ref(), body, state);
        if self.turns {
            by_pose[0][1] -= state.attitude * hat(&controls[0]);
        }
        by_pose.iter_mut().flatten().for_each(|block| *block *= tau);
        by_pose
    }

    /// Second derivatives by poses of the product of `weights` and the loads at `state`. A force that turns with the body has
    /// `½ (l fᵀ + f lᵀ) − l · f I` by the attitude, where `l` is its weight in the body frame.
    #[inline(always)]
    pub(super) fn kick_curvature(
        &self,
        state: &BodyState,
        controls: &[Vector3<f64>; N],
        weights: &[Vector3<f64>; N],
    ) -> Blocks {
        let Transfer { field, body, .. } = self.transfer;
        let mut by_poses = self
            .coordinates
            .curvature(field.as_ref(), body, state, weights);
        if self.turns {
            let (weight, force) = (state.attitude.tr_mul(&weights[0]), &controls[0]);
            let outer = weight * force.transpose();
            by_poses[1][1] += 0.5 * (outer + outer.transpose())
                - Matrix3::from_diagonal_element(weight.dot(force));
        }
        by_poses
    }

    /// Second derivatives by attitude and commands of the product of `weights` and the forces at `state`, `−S(l) F`, if the
    /// forces turn with the body.
    #[inline]
    pub(super) fn command_curvature(
        &self,
        state: &BodyState,
        weights: &[Vector3<f64>; N],
    ) -> CommandRows {
        let weight = state.attitude.tr_mul(&weights[0]);
        command_rows(&(-hat(&weight) * self.commands[0]))
    }
}

/// Controls whose first is turned to the inertial frame if it is a force in the body frame, and the known loads at this end of the step.
#[cold]
#[inline(never)]
fn turned_force<const N: usize>(
    controls: &[Vector3<f64>; N],
    attitude: Option<&Matrix3<f64>>,
    known: Option<&[Load; 2]>,
    end: End,
) -> [Vector3<f64>; N] {
    let mut turned = *controls;
    if let Some(attitude) = attitude {
        turned[0] = attitude * turned[0];
    }
    if let Some(ends) = known {
        let load = &ends[end as usize];
        for (control, known) in turned.iter_mut().zip([load.force, load.moment]) {
            *control += known;
        }
    }
    turned
}

/// Removes the second derivatives by attitude and the commands that are off.
#[cold]
#[inline(never)]
fn shut(off: Off, curvature: &mut Curvature) {
    let commands = [
        &mut curvature.before_commands,
        &mut curvature.after_commands,
    ];
    for row in commands.into_iter().flatten().flatten() {
        let each = row.iter_mut().enumerate();
        each.filter(|(command, _)| off.contains(*command))
            .for_each(|(_, entry)| *entry = 0.0);
    }
}

impl<C, const X: usize, const N: usize, const U: usize> DiscreteDynamics<X, U>
    for KickDriftKick<'_, C, N, U>
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
        let mut end = self.begin(k, state, &controls);
        self.drift(k, &mut end)?;
        self.kick((k, End::Ending), self.after, &controls, &mut end);
        self.settle(state, command, &mut end);
        Ok(end)
    }

    fn inputs(&self) -> Inputs<U> {
        let columns = |tau: f64| {
            KickInputs::new(array::from_fn(|i| {
                let columns = self.commands.get(i);
                columns.map_or_else(SMatrix::zeros, |columns| tau * columns)
            }))
        };
        Inputs {
            before: self.before.map(columns),
            after: columns(self.after),
            exchange: self
                .exchange
                .as_ref()
                .map(|exchange| Box::new(Exchange::new(**exchange))),
        }
    }

    fn off(&self) -> &[Off] {
        &self.off
    }

    fn linearize(
        &self,
        k: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
        into: &mut Linearization,
    ) -> Result<BodyState, Unsolvable> {
        let controls = self.controls(command);
        let mut drifted = self.drifted(k, state, &controls)?;
        self.first(k, &drifted, &controls, into);
        self.kick((k, End::Ending), self.after, &controls, &mut drifted.state);
        self.settle(state, command, &mut drifted.state);
        Ok(drifted.state)
    }

    fn expand(
        &self,
        k: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
        lambda: &SVector<f64, X>,
        first: &mut Linearization,
        second: &mut Curvature,
    ) -> Result<BodyState, Unsolvable> {
        let controls = self.controls(command);
        let mut drifted = self.drifted(k, state, &controls)?;
        self.first(k, &drifted, &controls, first);
        self.second(k, &drifted, &controls, lambda, first, second);
        if self.own_inputs {
            shut(self.off_in(k), second);
        }
        self.kick((k, End::Ending), self.after, &controls, &mut drifted.state);
        self.settle(state, command, &mut drifted.state);
        Ok(drifted.state)
    }

    fn by_rotation_of_air(
        &self,
        k: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
    ) -> [Vector3<f64>; 2] {
        let begun = self.begin(k, state, &self.controls(command));
        let slowing = self.slowing(k, &begun);
        slowing.map_or_else(Default::default, |slowing| slowing.by_rotation())
    }

    fn difference(&self, from: &BodyState, to: &BodyState) -> SVector<f64, X> {
        self.coordinates.difference(from, to)
    }

    fn moved(&self, state: &BodyState, z: &SVector<f64, X>) -> BodyState {
        self.coordinates.moved(state, z)
    }

    fn complete(&self, states: &mut [BodyState]) {
        self.coordinates.complete(states);
    }
}
