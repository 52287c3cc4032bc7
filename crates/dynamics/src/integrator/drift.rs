use lgvi_lie::{compose, rotate_back};
use nalgebra::Vector3;

use super::turn::Turn;
use super::{Rotor, StepError};
use crate::{BodyState, Load, Mobility, RigidBody};

/// Free motion of all bodies over a time, `x ← x + (h/m) γ`, `R ← R F`, `Π ← Fᵀ Π`, for each of the drifts in a step.
pub(super) struct Drift {
    rotor: Rotor,
    /// Starting guesses, stage after stage, in each body after body.
    turns: Vec<Turn>,
    /// Solutions of the present step, in the same order.
    relative: Vec<Vector3<f64>>,
}

impl Drift {
    /// For `stages` drifts a step.
    pub(super) fn new(rotor: Rotor, bodies: &[RigidBody], stages: usize) -> Self {
        let count = stages * bodies.len();
        Self {
            rotor,
            turns: vec![Turn::default(); count],
            relative: vec![Vector3::zeros(); count],
        }
    }

    /// Forgets the trajectory so far.
    pub(super) fn start(&mut self) {
        self.turns.iter_mut().for_each(Turn::forget);
    }

    /// Moves `states` by `h`; returns the most Newton corrections a body took.
    pub(super) fn apply(
        &mut self,
        bodies: &[RigidBody],
        states: &mut [BodyState],
        stage: usize,
        h: f64,
    ) -> Result<u32, StepError> {
        let Rotor::Discrete(chart) = self.rotor;
        let mut iterations = 0;
        let first = stage * bodies.len();
        for (index, (body, state)) in bodies.iter().zip(states).enumerate() {
            match body.mobility() {
                Mobility::Free => state.position += (h / body.mass()) * state.linear_momentum,
                Mobility::Pivoted => {}
                Mobility::Fixed => continue,
                Mobility::Driven(drive) => {
                    *state = drive.advance(body, state, h);
                    continue;
                }
            }
            let g = h * state.angular_momentum;
            let relative = self.turns[first + index]
                .solve(chart, body.inertia(), &g)
                .map_err(|source| StepError::Unsolvable {
                    body: index,
                    source,
                })?;
            state.attitude = compose(&state.attitude, &relative.cayley);
            state.angular_momentum = rotate_back(&relative.cayley, &state.angular_momentum);
            iterations = iterations.max(relative.iterations);
            self.relative[first + index] = relative.cayley;
        }
        Ok(iterations)
    }

    /// Takes the last drifts as part of an accepted step: later starting guesses build on them.
    pub(super) fn accept(&mut self) {
        for (turn, cayley) in self.turns.iter_mut().zip(&self.relative) {
            turn.remember(*cayley);
        }
    }
}

/// Adds the impulse of gravity and controls over `dt` to the momenta.
pub(super) fn kick(
    bodies: &[RigidBody],
    states: &mut [BodyState],
    gravity: &[Load],
    controls: &[Load],
    dt: f64,
) {
    let loads = gravity.iter().zip(controls);
    for ((body, state), (&load, &control)) in bodies.iter().zip(states).zip(loads) {
        let load = load + control;
        match body.mobility() {
            Mobility::Free => {
                state.linear_momentum += dt * load.force;
                state.angular_momentum += dt * load.moment;
            }
            Mobility::Pivoted => state.angular_momentum += dt * load.moment,
            Mobility::Fixed | Mobility::Driven(_) => {}
        }
    }
}
