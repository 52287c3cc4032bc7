use nalgebra::Vector3;

use super::kepler;
use crate::{BodyState, Load, Mobility, RigidBody, StepError};

/// Kepler's motion of each free body about a center at rest: `A = |γ|²/2m − m GM/|x − c|`.
pub(super) struct Center {
    pub(super) gm: f64,
    pub(super) place: Place,
}

/// Where a center is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    /// At a fixed source.
    At(Vector3<f64>),
    /// At a fixed body.
    Body(usize),
}

impl Center {
    fn position(&self, states: &[BodyState]) -> Vector3<f64> {
        match self.place {
            Place::At(position) => position,
            Place::Body(index) => states[index].position,
        }
    }

    /// Moves the free bodies by `h`.
    #[inline]
    pub(super) fn drift(
        &self,
        bodies: &[RigidBody],
        states: &mut [BodyState],
        h: f64,
    ) -> Result<(), StepError> {
        let center = self.position(states);
        for (index, (body, state)) in bodies.iter().zip(states).enumerate() {
            if *body.mobility() == Mobility::Free {
                let velocity = state.linear_momentum / body.mass();
                let [moved, turned] =
                    kepler::advance(self.gm, &(state.position - center), &velocity, h)
                        .map_err(|obstacle| obstacle.on(index))?;
                state.position += moved;
                state.linear_momentum += body.mass() * turned;
            }
        }
        Ok(())
    }

    /// Subtracts the attraction of the center from the loads.
    #[inline]
    pub(super) fn subtract(&self, bodies: &[RigidBody], states: &[BodyState], loads: &mut [Load]) {
        let center = self.position(states);
        for ((body, state), load) in bodies.iter().zip(states).zip(loads) {
            if *body.mobility() == Mobility::Free {
                let d = state.position - center;
                let squared = d.norm_squared();
                load.force += (self.gm * body.mass() / (squared * squared.sqrt())) * d;
            }
        }
    }
}
