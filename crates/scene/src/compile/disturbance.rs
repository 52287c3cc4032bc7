use std::f64::consts::PI;

use lgvi_dynamics::Mobility;

use crate::file::{DisturbanceFile, DisturbedBodyFile};
use crate::{Commands, Disturbance, Maneuver, Scene, SceneError, StateDeviation};

/// Compiles the disturbance of a scene that is complete except for it.
pub(super) fn disturbance(
    scene: &Scene,
    file: &DisturbanceFile,
) -> Result<Disturbance, SceneError> {
    let Some(maneuver) = &scene.maneuver else {
        let expected = "none without a `maneuver`, whose body it disturbs";
        return Err(SceneError::value("disturbance.seed", file.seed, expected));
    };
    let errors = [file.force_error, file.moment_error, file.actuator_error];
    check_errors("disturbance", maneuver, errors)?;
    if maneuver.replan.is_some() && file.actuator_error != 0.0 {
        let expected = "0 beside `maneuver.replan`: plans made in flight do not hear of propellant and the momenta of wheels";
        let key = "disturbance.actuator_error";
        return Err(SceneError::value(key, file.actuator_error, expected));
    }
    let by_engine = scene.bodies[maneuver.body].has_engine();
    if by_engine && maneuver.replan.is_some() && file.force_error != 0.0 {
        let expected = "0 beside `maneuver.replan` of a body with an `engine`: plans made in flight do not hear of the mass";
        let key = "disturbance.force_error";
        return Err(SceneError::value(key, file.force_error, expected));
    }
    let key = |name: &str| format!("disturbance.{name}");
    let mut others = Vec::new();
    for (index, file) in file.bodies.iter().enumerate() {
        let (body, deviation) = other(scene, &key(&format!("bodies[{index}]")), file)?;
        if body == maneuver.body || others.iter().any(|(other, _)| *other == body) {
            let key = key(&format!("bodies[{index}].body"));
            let expected = "a body other than that of the maneuver and those of tables before";
            return Err(SceneError::value(key, &file.body, expected));
        }
        others.push((body, deviation));
    }
    Ok(Disturbance {
        seed: file.seed,
        force_error: deviation(key("force_error"), file.force_error)?,
        moment_error: deviation(key("moment_error"), file.moment_error)?,
        actuator_error: deviation(key("actuator_error"), file.actuator_error)?,
        actuators: maneuver.actuators(),
        state: StateDeviation {
            position: deviation(key("position"), file.position)?,
            velocity: deviation(key("velocity"), file.velocity)?,
            attitude: rotation_deviation(key("attitude"), file.attitude)?,
            angular_velocity: deviation(key("angular_velocity"), file.angular_velocity)?,
        },
        others,
    })
}

/// Refuses errors of force, moment and actuators that the maneuver does not command.
pub(super) fn check_errors(
    table: &str,
    maneuver: &Maneuver,
    [force, moment, actuator]: [f64; 3],
) -> Result<(), SceneError> {
    let commands = maneuver.commands();
    let by_load = commands == Commands::Loads;
    for (name, error, commanded) in [
        ("force_error", force, by_load),
        ("moment_error", moment, by_load),
        ("actuator_error", actuator, !by_load),
    ] {
        if error != 0.0 && !commanded {
            let expected = match by_load {
                true => {
                    "0 unless the commands of the maneuver are \"thrusters\" or \"wheels\"".into()
                }
                false => {
                    let commands = commands.name();
                    format!(
                        "0 where the commands of the maneuver are \"{commands}\": `actuator_error` is that of each"
                    )
                }
            };
            return Err(SceneError::value(
                format!("{table}.{name}"),
                error,
                expected,
            ));
        }
    }
    Ok(())
}

/// The index of a body that is not maneuvered, and its deviations.
fn other(
    scene: &Scene,
    key: &str,
    file: &DisturbedBodyFile,
) -> Result<(usize, StateDeviation), SceneError> {
    let key = |name: &str| format!("{key}.{name}");
    let body = scene.body_index(&file.body).ok_or_else(|| {
        let names: Vec<_> = scene.bodies.iter().map(|body| body.name.as_str()).collect();
        SceneError::unknown(key("body"), &file.body, &names)
    })?;
    if *scene.bodies[body].body.mobility() != Mobility::Free {
        let expected = "a body that is free to move";
        return Err(SceneError::value(key("body"), &file.body, expected));
    }
    let deviation = StateDeviation {
        position: deviation(key("position"), file.position)?,
        velocity: deviation(key("velocity"), file.velocity)?,
        attitude: rotation_deviation(key("attitude"), file.attitude)?,
        angular_velocity: deviation(key("angular_velocity"), file.angular_velocity)?,
    };
    Ok((body, deviation))
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
fn rotation_deviation(key: String, value: f64) -> Result<f64, SceneError> {
    let value = deviation(key.clone(), value)?;
    if value <= PI {
        Ok(value)
    } else {
        let expected = "a standard deviation of at most half a turn, π";
        Err(SceneError::value(key, value, expected))
    }
}

fn deviation(key: String, value: f64) -> Result<f64, SceneError> {
    if value.is_finite() && value >= 0.0 {
        Ok(value)
    } else {
        let expected = "a standard deviation, a finite number ≥ 0";
        Err(SceneError::value(key, value, expected))
    }
}
