//! Checks of the parameters of constraints and terminal conditions.

use lgvi_lie::orthogonality_error;
use nalgebra::{Matrix3, Vector3};
use thiserror::Error;

/// An error for a parameter of a constraint or a terminal condition that is out of range.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("`{name}` is {value}, expected {expected}")]
pub struct ParameterError {
    /// The name of the parameter, as spelled in scenes.
    pub name: &'static str,
    /// Its value.
    pub value: String,
    /// The expected range.
    pub expected: String,
}

impl ParameterError {
    /// An error for a value out of the expected range.
    pub fn new(
        name: &'static str,
        value: impl std::fmt::Debug,
        expected: impl Into<String>,
    ) -> Self {
        Self {
            name,
            value: format!("{value:?}"),
            expected: expected.into(),
        }
    }
}

/// Checks a limit: positive, possibly infinite.
pub(in crate::problem) fn limit(value: f64) -> Result<(), ParameterError> {
    if value > 0.0 {
        return Ok(());
    }
    Err(ParameterError::new("limit", value, "a number > 0"))
}

/// Checks a length: positive and finite.
pub(in crate::problem) fn length(name: &'static str, value: f64) -> Result<f64, ParameterError> {
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(ParameterError::new(name, value, "a finite number > 0"))
}

/// Checks a half-angle: in `(0, below)`.
pub(in crate::problem) fn angle(value: f64, below: f64, text: &str) -> Result<f64, ParameterError> {
    if value > 0.0 && value < below {
        return Ok(value);
    }
    let expected = format!("an angle between 0 and {text} (rad)");
    Err(ParameterError::new("half_angle", value, expected))
}

/// Normalizes a vector of any length but zero. A vector that is a unit vector to rounding is returned unchanged.
pub(in crate::problem) fn direction(
    name: &'static str,
    value: Vector3<f64>,
) -> Result<Vector3<f64>, ParameterError> {
    let largest = point(name, value)?.amax();
    if (value.norm_squared() - 1.0).abs() <= 4.0 * f64::EPSILON {
        return Ok(value);
    }
    if largest > 0.0 {
        return Ok((value / largest).normalize());
    }
    let expected = "a vector that is not zero";
    Err(ParameterError::new(name, value.as_slice(), expected))
}

/// Checks that a point is finite.
pub(in crate::problem) fn point(
    name: &'static str,
    value: Vector3<f64>,
) -> Result<Vector3<f64>, ParameterError> {
    if value.iter().all(|component| component.is_finite()) {
        return Ok(value);
    }
    let expected = "three finite numbers";
    Err(ParameterError::new(name, value.as_slice(), expected))
}

/// Tolerance of the orthogonality error of a rotation.
const ORTHOGONALITY: f64 = 1e-9;

/// Checks that a matrix is a rotation.
pub(in crate::problem) fn rotation(
    name: &'static str,
    value: Matrix3<f64>,
) -> Result<Matrix3<f64>, ParameterError> {
    let error = orthogonality_error(&value);
    if error <= ORTHOGONALITY && value.determinant() > 0.0 {
        return Ok(value);
    }
    let rows: [[f64; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| value[(i, j)]));
    let expected = format!("a rotation: |RᵀR − I| is {error:.1e}");
    Err(ParameterError::new(name, rows, expected))
}
