use lgvi_dynamics::BodyState;
use lgvi_lie::orthogonality_error;
use lgvi_msgs::msg;
use lgvi_msgs::shm::{BodySample, NameError};
use lgvi_node::body_state;
use lgvi_scene::Scene;
use thiserror::Error;

/// By how much an attitude that is set may miss being a rotation: far more than rounding, far less than an oversight.
const ORTHOGONALITY: f64 = 1e-9;

/// Why states are not set.
#[derive(Clone, Debug, Error, PartialEq)]
pub(super) enum StateError {
    #[error("`bodies` is empty, expected at least one")]
    Empty,
    #[error(transparent)]
    Form(#[from] NameError),
    #[error("`name` is {found:?}, expected one of {}", known.join(", "))]
    Name { found: String, known: Vec<String> },
    #[error("`bodies` has {0} twice, expected each once")]
    Twice(String),
    #[error("`bodies`: the state of {0} is not finite")]
    NotFinite(String),
    #[error(
        "`attitude` of {body} has |RᵀR − I| = {error:e} and determinant {determinant}, expected a rotation to {ORTHOGONALITY:e}"
    )]
    Attitude {
        body: String,
        error: f64,
        determinant: f64,
    },
}

/// The states of a request in the scene's units, each with its body.
pub(super) fn check(
    scene: &Scene,
    bodies: &[msg::BodyState],
) -> Result<Vec<(usize, BodyState)>, StateError> {
    let mut states: Vec<(usize, BodyState)> = Vec::with_capacity(bodies.len());
    for message in bodies {
        let name = || message.name.clone();
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
