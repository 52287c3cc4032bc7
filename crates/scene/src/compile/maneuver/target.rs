use lgvi_control::terminal::{FinalAttitude, FinalPosition, KeplerOrbit, SpinAxis};
use lgvi_control::{Motion as Planned, Terminal};
use nalgebra::{Matrix3, Vector3};

use super::moves;
use super::prediction::Predictions;
use crate::axes::{Axes, Motion};
use crate::file::{AttitudeFile, TargetFile};
use crate::{Scene, SceneError, check};

/// Compiles the set in which the maneuver may end. Quantities that the file omits are free.
pub(super) fn target<'s>(
    scene: &Scene,
    body: usize,
    file: &'s TargetFile,
    motion: Planned,
    predictions: &mut Predictions<'s>,
) -> Result<Terminal, SceneError> {
    check_motion(file, motion)?;
    let inertial = match &file.relative_to {
        None => None,
        Some(relative) => Some(inertial(
            file,
            predictions.axes(&key("relative_to"), relative)?.last(),
        )?),
    };
    let file = inertial.as_ref().unwrap_or(file);
    let target = translation(scene, body, file, Terminal::FREE)?;
    let target = rotation(scene, body, file, target)?;
    if target == Terminal::FREE {
        let expected = "one of position, orbit, attitude and spin_axis at least";
        return Err(SceneError::missing("maneuver.target", expected));
    }
    Ok(target)
}

/// Returns the target in the inertial frame, of one that is relative to `last`, the axes at the end of the run.
fn inertial(file: &TargetFile, last: Option<&Axes>) -> Result<TargetFile, SceneError> {
    let unrelated = [
        ("orbit", file.orbit.is_some()),
        ("spin_axis", file.spin_axis.is_some()),
    ];
    if let Some((name, _)) = unrelated.into_iter().find(|(_, given)| *given) {
        let expected = "none beside `relative_to`";
        return Err(SceneError::value(key(name), "given", expected));
    }
    let vector = |name: &str, value: Option<[f64; 3]>| match value {
        Some(value) => check::vector(&key(name), value),
        None => Ok(Vector3::zeros()),
    };
    let attitude = file.attitude.as_ref();
    let attitude = attitude.map(|attitude| check::rotation(&key("attitude"), attitude));
    let given = Motion {
        position: vector("position", file.position)?,
        velocity: vector("velocity", file.velocity)?,
        attitude: attitude.transpose()?.unwrap_or_else(Matrix3::identity),
        angular_velocity: vector("angular_velocity", file.angular_velocity)?,
    };
    let Some(last) = last else {
        return Err(SceneError::missing(key("relative_to"), "a run with steps"));
    };
    let end = last.moved(&given);
    let rows = std::array::from_fn(|i| std::array::from_fn(|j| end.attitude[(i, j)]));
    Ok(TargetFile {
        relative_to: None,
        position: file.position.map(|_| end.position.into()),
        velocity: file.velocity.map(|_| end.velocity.into()),
        orbit: None,
        attitude: file.attitude.as_ref().map(|_| AttitudeFile::Matrix(rows)),
        spin_axis: None,
        angular_velocity: file.angular_velocity.map(|_| end.angular_velocity.into()),
    })
}

/// Refuses a target for a motion that is not planned.
fn check_motion(file: &TargetFile, motion: Planned) -> Result<(), SceneError> {
    let (translates, rotates) = moves(motion);
    let given = [
        ("position", file.position.is_some(), translates),
        ("velocity", file.velocity.is_some(), translates),
        ("orbit", file.orbit.is_some(), translates),
        ("attitude", file.attitude.is_some(), rotates),
        ("spin_axis", file.spin_axis.is_some(), rotates),
        ("angular_velocity", file.angular_velocity.is_some(), rotates),
    ];
    match given.iter().find(|(_, given, planned)| *given && !planned) {
        Some((name, ..)) => {
            let expected = "none: that motion is not planned";
            Err(SceneError::value(key(name), "given", expected))
        }
        None => Ok(()),
    }
}

fn translation(
    scene: &Scene,
    body: usize,
    file: &TargetFile,
    target: Terminal,
) -> Result<Terminal, SceneError> {
    let mass = scene.bodies[body].body.mass();
    match (&file.orbit, file.position, file.velocity) {
        (Some(orbit), None, None) => {
            let Some(central) = &scene.gravity.central else {
                let expected = "none without `gravity.central`";
                return Err(SceneError::value(key("orbit"), "given", expected));
            };
            let (position, velocity) = (orbit.position.into(), orbit.velocity.into());
            KeplerOrbit::new(central.gm, central.position, mass, position, velocity)
                .map(|orbit| target.with(orbit))
                .map_err(|error| match error.name {
                    "orbit" => SceneError::parameter(key("orbit"), error),
                    name => SceneError::parameter(key(&format!("orbit.{name}")), error),
                })
        }
        (Some(_), ..) => {
            let expected = "none beside `position` or `velocity`";
            Err(SceneError::value(key("orbit"), "given", expected))
        }
        (None, Some(position), velocity) => {
            let momentum = |velocity| Ok(check::vector(&key("velocity"), velocity)? * mass);
            let momentum = velocity.map(momentum).transpose()?;
            FinalPosition::new(position.into(), momentum)
                .map(|position| target.with(position))
                .map_err(|error| SceneError::parameter(key(error.name), error))
        }
        (None, None, Some(velocity)) => {
            let expected = "none without `position`";
            Err(SceneError::value(key("velocity"), velocity, expected))
        }
        (None, None, None) => Ok(target),
    }
}

fn rotation(
    scene: &Scene,
    body: usize,
    file: &TargetFile,
    target: Terminal,
) -> Result<Terminal, SceneError> {
    let inertia = scene.bodies[body].body.inertia().matrix();
    let momentum = |angular_velocity| {
        check::vector(&key("angular_velocity"), angular_velocity).map(|omega| inertia * omega)
    };
    match (&file.attitude, &file.spin_axis, file.angular_velocity) {
        (Some(_), Some(_), _) => {
            let expected = "none beside `attitude`";
            Err(SceneError::value(key("spin_axis"), "given", expected))
        }
        (Some(attitude), None, angular_velocity) => {
            let attitude = check::rotation(&key("attitude"), attitude)?;
            FinalAttitude::new(attitude, angular_velocity.map(momentum).transpose()?)
                .map(|attitude| target.with(attitude))
                .map_err(|error| SceneError::parameter(key(error.name), error))
        }
        (None, Some(spin), Some(angular_velocity)) => {
            let (axis, direction) = (spin.axis.into(), spin.direction.into());
            SpinAxis::new(axis, direction, momentum(angular_velocity)?)
                .map(|spin| target.with(spin))
                .map_err(|error| {
                    SceneError::parameter(key(&format!("spin_axis.{}", error.name)), error)
                })
        }
        (None, Some(_), None) => {
            let expected = "three numbers beside `spin_axis`";
            Err(SceneError::missing(key("angular_velocity"), expected))
        }
        (None, None, Some(angular_velocity)) => {
            let expected = "none without `attitude` or `spin_axis`";
            let key = key("angular_velocity");
            Err(SceneError::value(key, angular_velocity, expected))
        }
        (None, None, None) => Ok(target),
    }
}

fn key(name: &str) -> String {
    format!("maneuver.target.{name}")
}
