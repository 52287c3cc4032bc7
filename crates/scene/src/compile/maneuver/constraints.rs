use lgvi_control::constraint::{
    CommandLimit, ComponentLimit, ConstraintError, Corridor, KeepOutCone, KeepOutSphere, NormLimit,
};
use lgvi_control::{Actuation, Constraint, Motion, Place};
use nalgebra::Vector3;

use super::moves;
use crate::SceneError;
use crate::error::excerpt;
use crate::file::{ConstraintFile, LimitFile};

/// What holds on the way.
pub(super) fn constraints(
    files: &[ConstraintFile],
    motion: Motion,
    actuation: &Actuation,
) -> Result<Vec<Constraint>, SceneError> {
    files
        .iter()
        .enumerate()
        .map(|(index, file)| {
            let key = |name: &str| format!("maneuver.constraints[{index}].{name}");
            let constraint = constraint(file, actuation).map_err(|error| SceneError::Value {
                key: key(error.name),
                value: excerpt(&error.value),
                expected: error.expected,
            })?;
            check_motion(&key("kind"), &constraint, motion)?;
            Ok(constraint)
        })
        .collect()
}

/// What does not move has no constraints.
fn check_motion(key: &str, constraint: &Constraint, motion: Motion) -> Result<(), SceneError> {
    let (translates, rotates) = moves(motion);
    let planned = match constraint.place() {
        None => true,
        Some(Place::Position) => translates,
        Some(Place::Attitude) => rotates,
    };
    if planned {
        return Ok(());
    }
    let expected = "a kind that belongs to the motion that is planned";
    Err(SceneError::value(key, constraint.name(), expected))
}

fn constraint(file: &ConstraintFile, actuation: &Actuation) -> Result<Constraint, ConstraintError> {
    use ConstraintFile as File;
    use Place::{Attitude, Position};
    Ok(match file {
        File::Commands { limit } => {
            let limits = limits(limit, actuation.commands())?;
            let limit = |command| limits.get(command).copied().unwrap_or(f64::INFINITY);
            Constraint::commands(CommandLimit::new(std::array::from_fn(limit))?)
        }
        File::ForceComponents { limit } => components(Position, limit)?,
        File::MomentComponents { limit } => components(Attitude, limit)?,
        File::ForceNorm { limit } => norm(Position, *limit)?,
        File::MomentNorm { limit } => norm(Attitude, *limit)?,
        File::KeepOutCone {
            axis,
            direction,
            half_angle,
        } => Constraint::state(KeepOutCone::new(
            (*axis).into(),
            (*direction).into(),
            *half_angle,
        )?),
        File::KeepOutSphere { centre, radius } => {
            Constraint::state(KeepOutSphere::new((*centre).into(), *radius)?)
        }
        File::Corridor {
            apex,
            axis,
            half_angle,
        } => Constraint::state(Corridor::new((*apex).into(), (*axis).into(), *half_angle)?),
    })
}

fn components(place: Place, file: &LimitFile) -> Result<Constraint, ConstraintError> {
    let limits = Vector3::from_vec(limits(file, 3)?);
    Ok(Constraint::commands(ComponentLimit::new(place, limits)?))
}

fn norm(place: Place, limit: f64) -> Result<Constraint, ConstraintError> {
    Ok(Constraint::commands(NormLimit::new(place, finite(limit)?)?))
}

fn limits(file: &LimitFile, count: usize) -> Result<Vec<f64>, ConstraintError> {
    let limits = match file {
        LimitFile::All(limit) => vec![*limit; count],
        LimitFile::Each(limits) => limits.clone(),
    };
    if limits.len() != count {
        let expected = format!("one number > 0, or {count} of them");
        return Err(ConstraintError::new("limit", limits, expected));
    }
    limits.into_iter().map(finite).collect()
}

/// Scenes leave out what is not limited.
fn finite(limit: f64) -> Result<f64, ConstraintError> {
    if limit.is_finite() {
        return Ok(limit);
    }
    Err(ConstraintError::new("limit", limit, "a finite number > 0"))
}
