//! Reaction wheels and thrusters.

mod thrusters;
mod wheels;

pub use thrusters::MAX_THRUSTERS;
pub use wheels::MAX_WHEELS;

use lgvi_dynamics::{Mobility, RigidBody};

use crate::file::BodyFile;
use crate::{Integration, Scene, SceneError, Skipping, check};

/// Returns the body with the actuators of its file; the wheels have no momentum yet.
pub(super) fn with_actuators(
    key: &str,
    file: &BodyFile,
    body: RigidBody,
) -> Result<RigidBody, SceneError> {
    thrusters::with_thrusters(key, file, wheels::with_wheels(key, file, body)?)
}

fn check_mobility(key: &str, count: usize, body: &RigidBody) -> Result<(), SceneError> {
    if matches!(body.mobility(), Mobility::Free | Mobility::Pivoted) {
        return Ok(());
    }
    let expected = "none: only a free or pivoted body has actuators";
    Err(SceneError::value(key, count, expected))
}

fn check_names<'a>(key: &str, names: impl Iterator<Item = &'a String>) -> Result<(), SceneError> {
    let mut others = Vec::new();
    for (index, name) in names.enumerate() {
        let key = format!("{key}[{index}].name");
        check::name(&key, name)?;
        if others.contains(&name) {
            let expected = "a name that none before it has";
            return Err(SceneError::value(key, name, expected));
        }
        others.push(name);
    }
    Ok(())
}

/// Pilot flights do not know actuators, nor do joined bodies.
pub(super) fn check_run(scene: &Scene) -> Result<(), SceneError> {
    if !scene.has_actuators() {
        return Ok(());
    }
    if !scene.docking.is_empty() {
        let expected = "none in a scene in which bodies have `wheels` or `thrusters`";
        return Err(SceneError::value("docking", scene.docking.len(), expected));
    }
    if matches!(scene.integration, Integration::Auto { .. }) {
        let expected =
            "the name of an integrator beside `wheels` or `thrusters`, which `auto` does not know";
        let value = scene.integration.to_string();
        return Err(SceneError::value("run.integrator", value, expected));
    }
    if let Skipping::Within(tolerance) = scene.skipping {
        let expected = "\"exact\" or \"nothing\" beside `wheels` or `thrusters`, which the pilot flights for a tolerance do not know";
        return Err(SceneError::value("run.skip", tolerance, expected));
    }
    thrusters::check_steps(scene)
}
