use nalgebra::{SMatrix, SVector, Vector3};

use super::{CommandConstraint, CommandInequality, Place};
use crate::problem::parameter::limit;
use crate::problem::{Actuation, Command, MAX_COMMANDS, ParameterError};

/// A limit on each command: `|w_i| ≤ limit_i`, or `0 ≤ w_i ≤ limit_i` for one-sided actuators such as thrusters. An infinite
/// limit is no limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommandLimit {
    limit: [f64; MAX_COMMANDS],
    one_sided: bool,
}

/// A limit on each component of the control force (inertial frame) or moment (body frame). An infinite limit is no
/// limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ComponentLimit {
    place: Place,
    limit: Vector3<f64>,
}

/// A limit on the norm of the control force or moment. An infinite limit is no limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormLimit {
    place: Place,
    limit: f64,
}

impl CommandLimit {
    /// A positive limit for each command, in the order of the actuation's. Commands beyond the last limit have none.
    pub fn new(limits: &[f64]) -> Result<Self, ParameterError> {
        limits.iter().copied().try_for_each(limit)?;
        let of = |command: usize| limits.get(command).copied().unwrap_or(f64::INFINITY);
        Ok(Self {
            limit: std::array::from_fn(of),
            one_sided: false,
        })
    }

    /// The limit with commands that are not negative either.
    pub fn one_sided(self) -> Self {
        Self {
            one_sided: true,
            ..self
        }
    }

    /// The limits by command.
    pub fn limit(&self) -> [f64; MAX_COMMANDS] {
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
            .flat_map(|(command, &limit)| {
                let row = SVector::ith(command, 1.0);
                if self.one_sided {
                    from_zero(row, limit)
                } else {
                    within(row, limit)
                }
            })
            .collect()
    }
}

impl ComponentLimit {
    /// Positive limits on the components of the force ([`Place::Position`]) or of the moment ([`Place::Attitude`]).
    pub fn new(place: Place, limits: Vector3<f64>) -> Result<Self, ParameterError> {
        limits.iter().copied().try_for_each(limit)?;
        Ok(Self {
            place,
            limit: limits,
        })
    }

    /// The coordinate that the limited load moves.
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
    /// A positive limit on the norm of the force ([`Place::Position`]) or of the moment ([`Place::Attitude`]).
    pub fn new(place: Place, value: f64) -> Result<Self, ParameterError> {
        limit(value)?;
        Ok(Self {
            place,
            limit: value,
        })
    }

    /// The coordinate that the limited load moves.
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
        if self.limit.is_infinite() || matrix == SMatrix::<f64, 3, MAX_COMMANDS>::zeros() {
            return Vec::new();
        }
        vec![CommandInequality::norm(&(matrix / self.limit))]
    }

    fn place(&self) -> Option<Place> {
        Some(self.place)
    }
}

/// The rows of the actuation's matrix for the force or the moment.
fn load(actuation: &Actuation, place: Place) -> SMatrix<f64, 3, MAX_COMMANDS> {
    let first = match place {
        Place::Position => 0,
        Place::Attitude => 3,
    };
    actuation.matrix().fixed_rows::<3>(first).into_owned()
}

/// `|row · w| ≤ limit` as two inequalities; none if the limit is infinite or no command affects the row.
fn within(row: Command, limit: f64) -> Vec<CommandInequality> {
    if limit.is_infinite() || row == Command::zeros() {
        return Vec::new();
    }
    let row = row / limit;
    vec![
        CommandInequality::linear(row, 1.0),
        CommandInequality::linear(-row, 1.0),
    ]
}

/// `0 ≤ row · w ≤ limit`; no upper limit if it is infinite.
fn from_zero(row: Command, limit: f64) -> Vec<CommandInequality> {
    if limit.is_infinite() {
        return vec![CommandInequality::linear(-row, 0.0)];
    }
    let row = row / limit;
    vec![
        CommandInequality::linear(row, 1.0),
        CommandInequality::linear(-row, 0.0),
    ]
}
