//! The rotation of a rigid body within a step.
//!
//! The discrete rotation is that of a Lie group variational step (2.1): given `g`, the rotation `F` with `F J_d − J_d
//! Fᵀ = S(g)`, computed in the Cayley chart about principal axes. Several `F` satisfy the equation. The correct one
//! lies on the branch that starts from `F = I` as `g` grows from 0, and exists only up to a limit (on a principal axis,
//! 90° per step). `discrete` finds it by a few passes of a scalar iteration, `newton` handles the cases in which these
//! do not converge, and `quartic` determines whether a solution is on the correct branch. The exact rotation of a free
//! body is [`FreeRotation`]. `gyrostat` has both rotations of a body with spinning wheels.

mod discrete;
mod free;
mod gyrostat;
mod lane_quaternion;
mod newton;
mod principal;
mod quartic;

use lgvi_lie::cay;
use nalgebra::{Matrix3, Vector3};
use thiserror::Error;

pub use free::FreeRotation;

pub(crate) use discrete::DiscreteRotation;
pub(crate) use free::FreeRotations;
pub(crate) use gyrostat::Gyrostat;
pub(crate) use lane_quaternion::LaneQuaternion;
pub(crate) use principal::PrincipalAxes;

use crate::Inertia;

/// The solution of the implicit equation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativeRotation {
    /// Cayley vector `f` of `F = cay(f)`.
    pub cayley: Vector3<f64>,
    /// Number of passes or Newton corrections.
    pub iterations: u32,
}

impl RelativeRotation {
    /// The matrix `F`.
    pub fn matrix(&self) -> Matrix3<f64> {
        cay(&self.cayley)
    }
}

/// The implicit equation has no solution: the body would rotate too far in one step.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error(
    "the body would turn by about {turn:.3} rad in one step, past the limit of solvability: \
     expected |J⁻¹ g| ≤ 1 (always solvable), margin {margin:.1e} (solvable when ≥ 0)"
)]
pub struct Unsolvable {
    /// `|J⁻¹ g|`, which approximates the rotation angle.
    pub turn: f64,
    /// Maximum of the solvability quartic before its fold, relative to its value at 0. Negative beyond the limit. For a body
    /// with spinning wheels, 1 less `turn`.
    pub margin: f64,
}

/// Solves `F J_d − J_d Fᵀ = S(g)` (2.1) for finite `g`, body frame.
///
/// # Errors
/// Returns an error if the body would rotate too far.
pub fn solve(inertia: &Inertia, g: &Vector3<f64>) -> Result<RelativeRotation, Unsolvable> {
    let found = inertia.rotation.find(1.0, g, 0.0)?;
    Ok(RelativeRotation {
        cayley: found.rotation.u / found.rotation.w,
        iterations: found.iterations,
    })
}

/// Solves `h S(P) = F J_d − J_d Fᵀ + ½ h S((tr[F] I − Fᵀ) s)`, `P = Π + s`: the rotation of a body in which wheels store the
/// angular momentum `s`, from the momentum `Π` at the beginning of a step `h`; finite numbers, body frame.
///
/// # Errors
/// Returns an error if the body would rotate too far.
pub fn solve_gyrostat(
    inertia: &Inertia,
    stored: &Vector3<f64>,
    h: f64,
    momentum: &Vector3<f64>,
) -> Result<RelativeRotation, Unsolvable> {
    Gyrostat::new(inertia, *stored).relative(h, momentum)
}
