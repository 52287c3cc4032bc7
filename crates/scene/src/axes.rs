//! Axes that move with a body, and motions relative to them.

use std::fmt;

use lgvi_dynamics::{BodyState, RigidBody};
use lgvi_lie::polish;
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;

/// Axes at the center of mass of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum AxesFile {
    /// Those of the inertial frame.
    Inertial,
    /// Radial (from the center to the body), transverse, normal (along the orbital angular momentum).
    Rtn,
    /// Local vertical, local horizontal: forward (normal × radial), against the normal, down (to the center).
    Lvlh,
    /// Those of the body's frame.
    Body,
}

impl fmt::Display for AxesFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Inertial => "inertial",
            Self::Rtn => "rtn",
            Self::Lvlh => "lvlh",
            Self::Body => "body",
        })
    }
}

/// Position, attitude and velocities of a body, relative to the inertial frame or to moving axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motion {
    /// Position of the center of mass.
    pub position: Vector3<f64>,
    /// Velocity, as seen in the axes that the position is given in.
    pub velocity: Vector3<f64>,
    /// From the body frame to these axes.
    pub attitude: Matrix3<f64>,
    /// Angular velocity relative to these axes, body frame.
    pub angular_velocity: Vector3<f64>,
}

impl Motion {
    /// A place at rest.
    pub(crate) fn at(position: Vector3<f64>) -> Self {
        Self {
            position,
            velocity: Vector3::zeros(),
            attitude: Matrix3::identity(),
            angular_velocity: Vector3::zeros(),
        }
    }

    /// The inertial motion of a body in a state.
    pub(crate) fn of(body: &RigidBody, state: &BodyState) -> Self {
        Self {
            position: state.position,
            velocity: state.velocity(body),
            attitude: state.attitude,
            angular_velocity: state.angular_velocity(body),
        }
    }
}

/// Moving axes with their origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axes {
    /// Origin, inertial frame.
    pub origin: Vector3<f64>,
    /// `A`: from these axes to the inertial frame.
    pub rotation: Matrix3<f64>,
    /// Velocity of the origin, inertial frame.
    pub velocity: Vector3<f64>,
    /// `ω`: angular velocity, in these axes.
    pub turn: Vector3<f64>,
}

/// If `|r × v|` is below this part of `|r| |v|`, the motion has no plane.
const RADIAL: f64 = 1e-9;

impl Axes {
    /// Returns the axes of a body in inertial motion. The orbital ones belong to its orbit about `center`; they turn with
    /// the angular velocity `|r × v|/r²` about the normal, that of an undisturbed orbit. Returns `None` if there is no orbit.
    pub(crate) fn of(kind: AxesFile, body: &Motion, center: &Motion) -> Option<Self> {
        let (rotation, turn) = match kind {
            AxesFile::Inertial => (Matrix3::identity(), Vector3::zeros()),
            AxesFile::Body => (body.attitude, body.angular_velocity),
            AxesFile::Rtn | AxesFile::Lvlh => {
                let (r, v) = (
                    body.position - center.position,
                    body.velocity - center.velocity,
                );
                let momentum = r.cross(&v);
                let (distance, size) = (r.norm(), momentum.norm());
                let turns = size > RADIAL * distance * v.norm();
                if !turns {
                    return None;
                }
                let (radial, normal) = (r / distance, momentum / size);
                let transverse = normal.cross(&radial);
                let rate = size / (distance * distance);
                match kind {
                    AxesFile::Rtn => (
                        Matrix3::from_columns(&[radial, transverse, normal]),
                        Vector3::new(0.0, 0.0, rate),
                    ),
                    _ => (
                        Matrix3::from_columns(&[transverse, -normal, -radial]),
                        Vector3::new(0.0, -rate, 0.0),
                    ),
                }
            }
        };
        Some(Self {
            origin: body.position,
            rotation: polish(&rotation),
            velocity: body.velocity,
            turn,
        })
    }

    /// The inertial motion of a motion relative to these axes: `x = x₀ + A r`, `v = v₀ + A (u + ω × r)`, `R = A R_r`,
    /// `Ω = R_rᵀ ω + Ω_r`.
    pub(crate) fn moved(&self, relative: &Motion) -> Motion {
        let Motion {
            position,
            velocity,
            attitude,
            angular_velocity,
        } = relative;
        Motion {
            position: self.origin + self.rotation * position,
            velocity: self.velocity + self.rotation * (velocity + self.turn.cross(position)),
            attitude: polish(&(self.rotation * attitude)),
            angular_velocity: attitude.tr_mul(&self.turn) + angular_velocity,
        }
    }
}
