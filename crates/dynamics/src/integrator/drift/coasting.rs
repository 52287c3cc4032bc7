//! Drifts of bodies on which no moment acts.

use nalgebra::Vector3;

use super::super::StepError;
use super::super::rotor::BodyRotation;
use super::super::warm_start::Solutions;
use super::{Drift, Impulse, Kick, Mover, Movers, displace, kick_body, on};
use crate::rotation::Unsolvable;
use crate::{BodyState, Mobility, RigidBody};

/// Bodies on which no moment acts.
#[derive(Clone, Copy, Default)]
pub(in super::super) struct Coasting<'a> {
    /// Flags of these bodies, one per body, or empty if there are none.
    pub(in super::super) bodies: &'a [bool],
    /// Duration of their rotation in this drift.
    pub(in super::super) time: f64,
}

impl<T: BodyRotation> Mover<T> {
    /// Sets `next` to `state`, kicked, translated by the first time and rotated by the second.
    #[inline(always)]
    fn coast(
        &self,
        body: &RigidBody,
        (state, next): (&BodyState, &mut BodyState),
        impulse: Impulse,
        [h, turning]: [f64; 2],
        solutions: &mut Solutions<f64>,
    ) -> Result<u32, Unsolvable> {
        *next = *state;
        if let Some((load, dt)) = impulse {
            kick_body(body.mobility(), next, load, dt);
        }
        if let Mobility::Free = body.mobility() {
            displace(body, next, self.per_mass, h);
        }
        let (r, p) = (state.attitude, next.angular_momentum);
        if turning == 0.0 || p == Vector3::zeros() {
            return Ok(0);
        }
        if self.rotation.carry((&r, &p), turning, solutions, next) {
            return Ok(1);
        }
        self.rotation.carry_any(next, turning, solutions)
    }
}

/// Sets `next` to `states`, kicked and then moved by `h`, where some bodies coast. These rotate for a separate time,
/// and not at all if they are at rest.
#[inline(never)]
fn advance_coasting<'a>(
    movers: &[Mover<impl BodyRotation>],
    bodies: &[RigidBody],
    (states, next): (&[BodyState], &mut [BodyState]),
    kick: Kick,
    h: f64,
    solutions: impl Iterator<Item = Solutions<'a, f64>>,
    coasting: Coasting,
) -> Result<u32, StepError> {
    let mut most = 0;
    let each = movers.iter().zip(states).zip(next).zip(solutions);
    let each = each.zip(bodies.iter().zip(coasting.bodies));
    for (index, ((((mover, state), next), mut solutions), (body, coasts))) in each.enumerate() {
        let impulse = on(kick, index);
        let iterations = if *coasts {
            mover.coast(
                body,
                (state, &mut *next),
                impulse,
                [h, coasting.time],
                &mut solutions,
            )
        } else if mover.advance((state, &mut *next), impulse, h, &mut solutions) {
            Ok(1)
        } else {
            *next = *state;
            mover.advance_any(body, next, impulse, h, &mut solutions)
        };
        let iterations = iterations.map_err(|source| StepError::of_rotation(index, source))?;
        most = most.max(iterations);
    }
    Ok(most)
}

impl Drift {
    /// [`Drift::apply`] for the case that some bodies coast.
    #[cold]
    pub(super) fn coast(
        &mut self,
        bodies: &[RigidBody],
        states: (&[BodyState], &mut [BodyState]),
        kick: Kick,
        h: f64,
        stage: usize,
        with: Coasting,
    ) -> Result<u32, StepError> {
        let (movers, warm_start) = (&self.movers, &mut self.warm_start);
        match movers {
            Movers::Discrete(all) => {
                let solutions = warm_start.of_stage(stage);
                advance_coasting(all, bodies, states, kick, h, solutions, with)
            }
            Movers::Exact(all) => {
                let solutions = warm_start.of_stage(stage);
                advance_coasting(all, bodies, states, kick, h, solutions, with)
            }
            // Those that coast turn with the others.
            Movers::ActuatedDiscrete(_) | Movers::ActuatedExact(_) => {
                self.apply(bodies, states, kick, h, stage, Coasting::default())
            }
        }
    }
}
