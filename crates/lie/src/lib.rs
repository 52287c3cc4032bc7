//! The Lie groups SO(3) and SE(3): exponential, logarithm and Cayley maps, with their derivatives.
//!
//! ```
//! use lgvi_lie::{Pose, exp, log, right_jacobian};
//! use nalgebra::{Vector3, Vector6};
//!
//! // A quarter turn about z, and back to its rotation vector.
//! let v = Vector3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2);
//! let r = exp(&v);
//! assert!((r * Vector3::x() - Vector3::y()).norm() < 1e-15);
//! assert!((log(&r) - v).norm() < 1e-15);
//!
//! // A change of the rotation vector turns the body by J_r δv about its own axes.
//! let change = Vector3::new(1e-6, -2e-6, 0.5e-6);
//! let turned = r * exp(&(right_jacobian(&v) * change));
//! assert!((turned - exp(&(v + change))).norm() < 1e-11);
//!
//! // A screw motion: one meter along the axis that it turns about.
//! let screw = Pose::exp(&Vector6::new(0.0, 0.0, 1.0, 0.0, 0.0, 1.0));
//! assert!((screw.translation - Vector3::z()).norm() < 1e-15);
//! ```
//!
//! Notation: `S(x) y = x × y`. A rotation matrix `R` maps body coordinates to inertial ones. Variations are
//! left-trivialized, `δR = R S(ζ)`. Angles are in rad. Transcendental functions come from `libm`, so that results are
//! bitwise reproducible wherever the same instructions run.

mod cayley;
mod eigen;
mod jacobian;
mod matrix;
mod pose;
mod quaternion;
mod rotation_vector;
mod tangent;

pub use nalgebra;

pub use cayley::{cay, compose, rotate, rotate_back, to_rotation_vector};
pub use eigen::symmetric_eigen;
pub use jacobian::{
    left_jacobian, left_jacobian_inverse, log_curvature, right_jacobian, right_jacobian_inverse,
};
pub use matrix::{hat, orthogonality_error, polish, vee};
pub use pose::Pose;
pub use quaternion::{Quaternion, cos_sinc, cos_sinc_pair};
pub use rotation_vector::{exp, log, to_cayley, to_quaternion};
pub use tangent::Tangent;
