use lgvi_common::body_state;
use lgvi_dynamics::BodyState;
use lgvi_lie::orthogonality_error;
use lgvi_msgs::shm::{BodySample, NameError};
use lgvi_msgs::{excerpt, msg};
use lgvi_scene::Scene;
use thiserror::Error;

/// By how much an attitude that is set may miss being a rotation: far more than rounding, far less than an oversight.
const ORTHOGONALITY: f64 = 1e-9;

/// States of some of a scene's bodies, checked and in the scene's units.
#[derive(Clone, Debug, PartialEq)]
pub struct SetStates(Vec<(usize, BodyState)>);

/// Why states are not set.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum StateError {
    /// Nothing to set.
    #[error("`bodies` is empty, expected at least one")]
    Empty,
    /// A name that no sample can hold.
    #[error(transparent)]
    Form(#[from] NameError),
    /// No such body.
    #[error("`name` is {found:?}, expected one of {}", known.join(", "))]
    Name {
        /// The name found.
        found: String,
        /// The scene's bodies.
        known: Vec<String>,
    },
    /// Two states for one body.
    #[error("`bodies` has {0} twice, expected each once")]
    Twice(String),
    /// NaN or infinity, in SI or in the scene's units.
    #[error("`bodies`: the state of {0} is not finite")]
    NotFinite(String),
    /// No rotation.
    #[error(
        "`attitude` of {body} has |RᵀR − I| = {error:e} and determinant {determinant}, expected a rotation to {ORTHOGONALITY:e}"
    )]
    Attitude {
        /// The body.
        body: String,
        /// `|RᵀR − I|`.
        error: f64,
        /// `det R`.
        determinant: f64,
    },
}

impl SetStates {
    /// Checks received states against the scene.
    pub fn of_message(scene: &Scene, bodies: &[msg::BodyState]) -> Result<Self, StateError> {
        check(scene, bodies).map(Self)
    }

    /// Overwrites the states of these bodies among those of all.
    pub(crate) fn write(&self, states: &mut [BodyState]) {
        for (body, state) in &self.0 {
            states[*body] = *state;
        }
    }
}

fn check(scene: &Scene, bodies: &[msg::BodyState]) -> Result<Vec<(usize, BodyState)>, StateError> {
    let mut states: Vec<(usize, BodyState)> = Vec::with_capacity(bodies.len());
    for message in bodies {
        let name = || excerpt(&message.name);
        let body = scene
            .bodies
            .iter()
            .position(|body| body.name == message.name)
            .ok_or_else(|| StateError::Name {
                found: name(),
                known: scene.bodies.iter().map(|body| body.name.clone()).collect(),
            })?;
        if states.iter().any(|(earlier, _)| *earlier == body) {
            return Err(StateError::Twice(name()));
        }
        let state = body_state(&BodySample::try_from(message)?, &scene.units);
        if !state.is_finite() {
            return Err(StateError::NotFinite(name()));
        }
        let error = orthogonality_error(&state.attitude);
        let determinant = state.attitude.determinant();
        if error > ORTHOGONALITY || determinant < 0.0 {
            return Err(StateError::Attitude {
                body: name(),
                error,
                determinant,
            });
        }
        states.push((body, state));
    }
    if states.is_empty() {
        return Err(StateError::Empty);
    }
    Ok(states)
}
