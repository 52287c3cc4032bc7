//! The sets of states in which a transfer may end, as conditions with two derivatives.

mod direction;
mod error;
mod orbit;
mod rotation;
mod set;
mod translation;

#[cfg(test)]
mod tests;

use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, Vector3};

use direction::Direction;
pub use error::TerminalError;
use orbit::KeplerOrbit;
pub(crate) use rotation::RotationSet;
pub(crate) use set::TerminalSet;
pub(crate) use translation::TranslationSet;

/// The set of states in which a transfer may end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terminal {
    /// Of the centre of mass.
    pub translation: TranslationTarget,
    /// Of the attitude.
    pub rotation: RotationTarget,
}

/// Where the centre of mass is to end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TranslationTarget {
    /// At a position with a momentum: six conditions.
    State {
        /// `x_d`, inertial frame.
        position: Vector3<f64>,
        /// `γ_d`, inertial frame.
        linear_momentum: Vector3<f64>,
    },
    /// At a position with any momentum: three conditions.
    Position {
        /// `x_d`, inertial frame.
        position: Vector3<f64>,
    },
    /// Anywhere on the elliptic Kepler orbit of a state: five conditions, the phase is free.
    Orbit {
        /// Gravitational parameter of the attractor.
        gm: f64,
        /// Position of the attractor, inertial frame.
        center: Vector3<f64>,
        /// A position on the orbit, inertial frame.
        position: Vector3<f64>,
        /// The momentum there, inertial frame.
        linear_momentum: Vector3<f64>,
    },
    /// Anywhere.
    Free,
}

/// How the attitude is to end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RotationTarget {
    /// At an attitude with a momentum: six conditions.
    State {
        /// `R_d`.
        attitude: Matrix3<f64>,
        /// `Π_d`, body frame.
        angular_momentum: Vector3<f64>,
    },
    /// At an attitude with any momentum: three conditions.
    Attitude {
        /// `R_d`.
        attitude: Matrix3<f64>,
    },
    /// At any attitude that points a body axis in a direction, with a momentum: five conditions.
    SpinAxis {
        /// Unit vector in the body frame.
        axis: Vector3<f64>,
        /// Unit vector in the inertial frame.
        direction: Vector3<f64>,
        /// `Π_d`, body frame.
        angular_momentum: Vector3<f64>,
    },
    /// Anyhow.
    Free,
}

impl From<BodyState> for Terminal {
    fn from(state: BodyState) -> Self {
        Self {
            translation: TranslationTarget::State {
                position: state.position,
                linear_momentum: state.linear_momentum,
            },
            rotation: RotationTarget::State {
                attitude: state.attitude,
                angular_momentum: state.angular_momentum,
            },
        }
    }
}

impl Terminal {
    /// The only state of the set; `None` where there are more.
    pub fn state(&self) -> Option<BodyState> {
        match (self.translation, self.rotation) {
            (
                TranslationTarget::State {
                    position,
                    linear_momentum,
                },
                RotationTarget::State {
                    attitude,
                    angular_momentum,
                },
            ) => Some(BodyState {
                position,
                linear_momentum,
                attitude,
                angular_momentum,
            }),
            _ => None,
        }
    }
}
