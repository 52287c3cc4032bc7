use std::f64::consts::PI;

use lgvi_dynamics::Mobility;
use lgvi_dynamics::docking::{Docking, Port};

use crate::file::{DockingFile, PortFile};
use crate::{Integration, Scene, SceneError, Skipping, angle, check};

/// Largest number of dockings in a scene.
const MAX_DOCKINGS: usize = 1024;

/// Largest angle of the axes, unless given (rad).
const ANGLE: f64 = PI / 36.0;

/// Compiles the dockings of a scene that has none yet.
pub(super) fn dockings(scene: &Scene, files: &[DockingFile]) -> Result<Vec<Docking>, SceneError> {
    if files.len() > MAX_DOCKINGS {
        let expected = format!("{MAX_DOCKINGS} dockings at most");
        return Err(SceneError::value("docking", files.len(), expected));
    }
    if !files.is_empty() {
        check_run(scene)?;
    }
    let all = files.iter().enumerate();
    all.map(|(index, file)| docking(&format!("docking[{index}]"), scene, file))
        .collect()
}

/// Pilot flights of the single bodies do not tell what holds for joined bodies.
fn check_run(scene: &Scene) -> Result<(), SceneError> {
    if matches!(scene.integration, Integration::Auto { .. }) {
        let expected =
            "the name of an integrator beside `docking`: `auto` rehearses the run without it";
        let value = scene.integration.to_string();
        return Err(SceneError::value("run.integrator", value, expected));
    }
    if let Skipping::Within(tolerance) = scene.skipping {
        let expected = "\"exact\" or \"nothing\" beside `docking`: a tolerance is shared out in pilot flights without it";
        return Err(SceneError::value("run.skip", tolerance, expected));
    }
    Ok(())
}

fn docking(key: &str, scene: &Scene, file: &DockingFile) -> Result<Docking, SceneError> {
    let key = |name: &str| format!("{key}.{name}");
    let port = |index: usize| port(&key(&format!("ports[{index}]")), scene, &file.ports[index]);
    let ports = [port(0)?, port(1)?];
    if ports[0].body == ports[1].body {
        let expected = "a body other than that of the first port";
        return Err(SceneError::value(
            key("ports[1].body"),
            &file.ports[1].body,
            expected,
        ));
    }
    let largest = |name: &str, value: Option<f64>| match value {
        Some(value) => check::positive(&key(name), value),
        None => Ok(f64::INFINITY),
    };
    let angle = match &file.angle {
        None => ANGLE,
        Some(file) => angle::half_turn("angle", file)
            .map_err(|error| SceneError::parameter(key("angle"), error))?,
    };
    if !(angle > 0.0 && angle <= PI) {
        let expected = "an angle above 0, of half a turn at most";
        return Err(SceneError::value(key("angle"), angle, expected));
    }
    Ok(Docking {
        ports,
        distance: check::positive(&key("distance"), file.distance)?,
        angle,
        speed: largest("speed", file.speed)?,
        rate: largest("rate", file.rate)?,
    })
}

fn port(key: &str, scene: &Scene, file: &PortFile) -> Result<Port, SceneError> {
    let key = |name: &str| format!("{key}.{name}");
    let body = scene.body_index(&file.body).ok_or_else(|| {
        let names: Vec<_> = scene.bodies.iter().map(|body| body.name.as_str()).collect();
        SceneError::unknown(key("body"), &file.body, &names)
    })?;
    if *scene.bodies[body].body.mobility() != Mobility::Free {
        let expected = "a free body: others do not move with what docks to them";
        return Err(SceneError::value(key("body"), &file.body, expected));
    }
    let axis = check::vector(&key("axis"), file.axis)?;
    let axis = axis.try_normalize(0.0).ok_or_else(|| {
        let expected = "a direction, three numbers that are not all 0";
        SceneError::value(key("axis"), file.axis, expected)
    })?;
    Ok(Port {
        body,
        position: check::vector(&key("position"), file.position)?,
        axis,
    })
}
