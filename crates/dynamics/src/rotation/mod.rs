//! The rotation of a rigid body within a step.
//!
//! The discrete one is that of a Lie group variational step (2.1): given `g`, the rotation `F` with
//! `F J_d − J_d Fᵀ = S(g)`, found in the Cayley chart about principal axes. Several `F` satisfy the equation; the one
//! wanted is the one that grows from `F = I` as `g` grows from 0. It exists up to a limit only (on a principal axis, 90°
//! a step). `discrete` finds it in a few passes on one number, `newton` where those do not converge, and `quartic` tells
//! whether it is that one. The exact rotation of a free body is [`FreeRotation`].

mod discrete;
mod free;
mod newton;
mod principal;
mod quartic;

use lgvi_lie::cay;
use nalgebra::{Matrix3, Vector3};
use thiserror::Error;

pub use free::FreeRotation;

pub(crate) use discrete::{DiscreteRotation, Rotation, Solved};
pub(crate) use principal::PrincipalAxes;

use crate::Inertia;

/// The solution of an implicit equation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativeRotation {
    /// Cayley vector `f` of `F = cay(f)`.
    pub cayley: Vector3<f64>,
    /// Passes or Newton corrections made.
    pub iterations: u32,
}

impl RelativeRotation {
    /// The matrix `F`.
    pub fn matrix(&self) -> Matrix3<f64> {
        cay(&self.cayley)
    }
}

/// The implicit equation has no solution: the body would turn too far in one step.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error(
    "the body would turn by about {turn:.3} rad in one step, past the limit of solvability: \
     expected |J⁻¹ g| ≤ 1 (always solvable), margin {margin:.1e} (solvable when ≥ 0)"
)]
pub struct Unsolvable {
    /// `|J⁻¹ g|`, about the angle that the body would turn by.
    pub turn: f64,
    /// Greatest value of the solvability quartic before its fold, relative to its value at 0; negative past the limit.
    pub margin: f64,
}

/// Solves `F J_d − J_d Fᵀ = S(g)` (2.1) for finite `g`, body frame.
///
/// # Errors
/// Where the body would turn too far.
pub fn solve(inertia: &Inertia, g: &Vector3<f64>) -> Result<RelativeRotation, Unsolvable> {
    let found = inertia.rotation.find(1.0, g, 0.0)?;
    Ok(RelativeRotation {
        cayley: found.rotation.u / found.rotation.w,
        iterations: found.iterations,
    })
}
