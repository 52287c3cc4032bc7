use nalgebra::Vector3;
use thiserror::Error;

use crate::problem::terminal::UNIT;

/// Why a constraint is none; constraints count from 0.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ConstraintError {
    /// A limit or radius is not positive.
    #[error("constraint {constraint}: its {which} is {value}, expected > 0")]
    Limit {
        /// Which constraint.
        constraint: usize,
        /// Which quantity.
        which: &'static str,
        /// Its value.
        value: f64,
    },
    /// The half-angle of a cone is out of range.
    #[error(
        "constraint {constraint}: its half-angle is {value} rad, expected between 0 and {below}, both excluded"
    )]
    Angle {
        /// Which constraint.
        constraint: usize,
        /// The angle (rad).
        value: f64,
        /// What it must be less than (rad).
        below: f64,
    },
    /// A direction is not a unit vector.
    #[error(
        "constraint {constraint}: its {which} is {value:?} of length {norm}, expected length 1"
    )]
    Unit {
        /// Which constraint.
        constraint: usize,
        /// Which vector.
        which: &'static str,
        /// Its components.
        value: [f64; 3],
        /// Its length.
        norm: f64,
    },
    /// A point is not finite.
    #[error("constraint {constraint}: its {which} is {value:?}, expected finite numbers")]
    NotFinite {
        /// Which constraint.
        constraint: usize,
        /// Which point.
        which: &'static str,
        /// Its components.
        value: [f64; 3],
    },
}

/// The constraint that is being read.
#[derive(Clone, Copy)]
pub(super) struct Reader(pub(super) usize);

impl Reader {
    /// A positive limit; `None` of an infinite one.
    pub(super) fn limit(
        self,
        which: &'static str,
        value: f64,
    ) -> Result<Option<f64>, ConstraintError> {
        if value > 0.0 {
            return Ok(value.is_finite().then_some(value));
        }
        Err(ConstraintError::Limit {
            constraint: self.0,
            which,
            value,
        })
    }

    /// A positive finite length.
    pub(super) fn length(self, which: &'static str, value: f64) -> Result<f64, ConstraintError> {
        self.limit(which, value)?.ok_or(ConstraintError::Limit {
            constraint: self.0,
            which,
            value,
        })
    }

    /// An angle in `(0, below)`.
    pub(super) fn angle(self, value: f64, below: f64) -> Result<f64, ConstraintError> {
        if value > 0.0 && value < below {
            return Ok(value);
        }
        Err(ConstraintError::Angle {
            constraint: self.0,
            value,
            below,
        })
    }

    /// A vector of length 1, brought to it exactly.
    pub(super) fn unit(
        self,
        which: &'static str,
        value: &Vector3<f64>,
    ) -> Result<Vector3<f64>, ConstraintError> {
        let norm = value.norm();
        if (norm - 1.0).abs() <= UNIT {
            return Ok(value / norm);
        }
        Err(ConstraintError::Unit {
            constraint: self.0,
            which,
            value: (*value).into(),
            norm,
        })
    }

    /// A finite point.
    pub(super) fn point(
        self,
        which: &'static str,
        value: &Vector3<f64>,
    ) -> Result<Vector3<f64>, ConstraintError> {
        if value.iter().all(|component| component.is_finite()) {
            return Ok(*value);
        }
        Err(ConstraintError::NotFinite {
            constraint: self.0,
            which,
            value: (*value).into(),
        })
    }
}
