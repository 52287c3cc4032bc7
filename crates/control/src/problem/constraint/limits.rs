use nalgebra::{Matrix3x6, SVector, Vector3};

use super::{CommandConstraint, CommandInequality, Place};
use crate::problem::Actuation;
use crate::problem::ParameterError;
use crate::problem::parameter::limit;

/// A limit of each command: `|w_i| ≤ limit_i`. An infinite limit is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommandLimit {
    limit: [f64; 6],
}

/// A limit of each component of the control force (inertial frame) or moment (body frame). An infinite limit is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ComponentLimit {
    place: Place,
    limit: Vector3<f64>,
}

/// A limit of the norm of the control force or moment. An infinite limit is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormLimit {
    place: Place,
    limit: f64,
}

impl CommandLimit {
    /// One positive limit a command; those beyond the commands of the actuation are ignored.
    pub fn new(limits: [f64; 6]) -> Result<Self, ParameterError> {
        limits.into_iter().try_for_each(limit)?;
        Ok(Self { limit: limits })
    }

    /// The limits by command.
    pub fn limit(&self) -> [f64; 6] {
        self.limit
    }
}

impl CommandConstraint for CommandLimit {
    fn name(&self) -> &'static str {
        "commands"
    }

    fn inequalities(&self, actuation: &Actuation) -> Vec<CommandInequality> {
        let limits = self.limit.iter().take(actuation.commands()).enumerate();
        limits
            .flat_map(|(command, &limit)| within(SVector::ith(command, 1.0), limit))
            .collect()
    }
}

impl ComponentLimit {
    /// Positive limits of the components of the force that moves the position, or of the moment that turns the attitude.
    pub fn new(place: Place, limits: Vector3<f64>) -> Result<Self, ParameterError> {
        limits.iter().copied().try_for_each(limit)?;
        Ok(Self {
            place,
            limit: limits,
        })
    }

    /// What the limited load moves.
    pub fn place(&self) -> Place {
        self.place
    }

    /// The limits by axis.
    pub fn limit(&self) -> Vector3<f64> {
        self.limit
    }
}

impl CommandConstraint for ComponentLimit {
    fn name(&self) -> &'static str {
        match self.place {
            Place::Position => "force_components",
            Place::Attitude => "moment_components",
        }
    }

    fn inequalities(&self, actuation: &Actuation) -> Vec<CommandInequality> {
        let matrix = load(actuation, self.place);
        (0..3)
            .flat_map(|axis| within(matrix.row(axis).transpose(), self.limit[axis]))
            .collect()
    }

    fn place(&self) -> Option<Place> {
        Some(self.place)
    }
}

impl NormLimit {
    /// A positive limit of the norm of the force that moves the position, or of the moment that turns the attitude.
    pub fn new(place: Place, value: f64) -> Result<Self, ParameterError> {
        limit(value)?;
        Ok(Self {
            place,
            limit: value,
        })
    }

    /// What the limited load moves.
    pub fn place(&self) -> Place {
        self.place
    }

    /// The limit.
    pub fn limit(&self) -> f64 {
        self.limit
    }
}

impl CommandConstraint for NormLimit {
    fn name(&self) -> &'static str {
        match self.place {
            Place::Position => "force_norm",
            Place::Attitude => "moment_norm",
        }
    }

    fn inequalities(&self, actuation: &Actuation) -> Vec<CommandInequality> {
        let matrix = load(actuation, self.place);
        if self.limit.is_infinite() || matrix == Matrix3x6::zeros() {
            return Vec::new();
        }
        vec![CommandInequality::norm(&(matrix / self.limit))]
    }

    fn place(&self) -> Option<Place> {
        Some(self.place)
    }
}

/// The rows of the actuation's matrix that make the force or the moment.
fn load(actuation: &Actuation, place: Place) -> Matrix3x6<f64> {
    let first = match place {
        Place::Position => 0,
        Place::Attitude => 3,
    };
    actuation.matrix().fixed_rows::<3>(first).into_owned()
}

/// `|row · w| ≤ limit`, where commands reach the row at all.
fn within(row: SVector<f64, 6>, limit: f64) -> Vec<CommandInequality> {
    if limit.is_infinite() || row == SVector::<f64, 6>::zeros() {
        return Vec::new();
    }
    let row = row / limit;
    vec![
        CommandInequality::linear(row),
        CommandInequality::linear(-row),
    ]
}
