use std::f64::consts::PI;

use crate::file::DisturbanceFile;
use crate::{Commands, Disturbance, Scene, SceneError};

/// Compiles the disturbance of a scene that is complete except for it.
pub(super) fn disturbance(
    scene: &Scene,
    file: &DisturbanceFile,
) -> Result<Disturbance, SceneError> {
    let Some(maneuver) = &scene.maneuver else {
        let expected = "none without a `maneuver`, whose body it disturbs";
        return Err(SceneError::value("disturbance.seed", file.seed, expected));
    };
    if !maneuver.companions.is_empty() {
        let expected = "none beside `maneuver.companions`: it disturbs one planned body";
        return Err(SceneError::value("disturbance.seed", file.seed, expected));
    }
    for (key, error) in [
        ("force_error", file.force_error),
        ("moment_error", file.moment_error),
    ] {
        let commands = maneuver.commands();
        if commands != Commands::Loads && error != 0.0 {
            let name = commands.name();
            let expected = format!("0 where the commands of the maneuver are \"{name}\"");
            let key = format!("disturbance.{key}");
            return Err(SceneError::value(key, error, expected));
        }
    }
    Ok(Disturbance {
        seed: file.seed,
        force_error: deviation("force_error", file.force_error)?,
        moment_error: deviation("moment_error", file.moment_error)?,
        position: deviation("position", file.position)?,
        velocity: deviation("velocity", file.velocity)?,
        attitude: rotation_deviation(file.attitude)?,
        angular_velocity: deviation("angular_velocity", file.angular_velocity)?,
    })
}

/// Checks that the disturbed states can be flown like the nominal ones.
pub(super) fn check_states(scene: &Scene) -> Result<(), SceneError> {
    let Some(disturbance) = &scene.disturbance else {
        return Ok(());
    };
    let refuse = |expected: String| {
        Err(SceneError::value(
            "disturbance.seed",
            disturbance.seed,
            expected,
        ))
    };
    let states = scene.initial_states();
    if !states
        .iter()
        .all(|state| scene.units.state_to_si(state).is_finite())
    {
        return refuse("deviations that leave the state in the range of numbers in SI".into());
    }
    match scene.system().check_clearance(&states) {
        Ok(()) => Ok(()),
        Err(approach) => {
            let (distance, limit) = (approach.distance, approach.limit);
            let name = &scene.bodies[approach.body].name;
            refuse(format!(
                "deviations that keep the bodies apart: {name} would start at a distance of {distance}, at least {limit} is needed"
            ))
        }
    }
}

/// Limits the deviation of the attitude to half a turn. A larger one would add no information, and rounding errors
/// would destroy the rotation matrix.
fn rotation_deviation(value: f64) -> Result<f64, SceneError> {
    let value = deviation("attitude", value)?;
    if value <= PI {
        Ok(value)
    } else {
        let expected = "a standard deviation of at most half a turn, π";
        Err(SceneError::value("disturbance.attitude", value, expected))
    }
}

fn deviation(name: &str, value: f64) -> Result<f64, SceneError> {
    if value.is_finite() && value >= 0.0 {
        Ok(value)
    } else {
        let key = format!("disturbance.{name}");
        Err(SceneError::value(
            key,
            value,
            "a standard deviation, a finite number ≥ 0",
        ))
    }
}
