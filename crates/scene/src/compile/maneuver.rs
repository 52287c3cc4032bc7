use lgvi_control::{Actuation, ActuationError, Settings};
use lgvi_dynamics::{BodyState, Mobility};
use nalgebra::{Matrix3, Vector3};

use crate::file::{ManeuverFile, WeightFile};
use crate::scene::{Maneuver, NamedBody, Scene};
use crate::{SceneError, check};

/// Steps of the longest manoeuvre: what the planner keeps in memory, and a sequence in one message.
const MAX_MANEUVER_STEPS: u64 = 1_000_000;

/// The manoeuvre in the scene, which has none yet.
pub(super) fn maneuver(scene: &Scene, file: &ManeuverFile) -> Result<Maneuver, SceneError> {
    let body = scene.body_index(&file.body).ok_or_else(|| {
        let names: Vec<_> = scene.bodies.iter().map(|body| body.name.as_str()).collect();
        SceneError::value(
            "maneuver.body",
            &file.body,
            format!("one of {}", names.join(", ")),
        )
    })?;
    check_field(scene, body)?;
    if !(2..=MAX_MANEUVER_STEPS).contains(&scene.steps) {
        let expected = format!("2 to {MAX_MANEUVER_STEPS} steps for a manoeuvre");
        return Err(SceneError::value("run.steps", scene.steps, expected));
    }
    let target = &file.target;
    let target = BodyState::from_velocities(
        &scene.bodies[body].body,
        check::vector("maneuver.target.position", target.position)?,
        check::vector("maneuver.target.velocity", target.velocity)?,
        check::rotation("maneuver.target.attitude", &target.attitude)?,
        check::vector("maneuver.target.angular_velocity", target.angular_velocity)?,
    );
    let defaults = Settings::default();
    let solver = &file.solver;
    Ok(Maneuver {
        body,
        target,
        actuation: Actuation::full(&weight(&file.force_weight), &weight(&file.moment_weight))
            .map_err(refuse)?,
        settings: Settings {
            tolerance: match solver.tolerance {
                Some(tolerance) => check::positive("maneuver.solver.tolerance", tolerance)?,
                None => defaults.tolerance,
            },
            max_iterations: solver.max_iterations.unwrap_or(defaults.max_iterations),
            ..defaults
        },
    })
}

/// The planner knows one free body in a field that does not change.
fn check_field(scene: &Scene, body: usize) -> Result<(), SceneError> {
    let controlled = &scene.bodies[body];
    if *controlled.body.mobility() != Mobility::Free {
        let expected = "a body that is free to move";
        return Err(SceneError::value(
            "maneuver.body",
            &controlled.name,
            expected,
        ));
    }
    let Some(constant) = scene.gravity.mutual else {
        return Ok(());
    };
    let moving = scene
        .bodies
        .iter()
        .enumerate()
        .find(|(index, other)| *index != body && *other.body.mobility() != Mobility::Fixed);
    match moving {
        None => Ok(()),
        Some((_, NamedBody { name, .. })) => {
            let expected = format!(
                "no mutual gravity beside a manoeuvre unless all other bodies are fixed: \
                 the field of {name} would move, and the planner knows none that does"
            );
            Err(SceneError::value(
                "gravity.mutual.constant",
                constant,
                expected,
            ))
        }
    }
}

fn refuse(error: ActuationError) -> SceneError {
    match error {
        ActuationError::Weight { which, rows } => SceneError::value(
            format!("maneuver.{which}_weight"),
            rows,
            "a symmetric positive definite matrix",
        ),
        other => SceneError::value("maneuver.actuators", other.to_string(), "actuators"),
    }
}

fn weight(file: &WeightFile) -> Matrix3<f64> {
    match *file {
        WeightFile::Scalar(weight) => Matrix3::from_diagonal_element(weight),
        WeightFile::Diagonal(weights) => Matrix3::from_diagonal(&Vector3::from(weights)),
        WeightFile::Matrix(rows) => check::matrix(rows),
    }
}
