use lgvi_dynamics::{BodyState, RigidBody};
use lgvi_scene::Scene;

use crate::sequence::Sequence;
use crate::solver::Predicted;

/// What sequences have used of the actuators of their body.
#[derive(Clone, Debug, Default)]
pub(crate) struct Used {
    /// Mass of propellant.
    propellant: f64,
    /// Impulses of the motors of the wheels, empty before the first.
    impulses: Vec<f64>,
}

impl Used {
    /// Adds what `sequence` uses of `body` before the step `end`.
    pub(crate) fn add(&mut self, scene: &Scene, body: &RigidBody, sequence: &Sequence, end: u64) {
        if let Some(thrusters) = body.thrusters() {
            self.propellant += sequence.propellant_used(scene, thrusters, end);
        }
        let impulses = sequence.wheel_impulses(scene, end);
        let count = self.impulses.len().max(impulses.len());
        self.impulses.resize(count, 0.0);
        for (sum, impulse) in self.impulses.iter_mut().zip(impulses) {
            *sum += impulse;
        }
    }

    /// What is left of a body that began like this, in its present state.
    pub(crate) fn leaves(&self, body: &RigidBody, state: BodyState) -> Predicted {
        let mut now = Predicted::of(body, state);
        if let Some(left) = &mut now.propellant {
            *left = (*left - self.propellant).max(0.0);
        }
        for (momentum, impulse) in now.wheel_momenta.iter_mut().zip(&self.impulses) {
            *momentum += impulse;
        }
        now
    }
}
