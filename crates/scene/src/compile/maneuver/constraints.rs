use std::sync::Arc;

use lgvi_control::constraint::{
    AngularRate, CommandLimit, ComponentLimit, Corridor, FrameMotion, KeepInSphere, KeepOutCone,
    KeepOutEllipsoid, KeepOutSphere, LineOfSight, Moving, NormLimit, Plume, Speed, StateConstraint,
};
use lgvi_control::{Actuation, Constraint, Motion, ParameterError, Place};
use lgvi_dynamics::RigidBody;
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;

use super::moves;
use super::prediction::Predictions;
use crate::angle::{self, AngleFile};
use crate::axes::Axes;
use crate::file::{AttitudeFile, EachFile, RelativeFile};
use crate::{Scene, SceneError, check};

/// A constraint in the form of the scene file. Each kind has one variant here and one arm in [`constraint`].
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum ConstraintFile {
    /// Bounds on the commands.
    Commands {
        /// Largest size of each command: one number, or one per actuator.
        limit: EachFile,
        /// Cost of a violation per unit of time, in the unit of the cost of commands for each unit of it; by default a violation
        /// is forbidden.
        price: Option<f64>,
    },
    /// Bounds on the components of the force, inertial axes.
    ForceComponents {
        /// Largest size of each component: one number or three.
        limit: EachFile,
        /// Cost of a violation per unit of time, in the unit of the cost of commands for each unit of it; by default a violation
        /// is forbidden.
        price: Option<f64>,
    },
    /// Bounds on the components of the moment, body axes.
    MomentComponents {
        /// Largest size of each component: one number or three.
        limit: EachFile,
        /// Cost of a violation per unit of time, in the unit of the cost of commands for each unit of it; by default a violation
        /// is forbidden.
        price: Option<f64>,
    },
    /// A bound on the norm of the force.
    ForceNorm {
        /// Largest norm.
        limit: f64,
        /// Cost of a violation per unit of time, in the unit of the cost of commands for each unit of it; by default a violation
        /// is forbidden.
        price: Option<f64>,
    },
    /// A bound on the norm of the moment.
    MomentNorm {
        /// Largest norm.
        limit: f64,
        /// Cost of a violation per unit of time, in the unit of the cost of commands for each unit of it; by default a violation
        /// is forbidden.
        price: Option<f64>,
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
        /// Cost of a violation per unit of time, in the unit of the cost of commands for each unit of it; by default a violation
        /// is forbidden.
        price: Option<f64>,
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
        /// Cost of a violation per unit of time, in the unit of the cost of commands for each unit of it; by default a violation
        /// is forbidden.
        price: Option<f64>,
    },
    /// A sphere that the center of mass stays in.
    KeepInSphere {
        /// Center of the sphere, inertial frame.
        #[serde(alias = "centre")]
        center: [f64; 3],
        /// Radius of the sphere.
        radius: f64,
        /// Axes that `center` is relative to; the inertial frame by default.
        relative_to: Option<RelativeFile>,
        /// Cost of a violation per unit of time, in the unit of the cost of commands for each unit of it; by default a violation
        /// is forbidden.
        price: Option<f64>,
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
        /// Cost of a violation per unit of time, in the unit of the cost of commands for each unit of it; by default a violation
        /// is forbidden.
        price: Option<f64>,
    },
    /// A limit on the angular velocity.
    AngularRate {
        /// Largest rate (rad per unit of time).
        limit: f64,
        /// Axis of which the rate is limited, body frame, of any length; by default the rate about any axis is.
        axis: Option<[f64; 3]>,
        /// Cost of a violation per unit of time, in the unit of the cost of commands for each unit of it; by default a violation
        /// is forbidden.
        price: Option<f64>,
    },
    /// A limit on the speed of the center of mass.
    Speed {
        /// Largest speed.
        limit: f64,
        /// Axes that the velocity is relative to, as seen in them; the inertial frame by default.
        relative_to: Option<RelativeFile>,
        /// Cost of a violation per unit of time, in the unit of the cost of commands for each unit of it; by default a violation
        /// is forbidden.
        price: Option<f64>,
    },
    /// An ellipsoid that the center of mass stays out of.
    KeepOutEllipsoid {
        /// Center of the ellipsoid, inertial frame.
        center: [f64; 3],
        /// Semi-axes.
        semi_axes: [f64; 3],
        /// Attitude of the semi-axes, to the inertial frame: a quaternion or a rotation matrix by rows; along the axes of the frame
        /// by default.
        attitude: Option<AttitudeFile>,
        /// Axes that `center` and `attitude` are relative to; the inertial frame by default.
        relative_to: Option<RelativeFile>,
        /// Cost of a violation per unit of time, in the unit of the cost of commands for each unit of it; by default a violation
        /// is forbidden.
        price: Option<f64>,
    },
    /// A point that an axis of the body points at to within an angle.
    LineOfSight {
        /// Axis, body frame, of any length.
        axis: [f64; 3],
        /// The point, inertial frame.
        point: [f64; 3],
        /// Largest angle between the axis and the direction to the point, 0 to π (rad, or a text such as "25 deg").
        half_angle: AngleFile,
        /// Axes that `point` is relative to; the inertial frame by default.
        relative_to: Option<RelativeFile>,
        /// Cost of a violation per unit of time, in the unit of the cost of commands for each unit of it; by default a violation
        /// is forbidden.
        price: Option<f64>,
    },
    /// A point that is not both within an angle of an axis of the body and nearer than a distance, as in a plume.
    Plume {
        /// Axis along the plume, body frame, of any length.
        axis: [f64; 3],
        /// The point, inertial frame.
        point: [f64; 3],
        /// Angle between the axis and the edge of the plume, 0 to π (rad, or a text such as "25 deg").
        half_angle: AngleFile,
        /// Length of the plume.
        distance: f64,
        /// Axes that `point` is relative to; the inertial frame by default.
        relative_to: Option<RelativeFile>,
        /// Cost of a violation per unit of time, in the unit of the cost of commands for each unit of it; by default a violation
        /// is forbidden.
        price: Option<f64>,
    },
}

/// Compiles the constraints that are given at a key.
pub(super) fn constraints<'s>(
    scene: &Scene,
    body: &RigidBody,
    (files, place): (&'s [ConstraintFile], &str),
    motion: Motion,
    actuation: &Actuation,
    predictions: &mut Predictions<'s>,
) -> Result<Vec<Constraint>, SceneError> {
    files
        .iter()
        .enumerate()
        .map(|(index, file)| {
            let key = |name: &str| format!("{place}[{index}].{name}");
            let frame = match file.relative_to() {
                None => None,
                Some(file) => {
                    let axes = predictions.axes(&key("relative_to"), file)?;
                    Some((axes, scene.h()))
                }
            };
            let axes = match file.attitude() {
                Some(attitude) => check::rotation(&key("attitude"), attitude)?,
                None => Matrix3::identity(),
            };
            let constraint = constraint(file, body, actuation, axes, frame)
                .and_then(|constraint| match file.price() {
                    Some(price) => constraint.priced(price),
                    None => Ok(constraint),
                })
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

    pub(crate) fn relative_to(&self) -> Option<&RelativeFile> {
        match self {
            Self::KeepOutCone { relative_to, .. }
            | Self::KeepOutSphere { relative_to, .. }
            | Self::KeepInSphere { relative_to, .. }
            | Self::Corridor { relative_to, .. }
            | Self::KeepOutEllipsoid { relative_to, .. }
            | Self::LineOfSight { relative_to, .. }
            | Self::Speed { relative_to, .. }
            | Self::Plume { relative_to, .. } => relative_to.as_ref(),
            _ => None,
        }
    }

    fn attitude(&self) -> Option<&AttitudeFile> {
        match self {
            Self::KeepOutEllipsoid { attitude, .. } => attitude.as_ref(),
            _ => None,
        }
    }

    fn price(&self) -> Option<f64> {
        match self {
            Self::Commands { price, .. }
            | Self::ForceComponents { price, .. }
            | Self::MomentComponents { price, .. }
            | Self::ForceNorm { price, .. }
            | Self::MomentNorm { price, .. }
            | Self::KeepOutCone { price, .. }
            | Self::KeepOutSphere { price, .. }
            | Self::KeepInSphere { price, .. }
            | Self::Corridor { price, .. }
            | Self::AngularRate { price, .. }
            | Self::Speed { price, .. }
            | Self::KeepOutEllipsoid { price, .. }
            | Self::LineOfSight { price, .. }
            | Self::Plume { price, .. } => *price,
        }
    }
}

/// The motion of a frame at the ends of steps, and the length of a step.
type Frame = Option<(Arc<[Axes]>, f64)>;

/// Returns a constraint on states in a frame, or in the inertial frame.
fn state(constraint: impl StateConstraint, frame: Frame) -> Result<Constraint, ParameterError> {
    Ok(match frame {
        None => Constraint::state(constraint),
        Some((axes, h)) => {
            let motions = axes.iter().map(FrameMotion::from);
            Constraint::state(Moving::new(constraint, motions, h)?)
        }
    })
}

fn constraint(
    file: &ConstraintFile,
    body: &RigidBody,
    actuation: &Actuation,
    axes: Matrix3<f64>,
    frame: Frame,
) -> Result<Constraint, ParameterError> {
    use ConstraintFile as File;
    use Place::{Attitude, Position};
    Ok(match file {
        File::Commands { limit, .. } => {
            let limits = limits(limit, actuation.commands())?;
            Constraint::commands(CommandLimit::new(&limits)?)
        }
        File::ForceComponents { limit, .. } => components(Position, limit)?,
        File::MomentComponents { limit, .. } => components(Attitude, limit)?,
        File::ForceNorm { limit, .. } => norm(Position, *limit)?,
        File::MomentNorm { limit, .. } => norm(Attitude, *limit)?,
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
        File::KeepInSphere { center, radius, .. } => {
            state(KeepInSphere::new((*center).into(), *radius)?, frame)?
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
        File::AngularRate { limit, axis, .. } => {
            let rate = AngularRate::new(*limit, body.inertia())?;
            Constraint::state(match axis {
                Some(axis) => rate.about((*axis).into())?,
                None => rate,
            })
        }
        File::Speed { limit, .. } => state(Speed::new(*limit, body.mass())?, frame)?,
        File::KeepOutEllipsoid {
            center, semi_axes, ..
        } => {
            let (center, semi_axes) = ((*center).into(), (*semi_axes).into());
            state(KeepOutEllipsoid::new(center, semi_axes, axes)?, frame)?
        }
        File::LineOfSight {
            axis,
            point,
            half_angle,
            ..
        } => {
            let half_angle = angle::half_turn("half_angle", half_angle)?;
            let sight = LineOfSight::new((*axis).into(), (*point).into(), half_angle)?;
            state(sight, frame)?
        }
        File::Plume {
            axis,
            point,
            half_angle,
            distance,
            ..
        } => {
            let half_angle = angle::half_turn("half_angle", half_angle)?;
            let (axis, point) = ((*axis).into(), (*point).into());
            state(Plume::new(axis, point, half_angle, *distance)?, frame)?
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
