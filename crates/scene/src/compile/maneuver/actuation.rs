use lgvi_control::constraint::CommandLimit;
use lgvi_control::{Actuation, ActuationError, Constraint, MAX_COMMANDS, Motion};
use lgvi_dynamics::thrusters::Thrusters;
use nalgebra::{Matrix3, Vector3};

use super::moves;
use crate::file::{ActuatorFile, EachFile, ManeuverFile, WeightFile};
use crate::{SceneError, check};

/// Compiles the maneuver's commands: force and moment with their weights, or the commands of its actuators, or of the body's
/// thrusters.
pub(super) fn actuation(
    file: &ManeuverFile,
    motion: Motion,
    thrusters: Option<&Thrusters>,
) -> Result<Actuation, SceneError> {
    if let Some(thrusters) = thrusters {
        return by_thrusters(file, thrusters);
    }
    if let Some(weight) = &file.thruster_weight {
        let expected = "none unless `commands` is \"thrusters\"";
        return Err(SceneError::value(
            "maneuver.thruster_weight",
            weight.given(),
            expected,
        ));
    }
    let Some(actuators) = &file.actuators else {
        let force = weight("maneuver.force_weight", file.force_weight)?;
        let moment = weight("maneuver.moment_weight", file.moment_weight)?;
        return Actuation::full(&force, &moment).map_err(refuse);
    };
    for (given, name) in [
        (&file.force_weight, "force"),
        (&file.moment_weight, "moment"),
    ] {
        if given.is_some() {
            let expected = "none beside `actuators`, which have weights of their own";
            let key = format!("maneuver.{name}_weight");
            return Err(SceneError::value(key, "given", expected));
        }
    }
    let columns = actuators
        .iter()
        .enumerate()
        .map(|(index, actuator)| column(&format!("maneuver.actuators[{index}]"), actuator, motion))
        .collect::<Result<Vec<_>, _>>()?;
    Actuation::actuators(&columns).map_err(refuse)
}

fn by_thrusters(file: &ManeuverFile, all: &Thrusters) -> Result<Actuation, SceneError> {
    let thrusters = all.thrusters();
    let count = thrusters.len();
    for (key, given) in [
        ("actuators", file.actuators.is_some()),
        ("force_weight", file.force_weight.is_some()),
        ("moment_weight", file.moment_weight.is_some()),
    ] {
        if given {
            let expected = "none beside `commands = \"thrusters\"`";
            let key = format!("maneuver.{key}");
            return Err(SceneError::value(key, "given", expected));
        }
    }
    if let Some(one) = thrusters
        .iter()
        .find(|one| one.exhaust_velocity.is_finite())
    {
        let expected = "a body whose thrusters have none: a plan keeps the mass constant";
        let key = "bodies.thrusters.exhaust_velocity";
        return Err(SceneError::value(key, one.exhaust_velocity, expected));
    }
    if count > MAX_COMMANDS {
        let expected = format!("a body with at most {MAX_COMMANDS} thrusters");
        return Err(SceneError::value("maneuver.commands", count, expected));
    }
    let key = "maneuver.thruster_weight";
    let weights = file.thruster_weight.as_ref();
    let given = weights.map_or(&[1.0][..], EachFile::given);
    let weights = weights.map_or(Some(vec![1.0; count]), |weights| weights.each(count));
    let Some(weights) = weights else {
        let expected = format!("one number, or {count} of them");
        return Err(SceneError::value(key, given, expected));
    };
    for weight in &weights {
        check::positive(key, *weight)?;
    }
    Actuation::thrusters(all, &weights).map_err(|error| {
        let expected = format!("weights and thrusters of sizes that can be compared: {error}");
        SceneError::value(key, given, expected)
    })
}

/// The limits of the forces of thrusters.
pub(super) fn limits(thrusters: &Thrusters) -> Result<Constraint, SceneError> {
    let limits: Vec<_> = thrusters.thrusters().iter().map(|one| one.thrust).collect();
    let limit = CommandLimit::new(&limits)
        .map_err(|error| SceneError::parameter(String::from("maneuver.commands"), error))?;
    Ok(Constraint::commands(limit.one_sided()))
}

/// Returns the force and moment of a unit command, and its weight.
fn column(key: &str, file: &ActuatorFile, motion: Motion) -> Result<([f64; 6], f64), SceneError> {
    let (translates, rotates) = moves(motion);
    for (name, value, used) in [
        ("force", file.force, translates),
        ("moment", file.moment, rotates),
    ] {
        let key = format!("{key}.{name}");
        check::vector(&key, value)?;
        if !used && value != [0.0; 3] {
            let expected = "none: that motion is not planned";
            return Err(SceneError::value(key, value, expected));
        }
    }
    let column = [file.force, file.moment].concat();
    if column.iter().all(|component| *component == 0.0) {
        let expected = "a `force` or a `moment` that is not zero";
        return Err(SceneError::value(key, &column, expected));
    }
    let weight = check::positive(&format!("{key}.weight"), file.weight)?;
    Ok((std::array::from_fn(|row| column[row]), weight))
}

fn refuse(error: ActuationError) -> SceneError {
    match error {
        ActuationError::Weight { which, rows } => SceneError::value(
            format!("maneuver.{which}_weight"),
            rows,
            "a symmetric positive definite matrix",
        ),
        ActuationError::Commands { found } => {
            let expected = format!("1 to {MAX_COMMANDS} actuators");
            SceneError::value("maneuver.actuators", found, expected)
        }
        ActuationError::Weights { found, .. } => {
            SceneError::value("maneuver.thruster_weight", found, "one for each thruster")
        }
        ActuationError::CommandWeight { command, weight } => SceneError::value(
            format!("maneuver.actuators[{command}].weight"),
            weight,
            "a number from 1e-30 to 1e30",
        ),
        ActuationError::Column { command, column } => SceneError::value(
            format!("maneuver.actuators[{command}]"),
            column,
            "force and moment, 0 or of a size from 1e-30 to 1e30",
        ),
    }
}

fn weight(key: &str, file: Option<WeightFile>) -> Result<Matrix3<f64>, SceneError> {
    let expected = "a symmetric positive definite matrix";
    let weight = match file {
        None => Matrix3::identity(),
        Some(WeightFile::Scalar(weight)) => Matrix3::from_diagonal_element(weight),
        Some(WeightFile::Diagonal(weights)) => Matrix3::from_diagonal(&Vector3::from(weights)),
        Some(WeightFile::Matrix(rows)) => check::matrix(rows),
    };
    if weight.iter().all(|element| element.is_finite()) {
        Ok(weight)
    } else {
        Err(SceneError::value(key, weight.as_slice(), expected))
    }
}
