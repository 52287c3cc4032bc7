//! The rotation group SO(3) as the integrators need it.
//!
//! Notation: `S(x) y = x × y`; a rotation matrix `R` maps body coordinates to inertial ones; variations are
//! left-trivialised, `δR = R S(ζ)`. Angles in rad. Transcendental functions come from `libm`, so that results are the
//! same bits wherever the same instructions run.

mod cayley;
mod eigen;
mod matrix;
mod quaternion;
mod rotation_vector;

pub use cayley::{cay, compose, rotate, rotate_back, to_rotation_vector};
pub use eigen::symmetric_eigen;
pub use matrix::{hat, orthogonality_error, polish, vee};
pub use quaternion::{Quaternion, cos_sinc, cos_sinc_pair};
pub use rotation_vector::{exp, log, right_jacobian_inverse, to_cayley, to_quaternion};
