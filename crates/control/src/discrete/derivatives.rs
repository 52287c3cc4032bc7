//! Derivatives of the parts of a step.

use lgvi_dynamics::BodyState;
use lgvi_dynamics::rotation::Unsolvable;
use nalgebra::{SVector, Vector3};

use super::KickDriftKick;
use super::coordinates::Coordinates;
use super::drift::Drift;
use super::linear::{Curvature, Linearization, OwnInputs, momentum, pose};

/// A step up to its last kick.
pub(super) struct Drifted<D> {
    /// The state at the beginning of the drift.
    begun: BodyState,
    /// The state at the end of the drift.
    pub(super) state: BodyState,
    turn: Option<D>,
}

impl<C: Coordinates<N>, const N: usize, const U: usize> KickDriftKick<'_, C, N, U> {
    #[inline(always)]
    pub(super) fn drifted(
        &self,
        k: usize,
        state: &BodyState,
        controls: &[Vector3<f64>; N],
    ) -> Result<Drifted<C::Drift>, Unsolvable> {
        let begun = self.begin(k, state, controls);
        let mut state = begun;
        let turn = self.drift(k, &mut state)?;
        Ok(Drifted { begun, state, turn })
    }

    /// First derivatives of step `k`.
    #[inline]
    pub(super) fn first(
        &self,
        k: usize,
        drifted: &Drifted<C::Drift>,
        controls: &[Vector3<f64>; N],
        into: &mut Linearization,
    ) {
        into.before = self
            .before
            .map(|tau| self.kick_gradient(tau, &drifted.begun, controls));
        into.glide = self.glide();
        if self.slows {
            let slowing = self.slowing(k, &drifted.begun);
            into.slowed = slowing.map(|slowing| Box::new(slowing.gradient()));
        } else if into.slowed.is_some() {
            into.slowed = None;
        }
        into.turn = drifted.turn.as_ref().map(|turn| turn.gradient(self.body()));
        if C::STORES {
            let both = drifted.turn.as_ref().zip(into.turn.as_ref());
            let stored = both.and_then(|(drift, turn)| drift.stored_gradient(turn));
            match (&mut into.stored, stored) {
                (Some(place), Some(stored)) => **place = stored,
                (place, stored) => *place = stored.map(Box::new),
            }
        }
        into.after = self.kick_gradient(self.after, &drifted.state, controls);
        if self.own_inputs {
            into.own = self.inputs_of(k, [&drifted.begun, &drifted.state]);
        } else {
            into.own = None;
        }
    }

    /// The derivative of `λ · Φ` of step `k` by the logarithm of the air's density.
    pub(crate) fn by_density<const X: usize>(
        &self,
        k: usize,
        state: &BodyState,
        command: &SVector<f64, U>,
        lambda: &SVector<f64, X>,
    ) -> Result<f64, Unsolvable> {
        let controls = self.controls(command);
        let drifted = self.drifted(k, state, &controls)?;
        let mut first = Linearization::default();
        self.first(k, &drifted, &controls, &mut first);
        let [after, _] = first.about_drift::<X, U>(lambda);
        let slowing = self.slowing(k, &drifted.begun);
        Ok(slowing.map_or(0.0, |slowing| {
            let [by_pose, by_momentum] = slowing.by_density();
            let part = |at: usize| after.fixed_rows::<3>(at);
            part(pose(0)).dot(&by_pose) + part(momentum(0)).dot(&by_momentum)
        }))
    }

    /// How the effects of the commands in step `k` differ from those in other steps; `states` are those at the two kicks.
    #[cold]
    #[inline(never)]
    fn inputs_of(&self, k: usize, states: [&BodyState; 2]) -> Option<OwnInputs> {
        let off = self.off_in(k);
        let frames = self.turns.then(|| states.map(|state| state.attitude));
        (self.turns || !off.is_none()).then_some(OwnInputs { frames, off })
    }

    /// Second derivatives of the product of `λ` and step `k` with the derivatives `first`.
    #[inline]
    pub(super) fn second<const X: usize>(
        &self,
        k: usize,
        drifted: &Drifted<C::Drift>,
        controls: &[Vector3<f64>; N],
        lambda: &SVector<f64, X>,
        first: &Linearization,
        into: &mut Curvature,
    ) {
        let [after, before] = first.about_drift::<X, U>(lambda);
        let weights = impulses(self.after, lambda);
        into.after = Some(self.kick_curvature(&drifted.state, controls, &weights));
        if self.turns {
            into.after_commands = Some(self.command_curvature(&drifted.state, &weights));
        } else {
            into.after_commands = None;
        }
        if self.slows {
            let part = |at: usize| after.fixed_rows::<3>(at).into_owned();
            let lambda = [part(pose(0)), part(momentum(0))];
            let slowing = self.slowing(k, &drifted.begun);
            into.slowed = slowing.map(|slowing| Box::new(slowing.curvature(&lambda)));
        } else if into.slowed.is_some() {
            into.slowed = None;
        }
        into.turn = drifted
            .turn
            .as_ref()
            .zip(first.turn.as_ref())
            .map(|(drift, turn)| {
                let last = 6 * (N - 1);
                let part = |at: usize| after.fixed_rows::<3>(at).into_owned();
                drift.curvature(self.body(), turn, &part(last), &part(last + 3))
            });
        if C::STORES {
            let part = |at: usize| after.fixed_rows::<3>(at).into_owned();
            let (third, fourth) = (part(pose(N - 1)), part(momentum(N - 1)));
            let drifts = drifted.turn.as_ref().zip(first.turn.as_ref());
            let all = drifts.zip(into.turn.as_ref());
            into.stored = all.and_then(|((drift, turn), own)| {
                drift
                    .stored_curvature(turn, own, &third, &fourth)
                    .map(Box::new)
            });
        }
        let weights = self.before.map(|tau| impulses(tau, &before));
        into.before =
            weights.map(|weights| self.kick_curvature(&drifted.begun, controls, &weights));
        if self.turns {
            into.before_commands =
                weights.map(|weights| self.command_curvature(&drifted.begun, &weights));
        } else {
            into.before_commands = None;
        }
    }
}

/// The multipliers of the loads that act over `tau` before the state that `lambda` belongs to.
#[inline]
fn impulses<const X: usize, const N: usize>(
    tau: f64,
    lambda: &SVector<f64, X>,
) -> [Vector3<f64>; N] {
    std::array::from_fn(|i| tau * lambda.fixed_rows::<3>(momentum(i)).into_owned())
}
