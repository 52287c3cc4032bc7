//! Inequalities on commands and states, as smooth functions `g ≤ 0` with two derivatives.
//!
//! Each is scaled to have no dimension: a limit is exceeded by `g` of itself, a sphere is entered by `g` of its radius, a
//! cone by `g` rad, a corridor left by `g` of its length, all to first order.

mod command;
mod error;
mod set;
mod state;

#[cfg(test)]
mod tests;

use nalgebra::Vector3;

pub(crate) use command::CommandInequality;
pub use error::ConstraintError;
pub(crate) use set::InequalitySet;
pub(crate) use state::{Place, StateInequality};

/// An inequality, imposed on each control interval or on the state at the end of each step.
///
/// # Assumptions and limitations
///
/// States are held to it at the ends of steps, not between them. A limit of `+∞` is none. Where start and target decide a
/// state (the end of the first Lie–Euler step, the last state of a transfer to one state), nothing is left to plan, and
/// the inequality is only checked there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Constraint {
    /// Each command within `±limit`; commands beyond those of the actuation are ignored.
    Commands {
        /// One limit a command.
        limit: [f64; 6],
    },
    /// Each component of the control force (inertial frame) within `±limit`.
    ForceComponents {
        /// Limits by axis.
        limit: Vector3<f64>,
    },
    /// Each component of the control moment (body frame) within `±limit`.
    MomentComponents {
        /// Limits by axis.
        limit: Vector3<f64>,
    },
    /// `|u^f| ≤ limit`.
    ForceNorm {
        /// The limit.
        limit: f64,
    },
    /// `|u^m| ≤ limit`.
    MomentNorm {
        /// The limit.
        limit: f64,
    },
    /// A body axis stays out of a cone: `direction · R axis ≤ cos(half_angle)`.
    KeepOutCone {
        /// Unit vector in the body frame.
        axis: Vector3<f64>,
        /// Unit vector in the inertial frame.
        direction: Vector3<f64>,
        /// Of the cone (rad), in `(0, π)`.
        half_angle: f64,
    },
    /// The centre of mass stays out of a sphere: `|x − center| ≥ radius`.
    KeepOutSphere {
        /// Inertial frame.
        center: Vector3<f64>,
        /// Of the sphere.
        radius: f64,
    },
    /// The centre of mass stays in a cone: `axis · (x − apex) ≥ cos(half_angle) |x − apex|`.
    ///
    /// The apex is rounded off by 1e-12 of the corridor's length, the distance of start or target from the apex, whichever
    /// is farther.
    Corridor {
        /// Inertial frame.
        apex: Vector3<f64>,
        /// Unit vector in the inertial frame, from the apex into the cone.
        axis: Vector3<f64>,
        /// Of the cone (rad), in `(0, π/2)`.
        half_angle: f64,
    },
}
