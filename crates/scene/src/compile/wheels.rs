use lgvi_dynamics::wheels::{ReactionWheel, Wheels};
use lgvi_dynamics::{Mobility, RigidBody};
use nalgebra::Vector3;

use crate::file::{BodyFile, WheelFile};
use crate::{Integration, Scene, SceneError, Skipping, check};

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
    if !matches!(body.mobility(), Mobility::Free | Mobility::Pivoted) {
        let expected = "none: only a free or pivoted body has wheels";
        return Err(SceneError::value(key(""), file.wheels.len(), expected));
    }
    let mut wheels = Vec::new();
    for (index, wheel) in file.wheels.iter().enumerate() {
        wheels.push(one(&key(&format!("[{index}]")), wheel)?);
        let mut others = file.wheels[..index].iter();
        if others.any(|other| other.name == wheel.name) {
            let expected = "a name that no other wheel of the body has";
            let key = key(&format!("[{index}].name"));
            return Err(SceneError::value(key, &wheel.name, expected));
        }
    }
    let refuse = |error: &dyn std::fmt::Display| {
        let expected = format!("wheels that are part of the body's inertia: {error}");
        SceneError::value(key(""), file.wheels.len(), expected)
    };
    let wheels = Wheels::new(wheels).map_err(|error| refuse(&error))?;
    body.with_wheels(wheels).map_err(|error| refuse(&error))
}

fn one(key: &str, file: &WheelFile) -> Result<ReactionWheel, SceneError> {
    let key = |name: &str| format!("{key}.{name}");
    check::name(&key("name"), &file.name)?;
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
    let friction = |name: &str, value: f64| {
        if value.is_finite() && value >= 0.0 {
            Ok(value)
        } else {
            Err(SceneError::value(key(name), value, "a finite number ≥ 0"))
        }
    };
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

/// Pilot flights do not know wheels, nor do joined bodies.
pub(super) fn check_run(scene: &Scene) -> Result<(), SceneError> {
    let mut bodies = scene.bodies.iter();
    if !bodies.any(|named| named.body.wheels().is_some()) {
        return Ok(());
    }
    if !scene.docking.is_empty() {
        let expected = "none in a scene in which bodies have `wheels`";
        return Err(SceneError::value("docking", scene.docking.len(), expected));
    }
    if matches!(scene.integration, Integration::Auto { .. }) {
        let expected = "the name of an integrator beside `wheels`, which `auto` does not know";
        let value = scene.integration.to_string();
        return Err(SceneError::value("run.integrator", value, expected));
    }
    if let Skipping::Within(tolerance) = scene.skipping {
        let expected = "\"exact\" or \"nothing\" beside `wheels`, which the pilot flights for a tolerance do not know";
        return Err(SceneError::value("run.skip", tolerance, expected));
    }
    Ok(())
}
