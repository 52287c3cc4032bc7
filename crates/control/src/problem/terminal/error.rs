use lgvi_lie::orthogonality_error;
use nalgebra::{Matrix3, Vector3};
use thiserror::Error;

/// Why a terminal set is none.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum TerminalError {
    /// A vector is not finite.
    #[error("the target's {which} is {value:?}, expected finite numbers")]
    NotFinite {
        /// Which vector.
        which: &'static str,
        /// Its components.
        value: [f64; 3],
    },
    /// A matrix is not a rotation.
    #[error("the target's attitude is no rotation: {rows:?}, |RᵀR − I| = {error:.1e}")]
    Attitude {
        /// Its rows.
        rows: [[f64; 3]; 3],
        /// `|RᵀR − I|`; 0 of a reflection.
        error: f64,
    },
    /// A direction is not a unit vector.
    #[error("the target's {which} is {value:?} of length {norm}, expected length 1")]
    Unit {
        /// Which vector.
        which: &'static str,
        /// Its components.
        value: [f64; 3],
        /// Its length.
        norm: f64,
    },
    /// The gravitational parameter of a target orbit is not positive.
    #[error("the target orbit's gravitational parameter is {0}, expected a finite number > 0")]
    Gm(f64),
    /// The target orbit is not an ellipse.
    #[error(
        "the target orbit has eccentricity {eccentricity} and specific angular momentum {angular_momentum:?}, expected \
         an ellipse with eccentricity < 1"
    )]
    Orbit {
        /// `|e|`
        eccentricity: f64,
        /// `r × v`
        angular_momentum: [f64; 3],
    },
}

/// How far a matrix may be from a rotation.
const ORTHOGONALITY: f64 = 1e-9;

/// How far from 1 the length of a unit vector may be: enough for three written digits.
const UNIT: f64 = 1e-3;

/// `value` if it is finite.
pub(super) fn finite(
    which: &'static str,
    value: &Vector3<f64>,
) -> Result<Vector3<f64>, TerminalError> {
    if value.iter().all(|component| component.is_finite()) {
        return Ok(*value);
    }
    Err(TerminalError::NotFinite {
        which,
        value: (*value).into(),
    })
}

/// `value` if it is a rotation.
pub(super) fn rotation(value: &Matrix3<f64>) -> Result<Matrix3<f64>, TerminalError> {
    let error = orthogonality_error(value);
    if error <= ORTHOGONALITY && value.determinant() > 0.0 {
        return Ok(*value);
    }
    let rows = std::array::from_fn(|i| std::array::from_fn(|j| value[(i, j)]));
    Err(TerminalError::Attitude { rows, error })
}

/// `value` at length 1 if it is close to that.
pub(super) fn unit(
    which: &'static str,
    value: &Vector3<f64>,
) -> Result<Vector3<f64>, TerminalError> {
    let norm = value.norm();
    if (norm - 1.0).abs() <= UNIT {
        return Ok(value / norm);
    }
    Err(TerminalError::Unit {
        which,
        value: (*value).into(),
        norm,
    })
}
