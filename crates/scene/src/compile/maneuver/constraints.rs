use std::f64::consts::{FRAC_PI_2, PI};

use lgvi_control::{Actuation, Constraint, Motion};
use nalgebra::Vector3;

use super::moves;
use crate::file::{ConstraintFile, LimitFile};
use crate::{SceneError, check};

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
            let key = format!("maneuver.constraints[{index}]");
            check_motion(&key, file, motion)?;
            constraint(&key, file, actuation)
        })
        .collect()
}

/// What does not move has no constraints.
fn check_motion(key: &str, file: &ConstraintFile, motion: Motion) -> Result<(), SceneError> {
    let (translates, rotates) = moves(motion);
    let (kind, planned) = match file {
        ConstraintFile::Commands { .. } => ("commands", true),
        ConstraintFile::ForceComponents { .. } => ("force_components", translates),
        ConstraintFile::ForceNorm { .. } => ("force_norm", translates),
        ConstraintFile::KeepOutSphere { .. } => ("keep_out_sphere", translates),
        ConstraintFile::Corridor { .. } => ("corridor", translates),
        ConstraintFile::MomentComponents { .. } => ("moment_components", rotates),
        ConstraintFile::MomentNorm { .. } => ("moment_norm", rotates),
        ConstraintFile::KeepOutCone { .. } => ("keep_out_cone", rotates),
    };
    if planned {
        Ok(())
    } else {
        let expected = "a kind that belongs to the motion that is planned";
        Err(SceneError::value(format!("{key}.kind"), kind, expected))
    }
}

fn constraint(
    key: &str,
    file: &ConstraintFile,
    actuation: &Actuation,
) -> Result<Constraint, SceneError> {
    let key = |name: &str| format!("{key}.{name}");
    Ok(match file {
        ConstraintFile::Commands { limit } => Constraint::Commands {
            limit: commands(&key("limit"), limit, actuation.commands())?,
        },
        ConstraintFile::ForceComponents { limit } => Constraint::ForceComponents {
            limit: axes(&key("limit"), limit)?,
        },
        ConstraintFile::MomentComponents { limit } => Constraint::MomentComponents {
            limit: axes(&key("limit"), limit)?,
        },
        ConstraintFile::ForceNorm { limit } => Constraint::ForceNorm {
            limit: check::positive(&key("limit"), *limit)?,
        },
        ConstraintFile::MomentNorm { limit } => Constraint::MomentNorm {
            limit: check::positive(&key("limit"), *limit)?,
        },
        ConstraintFile::KeepOutCone {
            axis,
            direction,
            half_angle,
        } => Constraint::KeepOutCone {
            axis: check::direction(&key("axis"), *axis)?,
            direction: check::direction(&key("direction"), *direction)?,
            half_angle: angle(&key("half_angle"), *half_angle, PI, "π")?,
        },
        ConstraintFile::KeepOutSphere { centre, radius } => Constraint::KeepOutSphere {
            center: check::vector(&key("centre"), *centre)?,
            radius: check::positive(&key("radius"), *radius)?,
        },
        ConstraintFile::Corridor {
            apex,
            axis,
            half_angle,
        } => Constraint::Corridor {
            apex: check::vector(&key("apex"), *apex)?,
            axis: check::direction(&key("axis"), *axis)?,
            half_angle: angle(&key("half_angle"), *half_angle, FRAC_PI_2, "π/2")?,
        },
    })
}

fn angle(key: &str, value: f64, limit: f64, name: &str) -> Result<f64, SceneError> {
    if value > 0.0 && value < limit {
        Ok(value)
    } else {
        let expected = format!("an angle between 0 and {name} (rad)");
        Err(SceneError::value(key, value, expected))
    }
}

fn axes(key: &str, file: &LimitFile) -> Result<Vector3<f64>, SceneError> {
    Ok(Vector3::from_vec(limits(key, file, 3)?))
}

/// One limit a command; those beyond the last are never met.
fn commands(key: &str, file: &LimitFile, commands: usize) -> Result<[f64; 6], SceneError> {
    let limits = limits(key, file, commands)?;
    Ok(std::array::from_fn(|command| {
        limits.get(command).copied().unwrap_or(f64::MAX)
    }))
}

fn limits(key: &str, file: &LimitFile, count: usize) -> Result<Vec<f64>, SceneError> {
    let limits = match file {
        LimitFile::All(limit) => vec![*limit; count],
        LimitFile::Each(limits) => limits.clone(),
    };
    if limits.len() != count {
        let expected = format!("one number > 0, or {count} of them");
        return Err(SceneError::value(key, limits, expected));
    }
    for limit in &limits {
        check::positive(key, *limit)?;
    }
    Ok(limits)
}
