mod actuation;
mod constraints;
mod options;
mod target;

pub(crate) use constraints::ConstraintFile;

use lgvi_control::{Dynamics, Motion};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{Method, Mobility};

use crate::file::{DynamicsFile, ManeuverFile, MotionFile, SolverMethodFile};
use crate::scene::{NamedBody, Scene};
use crate::{Integration, Maneuver, SceneError};

/// Steps of the longest maneuver: what the planner keeps in memory, and a sequence in one message.
const MAX_MANEUVER_STEPS: u64 = 1_000_000;

/// The maneuver in the scene, which has none yet.
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
        let expected = format!("2 to {MAX_MANEUVER_STEPS} steps for a maneuver");
        return Err(SceneError::value("run.steps", scene.steps, expected));
    }
    let motion = match file.motion {
        MotionFile::Full => Motion::Full,
        MotionFile::Translation => Motion::Translation,
        MotionFile::Rotation => Motion::Rotation,
    };
    let actuation = actuation::actuation(file, motion)?;
    let maneuver = Maneuver {
        body,
        target: target::target(scene, body, &file.target, motion)?,
        constraints: constraints::constraints(&file.constraints, motion, &actuation)?,
        actuation,
        dynamics: dynamics(scene, file),
        processed: file.processed,
        motion,
        final_time: options::final_time(scene, file.final_time.as_ref())?,
        solver: options::solver(&file.solver)?,
        search: options::search(file.search.as_ref())?,
        replan: options::replan(scene, file.replan.as_ref())?,
        feedback: file.feedback,
    };
    options::check_combination(scene, &maneuver, file)?;
    Ok(maneuver)
}

/// Whether an axis of the motion is planned.
fn moves(motion: Motion) -> (bool, bool) {
    (motion != Motion::Rotation, motion != Motion::Translation)
}

/// What a maneuver asks for, or what flies it, or what comes nearest to that.
fn dynamics(scene: &Scene, file: &ManeuverFile) -> Dynamics {
    match (file.dynamics, scene.integration) {
        (Some(DynamicsFile::LieEuler), _) => Dynamics::LieEuler,
        (Some(DynamicsFile::Lgvi), _) => Dynamics::Lgvi,
        (None, _) if file.processed => Dynamics::LieEuler,
        (None, Integration::Method(Method::LieEuler(_))) => Dynamics::LieEuler,
        (None, _) => Dynamics::Lgvi,
    }
}

/// What flies a maneuver whose scene leaves the choice: the steps that it is planned in, or for a processed plan those
/// that it is conjugate to. By default those of second order, unless the solver knows the others only.
pub(super) fn method(file: &ManeuverFile) -> Method {
    let shot = matches!(file.solver.method, SolverMethodFile::Shooting);
    match file.dynamics {
        _ if file.processed => Method::Lgvi(Rotor::default()),
        Some(DynamicsFile::LieEuler) => Method::LieEuler(Rotor::default()),
        None if shot => Method::LieEuler(Rotor::default()),
        Some(DynamicsFile::Lgvi) | None => Method::Lgvi(Rotor::default()),
    }
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
                "no mutual gravity beside a maneuver unless all other bodies are fixed: \
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
