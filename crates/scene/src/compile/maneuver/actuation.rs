use lgvi_control::{Actuation, ActuationError, Constraint, MAX_COMMANDS, Motion};
use nalgebra::{Matrix3, Vector3};

use super::{actuators, moves};
use crate::file::{ActuatorFile, ManeuverFile, WeightFile};
use crate::{Commands, SceneError, check};

/// Compiles the maneuver's commands: force and moment with their weights, or the commands of its actuators.
pub(super) fn actuation(file: &ManeuverFile, motion: Motion) -> Result<Actuation, SceneError> {
    actuators::check_weights(file, Commands::Loads)?;
    let Some(actuators) = &file.actuators else {
        return of_loads(file, &weight("maneuver.force_weight", file.force_weight)?);
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

/// Force and moment, with the weight of the force.
pub(super) fn of_loads(file: &ManeuverFile, force: &Matrix3<f64>) -> Result<Actuation, SceneError> {
    let moment = weight("maneuver.moment_weight", file.moment_weight)?;
    Actuation::full(force, &moment).map_err(refuse)
}

/// The actuation at minimum fuel.
pub(super) fn minimizing_fuel(
    actuation: &Actuation,
    limits: &[Constraint],
    motion: Motion,
) -> Result<Actuation, SceneError> {
    if motion == Motion::Rotation && actuation.is_of_loads() {
        let expected = "\"energy\" where the commands are moments, which use no fuel: name `actuators`, or thrusters";
        return Err(SceneError::value("maneuver.cost", "fuel", expected));
    }
    actuation.minimizing_fuel(limits).map_err(refuse)
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
        ActuationError::Weights { what, found, .. } => {
            let expected = format!("one for each of the {what}");
            SceneError::value("maneuver.commands", found, expected)
        }
        ActuationError::CommandWeight { command, weight } => SceneError::value(
            format!("maneuver.actuators[{command}].weight"),
            weight,
            "a number from 1e-30 to 1e30",
        ),
        ActuationError::ForcePrices(rows) => {
            let expected =
                "one number where `cost` is \"fuel\": the price of the norm of the force";
            SceneError::value("maneuver.force_weight", rows, expected)
        }
        ActuationError::Unlimited { command } => {
            let expected = format!("\"energy\", or a constraint that limits command {command}");
            SceneError::value("maneuver.cost", "fuel", expected)
        }
        ActuationError::FuelOfWheels => {
            let expected = "\"energy\" where the commands are torques of wheels, which use no fuel";
            SceneError::value("maneuver.cost", "fuel", expected)
        }
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
