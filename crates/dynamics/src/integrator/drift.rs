use lgvi_lie::{compose, rotate_back};
use nalgebra::Vector3;

use super::StepError;
use super::turn::Turn;
use crate::rotation::{Chart, RelativeRotation};
use crate::{BodyState, Load, RigidBody};

/// Free motion of all bodies over one step, `x ← x + (h/m) γ`, `R ← R F`, `Π ← Fᵀ Π` with `F J_d − J_d Fᵀ = h S(Π)`: the
/// part that the variational integrators share.
pub(super) struct Drift {
    h: f64,
    chart: Chart,
    turns: Vec<Turn>,
    relative: Vec<RelativeRotation>,
}

impl Drift {
    pub(super) fn new(h: f64, chart: Chart, bodies: usize) -> Self {
        let identity = RelativeRotation {
            cayley: Vector3::zeros(),
            iterations: 0,
        };
        Self {
            h,
            chart,
            turns: vec![Turn::default(); bodies],
            relative: vec![identity; bodies],
        }
    }

    /// Forgets the trajectory so far.
    pub(super) fn start(&mut self) {
        self.turns.iter_mut().for_each(Turn::forget);
    }

    /// Moves `states`; returns the most Newton corrections a body took.
    pub(super) fn apply(
        &mut self,
        bodies: &[RigidBody],
        states: &mut [BodyState],
    ) -> Result<u32, StepError> {
        let mut iterations = 0;
        for (index, (body, state)) in bodies.iter().zip(states).enumerate() {
            let g = self.h * state.angular_momentum;
            let relative = self.turns[index]
                .solve(self.chart, body.inertia(), &g)
                .map_err(|source| StepError::Unsolvable {
                    body: index,
                    source,
                })?;
            state.position += (self.h / body.mass()) * state.linear_momentum;
            state.attitude = compose(&state.attitude, &relative.cayley);
            state.angular_momentum = rotate_back(&relative.cayley, &state.angular_momentum);
            iterations = iterations.max(relative.iterations);
            self.relative[index] = relative;
        }
        Ok(iterations)
    }

    /// Takes the last drift as part of an accepted step: later starting guesses build on it.
    pub(super) fn accept(&mut self) {
        for (turn, relative) in self.turns.iter_mut().zip(&self.relative) {
            turn.remember(relative.cayley);
        }
    }
}

/// Adds the impulse of gravity and controls over `dt` to the momenta.
pub(super) fn kick(states: &mut [BodyState], gravity: &[Load], controls: &[Load], dt: f64) {
    for ((state, &load), &control) in states.iter_mut().zip(gravity).zip(controls) {
        let load = load + control;
        state.linear_momentum += dt * load.force;
        state.angular_momentum += dt * load.moment;
    }
}
