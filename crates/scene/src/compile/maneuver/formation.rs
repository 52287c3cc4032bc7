//! Several bodies that are planned together.

use lgvi_control::{FormationError, Motion, check_together};

use super::of_body;
use crate::file::{CompanionFile, ManeuverFile, RelativeFile};
use crate::{Commands, Maneuver, Scene, SceneError, SolverMethod, check};

/// Largest number of bodies that are planned together: nodes that start late get so many control sequences.
const MOST: usize = 8;

/// The key of the least distance.
const SEPARATION: &str = "maneuver.separation";

/// Returns the maneuver of one body with its companions, if the file has any.
pub(super) fn joined(
    scene: &Scene,
    alone: Maneuver,
    file: &ManeuverFile,
) -> Result<Maneuver, SceneError> {
    let separation = match (file.separation, file.companions.is_empty()) {
        (None, true) => return Ok(alone),
        (Some(separation), true) => {
            let expected = "none without `maneuver.companions`: there is nobody to keep away from";
            return Err(SceneError::value(SEPARATION, separation, expected));
        }
        (None, false) => {
            let expected = "the least distance between the planned bodies";
            return Err(SceneError::missing(SEPARATION, expected));
        }
        (Some(separation), false) => check::positive(SEPARATION, separation)?,
    };
    let count = file.companions.len();
    if count >= MOST {
        let expected = format!("at most {} of them", MOST - 1);
        return Err(SceneError::value("maneuver.companions", count, expected));
    }
    check_options(scene, &alone, file)?;
    let mut companions = Vec::new();
    for (index, CompanionFile(file)) in file.companions.iter().enumerate() {
        let of_companion = |error: SceneError| error.of_companion(index);
        let companion = of_body(scene, file).map_err(of_companion)?;
        check_commands(scene, &companion).map_err(of_companion)?;
        let planned = |other: &Maneuver| other.body == companion.body;
        if planned(&alone) || companions.iter().any(planned) {
            let key = format!("maneuver.companions[{index}].body");
            let expected = "a body that is not planned yet";
            return Err(SceneError::value(key, &file.body, expected));
        }
        companions.push(companion);
    }
    let maneuver = Maneuver {
        separation: Some(separation),
        companions,
        ..alone
    };
    let files = file.companions.iter().map(|CompanionFile(file)| file);
    check_axes(scene, &maneuver, "maneuver", file)?;
    for (index, file) in files.enumerate() {
        let key = format!("maneuver.companions[{index}]");
        check_axes(scene, &maneuver, &key, file)?;
    }
    Ok(maneuver)
}

/// Refuses options that do not go with several bodies.
fn check_options(scene: &Scene, alone: &Maneuver, file: &ManeuverFile) -> Result<(), SceneError> {
    let shooting = alone.solver.method == SolverMethod::Shooting;
    let options = [
        (
            "final_time",
            alone.final_time.is_some(),
            "the duration of the run is that of all bodies",
        ),
        (
            "search",
            alone.search.is_some(),
            "the sides on which bodies pass each other are chosen without it",
        ),
        (
            "confidence",
            file.confidence.is_some(),
            "constraints hold for the nominal flight",
        ),
        (
            "processed",
            alone.processed,
            "the bodies keep apart in the steps that are planned",
        ),
        (
            "phases",
            !alone.phases.is_empty(),
            "the bodies are planned in a single leg",
        ),
        ("solver.method", shooting, "shooting knows no constraints"),
    ];
    if let Some((key, _, why)) = options.iter().find(|(_, given, _)| *given) {
        let expected = format!("none beside `maneuver.companions`: {why}");
        return Err(SceneError::value(
            format!("maneuver.{key}"),
            "given",
            expected,
        ));
    }
    check_commands(scene, alone)
}

/// Refuses plans that do not move the body or have no quadratic cost.
fn check_commands(scene: &Scene, maneuver: &Maneuver) -> Result<(), SceneError> {
    let beside = "of bodies that are planned together";
    if maneuver.commands() == Commands::Wheels {
        let expected = format!("commands that move the body, {beside}");
        return Err(SceneError::value("maneuver.commands", "wheels", expected));
    }
    let body = &scene.bodies[maneuver.body];
    if body.has_propellant() && (maneuver.by_thrusters() || body.has_engine()) {
        let expected = format!("none of thrusters or an engine {beside}");
        return Err(SceneError::value(
            "maneuver.commands",
            "propellant",
            expected,
        ));
    }
    if maneuver.motion == Motion::Rotation {
        let expected = format!("\"full\" or \"translation\" {beside}");
        return Err(SceneError::value("maneuver.motion", "rotation", expected));
    }
    if maneuver.actuation.minimizes_fuel() {
        let expected = format!("\"energy\" {beside}: the prices of a linear cost do not settle");
        return Err(SceneError::value("maneuver.cost", "fuel", expected));
    }
    Ok(())
}

/// Refuses axes of a body that is planned: its motion is not known beforehand.
fn check_axes(
    scene: &Scene,
    maneuver: &Maneuver,
    key: &str,
    file: &ManeuverFile,
) -> Result<(), SceneError> {
    let target = file.target.relative_to.iter();
    let target = target.map(|relative| (format!("{key}.target"), relative));
    let constraints = file.constraints.iter().enumerate();
    let constraints = constraints.filter_map(|(index, constraint)| {
        let relative = constraint.relative_to()?;
        Some((format!("{key}.constraints[{index}]"), relative))
    });
    for (key, RelativeFile { body, about, .. }) in target.chain(constraints) {
        for (name, body) in [("body", Some(body)), ("about", about.as_ref())] {
            let index = body.and_then(|body| scene.body_index(body));
            if let (Some(body), Some(index)) = (body, index)
                && maneuver.planned().any(|planned| planned.body == index)
            {
                let key = format!("{key}.relative_to.{name}");
                let expected = "a body that is not planned: the motion of a planned one is not known beforehand";
                return Err(SceneError::value(key, body, expected));
            }
        }
    }
    Ok(())
}

/// Checks that the bodies of a scene can be planned together.
pub(in crate::compile) fn check_formation(scene: &Scene) -> Result<(), SceneError> {
    let Some(transfers) = scene.transfers() else {
        return Ok(());
    };
    let Some(separation) = scene
        .maneuver
        .as_ref()
        .and_then(|maneuver| maneuver.separation)
    else {
        return Ok(());
    };
    let transfers = transfers.map_err(|error| {
        SceneError::value("maneuver.companions", error.to_string(), "a maneuver")
    })?;
    check_together(&transfers, separation).map_err(|error| match error {
        FormationError::Near {
            bodies,
            at,
            distance,
            ..
        } => {
            let names = bodies.map(|body| scene.planned_name(body));
            let [one, other] = names;
            let expected =
                format!("at most {distance}, the distance of {one} and {other} at the {at}");
            SceneError::value(SEPARATION, separation, expected)
        }
        error => SceneError::value("maneuver.companions", error.to_string(), "a formation"),
    })
}
