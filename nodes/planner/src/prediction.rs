use lgvi_dynamics::{BodyState, Load, Simulation};
use lgvi_scene::{Scene, Scheme};
use thiserror::Error;

use crate::follower::Observed;
use crate::sequence::Sequence;

/// Why nobody can say where the body will be.
#[derive(Clone, Debug, Error, PartialEq)]
pub(crate) enum PredictionError {
    /// The flight is past it.
    #[error("the flight has reached step {reached}, expected at most {step}")]
    Past {
        /// The flight's step.
        reached: u64,
        /// The step asked for.
        step: u64,
    },
    /// The steps until then cannot be made.
    #[error("the flight cannot be foretold from step {from} to {step}: {reason}")]
    Steps {
        /// The flight's step.
        from: u64,
        /// The step asked for.
        step: u64,
        /// What the integrator says.
        reason: String,
    },
}

/// The planned body's state at `step` of the flight: flown on by the scene's own scheme from where it was heard of last,
/// under the sequences that have been published, without disturbance. Each acts from its first step on, the last first.
pub(crate) fn predict(
    scene: &Scene,
    scheme: Scheme,
    body: usize,
    from: &Observed,
    sequences: &[Sequence],
    step: u64,
) -> Result<BodyState, PredictionError> {
    if from.step > step {
        let reached = from.step;
        return Err(PredictionError::Past { reached, step });
    }
    let fail = |reason: String| PredictionError::Steps {
        from: from.step,
        step,
        reason,
    };
    let states = from.states.clone();
    let mut simulation = Simulation::new(scene.system(), states, scheme.method, scene.h())
        .map_err(|error| fail(error.to_string()))?
        .with_substeps(scheme.substeps);
    let mut loads = vec![Load::default(); scene.bodies.len()];
    for step in from.step..step {
        let state = &simulation.states()[body];
        let mut newest = sequences.iter().rev();
        loads[body] = newest
            .find_map(|sequence| sequence.at(step, state))
            .unwrap_or_default();
        simulation
            .advance(&loads)
            .map_err(|error| fail(error.to_string()))?;
    }
    Ok(simulation.states()[body])
}
