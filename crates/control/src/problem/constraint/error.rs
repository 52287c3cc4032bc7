use nalgebra::Vector3;
use thiserror::Error;

/// A parameter of a constraint out of its range.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("the {name} of the constraint is {value}, expected {expected}")]
pub struct ConstraintError {
    /// The name of the parameter, as scenes spell it.
    pub name: &'static str,
    /// Its value.
    pub value: String,
    /// The range of its values.
    pub expected: String,
}

impl ConstraintError {
    /// A parameter with a value out of the expected range.
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

/// A positive limit, infinity included.
pub(super) fn limit(value: f64) -> Result<(), ConstraintError> {
    if value > 0.0 {
        return Ok(());
    }
    Err(ConstraintError::new("limit", value, "a number > 0"))
}

/// A positive finite length.
pub(super) fn length(name: &'static str, value: f64) -> Result<f64, ConstraintError> {
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(ConstraintError::new(name, value, "a finite number > 0"))
}

/// A half-angle in `(0, below)`.
pub(super) fn angle(value: f64, below: f64, text: &str) -> Result<f64, ConstraintError> {
    if value > 0.0 && value < below {
        return Ok(value);
    }
    let expected = format!("an angle between 0 and {text} (rad)");
    Err(ConstraintError::new("half_angle", value, expected))
}

/// The unit vector along one of any length.
pub(super) fn direction(
    name: &'static str,
    value: Vector3<f64>,
) -> Result<Vector3<f64>, ConstraintError> {
    let largest = point(name, value)?.amax();
    if largest > 0.0 {
        return Ok((value / largest).normalize());
    }
    let expected = "a vector that is not zero";
    Err(ConstraintError::new(name, value.as_slice(), expected))
}

/// A finite point.
pub(super) fn point(
    name: &'static str,
    value: Vector3<f64>,
) -> Result<Vector3<f64>, ConstraintError> {
    if value.iter().all(|component| component.is_finite()) {
        return Ok(value);
    }
    let expected = "three finite numbers";
    Err(ConstraintError::new(name, value.as_slice(), expected))
}
