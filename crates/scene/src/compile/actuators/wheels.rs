use lgvi_dynamics::RigidBody;
use lgvi_dynamics::wheels::{ReactionWheel, Wheels};
use nalgebra::Vector3;

use super::{check_mobility, check_names};
use crate::file::{BodyFile, WheelFile};
use crate::{SceneError, check};

/// Largest number of wheels of a body.
pub const MAX_WHEELS: usize = 16;

/// Returns the body with the wheels of its file, which have no momentum yet.
pub(super) fn with_wheels(
    key: &str,
    file: &BodyFile,
    body: RigidBody,
) -> Result<RigidBody, SceneError> {
    let key = |rest: &str| format!("{key}.wheels{rest}");
    if file.wheels.is_empty() {
        return Ok(body);
    }
    if file.wheels.len() > MAX_WHEELS {
        let expected = format!("{MAX_WHEELS} wheels at most");
        return Err(SceneError::value(key(""), file.wheels.len(), expected));
    }
    check_mobility(&key(""), file.wheels.len(), &body)?;
    check_names(&key(""), file.wheels.iter().map(|wheel| &wheel.name))?;
    let each = file.wheels.iter().enumerate();
    let wheels = each.map(|(index, wheel)| one(&key(&format!("[{index}]")), wheel));
    let wheels = wheels.collect::<Result<_, _>>()?;
    let refuse = |error: &dyn std::fmt::Display| {
        let expected = format!("wheels that are part of the body's inertia: {error}");
        SceneError::value(key(""), file.wheels.len(), expected)
    };
    let wheels = Wheels::new(wheels).map_err(|error| refuse(&error))?;
    body.with_wheels(wheels).map_err(|error| refuse(&error))
}

fn one(key: &str, file: &WheelFile) -> Result<ReactionWheel, SceneError> {
    let key = |name: &str| format!("{key}.{name}");
    let axis = check::vector(&key("axis"), file.axis)?;
    if axis == Vector3::zeros() {
        return Err(SceneError::value(
            key("axis"),
            file.axis,
            "an axis other than 0",
        ));
    }
    let limit = |name: &str, value: Option<f64>| match value {
        Some(value) => check::positive(&key(name), value),
        None => Ok(f64::INFINITY),
    };
    let friction = |name: &str, value| check::not_negative(&key(name), value);
    let wheel = ReactionWheel {
        axis,
        inertia: check::positive(&key("inertia"), file.inertia)?,
        max_torque: limit("max_torque", file.max_torque)?,
        max_speed: limit("max_speed", file.max_speed)?,
        viscous_friction: friction("viscous_friction", file.viscous_friction)?,
        coulomb_friction: friction("coulomb_friction", file.coulomb_friction)?,
    };
    if file.speed.is_nan() || file.speed.abs() > wheel.max_speed.min(f64::MAX) {
        let expected = "a finite number, within `max_speed`";
        return Err(SceneError::value(key("speed"), file.speed, expected));
    }
    Ok(wheel)
}
