use std::sync::Arc;

use lgvi_control::constraint::{
    CommandLimit, ComponentLimit, Corridor, FramePose, KeepOutCone, KeepOutSphere, Moving,
    NormLimit, StateConstraint,
};
use lgvi_control::{Actuation, Constraint, Motion, ParameterError, Place};
use nalgebra::Vector3;
use serde::Deserialize;

use super::moves;
use super::prediction::Predictions;
use crate::angle::{self, AngleFile};
use crate::file::{EachFile, RelativeFile};
use crate::{Scene, SceneError};

/// A constraint in the form of the scene file. Each kind has one variant here and one arm in [`constraint`].
#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum ConstraintFile {
    /// Bounds on the commands.
    Commands {
        /// Largest size of each command: one number, or one per actuator.
        limit: EachFile,
    },
    /// Bounds on the components of the force, inertial axes.
    ForceComponents {
        /// Largest size of each component: one number or three.
        limit: EachFile,
    },
    /// Bounds on the components of the moment, body axes.
    MomentComponents {
        /// Largest size of each component: one number or three.
        limit: EachFile,
    },
    /// A bound on the norm of the force.
    ForceNorm {
        /// Largest norm.
        limit: f64,
    },
    /// A bound on the norm of the moment.
    MomentNorm {
        /// Largest norm.
        limit: f64,
    },
    /// A cone that an axis of the body stays out of.
    KeepOutCone {
        /// Axis, body frame, of any length.
        axis: [f64; 3],
        /// Axis of the cone, inertial frame, of any length.
        direction: [f64; 3],
        /// Half-angle of the cone, 0 to π (rad, or a text such as "25 deg").
        half_angle: AngleFile,
        /// Axes that `direction` is relative to; the inertial frame by default.
        relative_to: Option<RelativeFile>,
    },
    /// A sphere that the center of mass stays out of.
    KeepOutSphere {
        /// Center of the sphere, inertial frame.
        #[serde(alias = "centre")]
        center: [f64; 3],
        /// Radius of the sphere.
        radius: f64,
        /// Axes that `center` is relative to; the inertial frame by default.
        relative_to: Option<RelativeFile>,
    },
    /// A cone that the center of mass stays in.
    Corridor {
        /// Apex of the cone, inertial frame.
        apex: [f64; 3],
        /// Axis of the cone from the apex inwards, inertial frame, of any length.
        axis: [f64; 3],
        /// Half-angle of the cone, 0 to π/2 (rad, or a text such as "25 deg").
        half_angle: AngleFile,
        /// Axes that `apex` and `axis` are relative to; the inertial frame by default.
        relative_to: Option<RelativeFile>,
    },
}

/// Compiles the constraints.
pub(super) fn constraints<'s>(
    scene: &Scene,
    files: &'s [ConstraintFile],
    motion: Motion,
    actuation: &Actuation,
    predictions: &mut Predictions<'s>,
) -> Result<Vec<Constraint>, SceneError> {
    files
        .iter()
        .enumerate()
        .map(|(index, file)| {
            let key = |name: &str| format!("maneuver.constraints[{index}].{name}");
            let frame = match file.relative_to() {
                None => None,
                Some(file) => {
                    let axes = predictions.axes(&key("relative_to"), file)?;
                    Some((axes.iter().map(FramePose::from).collect(), scene.h()))
                }
            };
            let constraint = constraint(file, actuation, frame)
                .map_err(|error| SceneError::parameter(key(error.name), error))?;
            check_motion(&key("kind"), &constraint, motion)?;
            Ok(constraint)
        })
        .collect()
}

/// Refuses a constraint on a motion that is not planned.
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

impl ConstraintFile {
    /// Whether it limits components in inertial axes.
    pub(super) fn is_of_inertial_axes(&self) -> bool {
        matches!(self, Self::ForceComponents { .. })
    }

    pub(super) fn relative_to(&self) -> Option<&RelativeFile> {
        match self {
            Self::KeepOutCone { relative_to, .. }
            | Self::KeepOutSphere { relative_to, .. }
            | Self::Corridor { relative_to, .. } => relative_to.as_ref(),
            _ => None,
        }
    }
}

/// The poses of a frame at the ends of steps, and the length of a step.
type Frame = Option<(Arc<[FramePose]>, f64)>;

/// Returns a constraint on states in a frame, or in the inertial frame.
fn state(constraint: impl StateConstraint, frame: Frame) -> Result<Constraint, ParameterError> {
    Ok(match frame {
        None => Constraint::state(constraint),
        Some((poses, h)) => Constraint::state(Moving::new(constraint, poses, h)?),
    })
}

fn constraint(
    file: &ConstraintFile,
    actuation: &Actuation,
    frame: Frame,
) -> Result<Constraint, ParameterError> {
    use ConstraintFile as File;
    use Place::{Attitude, Position};
    Ok(match file {
        File::Commands { limit } => {
            let limits = limits(limit, actuation.commands())?;
            Constraint::commands(CommandLimit::new(&limits)?)
        }
        File::ForceComponents { limit } => components(Position, limit)?,
        File::MomentComponents { limit } => components(Attitude, limit)?,
        File::ForceNorm { limit } => norm(Position, *limit)?,
        File::MomentNorm { limit } => norm(Attitude, *limit)?,
        File::KeepOutCone {
            axis,
            direction,
            half_angle,
            ..
        } => {
            let half_angle = angle::half_turn("half_angle", half_angle)?;
            let cone = KeepOutCone::new((*axis).into(), (*direction).into(), half_angle)?;
            state(cone, frame)?
        }
        File::KeepOutSphere { center, radius, .. } => {
            state(KeepOutSphere::new((*center).into(), *radius)?, frame)?
        }
        File::Corridor {
            apex,
            axis,
            half_angle,
            ..
        } => {
            let half_angle = angle::half_turn("half_angle", half_angle)?;
            let corridor = Corridor::new((*apex).into(), (*axis).into(), half_angle)?;
            state(corridor, frame)?
        }
    })
}

fn components(place: Place, file: &EachFile) -> Result<Constraint, ParameterError> {
    let limits = Vector3::from_vec(limits(file, 3)?);
    Ok(Constraint::commands(ComponentLimit::new(place, limits)?))
}

fn norm(place: Place, limit: f64) -> Result<Constraint, ParameterError> {
    Ok(Constraint::commands(NormLimit::new(place, finite(limit)?)?))
}

fn limits(file: &EachFile, count: usize) -> Result<Vec<f64>, ParameterError> {
    let Some(limits) = file.each(count) else {
        let expected = format!("one number > 0, or {count} of them");
        return Err(ParameterError::new("limit", file.given(), expected));
    };
    limits.into_iter().map(finite).collect()
}

/// Refuses an infinite limit: a scene omits what is not limited.
fn finite(limit: f64) -> Result<f64, ParameterError> {
    if limit.is_finite() {
        return Ok(limit);
    }
    Err(ParameterError::new("limit", limit, "a finite number > 0"))
}
