//! Steps of one half of a body's motion, with the other half taken from the free flight.
//!
//! # Assumptions and limitations
//! The other half is frozen: the effect of the planned half on it through gravity is neglected. (Gravity turns a body
//! differently at another point of its orbit, and pulls it differently at another attitude.) For a body of size ρ at
//! the distance r this effect is of the order `(ρ/r)²` of the loads. The full propagator misses a plan's end by that
//! amount, which the solver checks.

use lgvi_dynamics::gravity::Field;
use lgvi_dynamics::rotation::Unsolvable;
use lgvi_dynamics::{BodyState, Load, RigidBody};
use lgvi_lie::{exp, log};
use nalgebra::{Matrix3, SVector, Vector3};
use thiserror::Error;

use super::commands::{CommandsError, DecoupledCommands};
use super::coordinates::{Coordinates, Full, Variations, symmetric};
use super::drift::RotationDrift;
use super::linear::Blocks;
use super::{DiscreteDynamics, KickDriftKick};
use crate::Transfer;

/// The reason why one half of a motion cannot be planned separately.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum DecouplingError {
    /// The body turns too far in a step of the free flight that the other half follows.
    #[error("step {step} of the free flight: {source}")]
    Unsolvable {
        /// The step, from 0.
        step: usize,
        /// The turn that is too large.
        source: Unsolvable,
    },
    /// The free flight overflows or hits a source.
    #[error("step {step} of the free flight: the state is not finite")]
    NotFinite {
        /// The step, from 0.
        step: usize,
    },
    /// The actuation has no suitable commands.
    #[error(transparent)]
    Commands(#[from] CommandsError),
}

/// The center of mass. Attitude and angular momentum follow the free flight.
pub(crate) struct TranslationOnly {
    history: Vec<BodyState>,
}

/// The attitude. Position and linear momentum follow the free flight.
pub(crate) struct RotationOnly {
    history: Vec<BodyState>,
}

/// The states at `0 … N` of the transfer's body without control.
fn free_flight(transfer: &Transfer) -> Result<Vec<BodyState>, DecouplingError> {
    let steps = KickDriftKick::<_, 2, 6>::full(transfer);
    let mut state = transfer.initial;
    let mut history = Vec::with_capacity(transfer.intervals + 1);
    history.push(state);
    for step in 0..transfer.intervals {
        state = steps
            .next(step, &state, &SVector::zeros())
            .map_err(|source| DecouplingError::Unsolvable { step, source })?;
        if !state.is_finite() {
            return Err(DecouplingError::NotFinite { step });
        }
        history.push(state);
    }
    Ok(history)
}

impl<'t> KickDriftKick<'t, TranslationOnly, 1, 3> {
    /// The steps of the center of mass under the actuation's forces.
    pub(crate) fn translation(
        transfer: &'t Transfer,
        commands: &DecoupledCommands,
    ) -> Result<Self, DecouplingError> {
        let history = free_flight(transfer)?;
        Ok(Self::new(
            transfer,
            TranslationOnly { history },
            [*commands.matrix()],
            transfer.off_by_step(|own| commands.index(own)),
        ))
    }
}

impl<'t> KickDriftKick<'t, RotationOnly, 1, 3> {
    /// The steps of the attitude under the actuation's moments.
    pub(crate) fn rotation(
        transfer: &'t Transfer,
        commands: &DecoupledCommands,
    ) -> Result<Self, DecouplingError> {
        let history = free_flight(transfer)?;
        Ok(Self::new(
            transfer,
            RotationOnly { history },
            [*commands.matrix()],
            transfer.off_by_step(|own| commands.index(own)),
        ))
    }
}

impl TranslationOnly {
    /// `state` with the rotational half of the free flight at step `k`.
    fn joined(&self, k: usize, state: &BodyState) -> BodyState {
        BodyState {
            position: state.position,
            linear_momentum: state.linear_momentum,
            ..self.history[k]
        }
    }
}

impl RotationOnly {
    /// `state` with the translational half of the free flight at step `k`.
    fn joined(&self, k: usize, state: &BodyState) -> BodyState {
        BodyState {
            attitude: state.attitude,
            angular_momentum: state.angular_momentum,
            ..self.history[k]
        }
    }
}

/// The derivatives of a single group.
#[inline]
fn alone(block: Matrix3<f64>) -> Blocks {
    let none = Matrix3::zeros();
    [[block, none], [none, none]]
}

impl Coordinates<1> for TranslationOnly {
    type Drift = RotationDrift;
    const GLIDES: bool = true;

    fn at(&self, k: usize, state: &BodyState) -> BodyState {
        self.joined(k, state)
    }

    fn drift(
        &self,
        k: usize,
        body: &RigidBody,
        [h, density]: [f64; 2],
        state: &mut BodyState,
    ) -> Result<Option<RotationDrift>, Unsolvable> {
        body.glide(state, h, density);
        *state = self.joined(k + 1, state);
        Ok(None)
    }

    fn kick(&self, [force]: &[Vector3<f64>; 1], state: &mut BodyState) {
        state.linear_momentum += force;
    }

    fn load(&self, field: &dyn Field, body: &RigidBody, state: &BodyState) -> [Vector3<f64>; 1] {
        let [force, _] = Full.load(field, body, state);
        [force]
    }

    fn gradient(&self, field: &dyn Field, body: &RigidBody, state: &BodyState) -> Blocks {
        let gradient = field.gradient(body, &state.position, &state.attitude);
        alone(gradient.force_by_position)
    }

    fn curvature(
        &self,
        field: &dyn Field,
        body: &RigidBody,
        state: &BodyState,
        &[force]: &[Vector3<f64>; 1],
    ) -> Blocks {
        let moment = Vector3::zeros();
        let weights = Load { force, moment };
        let curvature = field.curvature(body, &state.position, &state.attitude, &weights);
        alone(curvature.position_position)
    }
}

impl Variations<6> for TranslationOnly {
    fn difference(&self, from: &BodyState, to: &BodyState) -> SVector<f64, 6> {
        let position = to.position - from.position;
        let momentum = to.linear_momentum - from.linear_momentum;
        SVector::from_iterator(position.iter().chain(&momentum).copied())
    }

    fn moved(&self, state: &BodyState, z: &SVector<f64, 6>) -> BodyState {
        BodyState {
            position: state.position + z.fixed_rows::<3>(0),
            linear_momentum: state.linear_momentum + z.fixed_rows::<3>(3),
            ..*state
        }
    }
}

impl Coordinates<1> for RotationOnly {
    type Drift = RotationDrift;
    const GLIDES: bool = false;

    fn at(&self, k: usize, state: &BodyState) -> BodyState {
        self.joined(k, state)
    }

    fn drift(
        &self,
        k: usize,
        body: &RigidBody,
        [h, _]: [f64; 2],
        state: &mut BodyState,
    ) -> Result<Option<RotationDrift>, Unsolvable> {
        let turn = RotationDrift::new(body, h, state)?;
        *state = self.joined(k + 1, state);
        Ok(Some(turn))
    }

    fn kick(&self, [moment]: &[Vector3<f64>; 1], state: &mut BodyState) {
        state.angular_momentum += moment;
    }

    fn load(&self, field: &dyn Field, body: &RigidBody, state: &BodyState) -> [Vector3<f64>; 1] {
        let [_, moment] = Full.load(field, body, state);
        [moment]
    }

    fn gradient(&self, field: &dyn Field, body: &RigidBody, state: &BodyState) -> Blocks {
        let gradient = field.gradient(body, &state.position, &state.attitude);
        alone(gradient.moment_by_attitude)
    }

    fn curvature(
        &self,
        field: &dyn Field,
        body: &RigidBody,
        state: &BodyState,
        &[moment]: &[Vector3<f64>; 1],
    ) -> Blocks {
        let force = Vector3::zeros();
        let weights = Load { force, moment };
        let curvature = field.curvature(body, &state.position, &state.attitude, &weights);
        alone(symmetric(&curvature.attitude_attitude))
    }
}

impl Variations<6> for RotationOnly {
    fn difference(&self, from: &BodyState, to: &BodyState) -> SVector<f64, 6> {
        let turn = log(&from.attitude.tr_mul(&to.attitude));
        let momentum = to.angular_momentum - from.angular_momentum;
        SVector::from_iterator(turn.iter().chain(&momentum).copied())
    }

    fn moved(&self, state: &BodyState, z: &SVector<f64, 6>) -> BodyState {
        BodyState {
            attitude: state.attitude * exp(&z.fixed_rows::<3>(0).into_owned()),
            angular_momentum: state.angular_momentum + z.fixed_rows::<3>(3),
            ..*state
        }
    }
}
