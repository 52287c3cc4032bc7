use lgvi_dynamics::Load;
use nalgebra::{Matrix3, SMatrix, SVector};
use thiserror::Error;

use super::transfer::invert;

/// How commands `w` become force and moment, `u = B w`, and what they cost, `(h/2) wᵀ W w` an interval.
#[derive(Clone, Debug, PartialEq)]
pub struct Actuation {
    /// `B`: rows force (inertial frame) and moment (body frame), a column a command; columns beyond the last are zero.
    matrix: SMatrix<f64, 6, 6>,
    /// `W`, symmetric positive definite; the identity beyond the last command.
    weight: SMatrix<f64, 6, 6>,
    /// Number of commands.
    commands: usize,
    /// `W⁻¹Bᵀ (B W⁻¹ Bᵀ)⁺`
    pseudo_inverse: SMatrix<f64, 6, 6>,
    /// `W_f⁻¹` and `W_m⁻¹` where commands are force and moment themselves.
    gains: Option<[Matrix3<f64>; 2]>,
}

/// Singular values below this part of the norm count as none.
const RANK: f64 = 1e-12;

/// Why an actuation is none.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ActuationError {
    /// A weight is not symmetric positive definite.
    #[error("the {which} weight is not symmetric positive definite: {rows:?}")]
    Weight {
        /// Which weight.
        which: &'static str,
        /// Its rows.
        rows: [[f64; 3]; 3],
    },
    /// A command's weight is not positive.
    #[error("the weight of command {command} is {weight}, expected a finite number > 0")]
    CommandWeight {
        /// Which command, from 0.
        command: usize,
        /// Its weight.
        weight: f64,
    },
    /// Not one to six columns.
    #[error("the actuation has {found} commands, expected 1 to 6")]
    Commands {
        /// How many.
        found: usize,
    },
    /// A column that does nothing, or is not finite.
    #[error(
        "column {command} of the actuation is {column:?}, expected finite numbers, not all zero"
    )]
    Column {
        /// Which column, from 0.
        command: usize,
        /// Force and moment.
        column: [f64; 6],
    },
}

impl Actuation {
    /// Force and moment themselves are the commands, with weights (3×3, symmetric positive definite) in the inertial
    /// frame for forces and in the body frame for moments.
    pub fn full(
        force_weight: &Matrix3<f64>,
        moment_weight: &Matrix3<f64>,
    ) -> Result<Self, ActuationError> {
        let gains = [
            invert("force", force_weight)?,
            invert("moment", moment_weight)?,
        ];
        let mut weight = SMatrix::<f64, 6, 6>::zeros();
        weight.fixed_view_mut::<3, 3>(0, 0).copy_from(force_weight);
        weight.fixed_view_mut::<3, 3>(3, 3).copy_from(moment_weight);
        Ok(Self {
            matrix: SMatrix::identity(),
            pseudo_inverse: SMatrix::identity(),
            weight,
            commands: 6,
            gains: Some(gains),
        })
    }

    /// One to six actuators, each with the force and moment of a unit command and its weight.
    pub fn actuators(columns: &[([f64; 6], f64)]) -> Result<Self, ActuationError> {
        let commands = columns.len();
        if !(1..=6).contains(&commands) {
            return Err(ActuationError::Commands { found: commands });
        }
        let mut matrix = SMatrix::<f64, 6, 6>::zeros();
        let mut weights = SMatrix::<f64, 6, 6>::identity();
        for (command, &(column, weight)) in columns.iter().enumerate() {
            if !column.iter().all(|c| c.is_finite()) || column.iter().all(|c| *c == 0.0) {
                return Err(ActuationError::Column { command, column });
            }
            if !(weight.is_finite() && weight > 0.0) {
                return Err(ActuationError::CommandWeight { command, weight });
            }
            matrix.set_column(command, &SVector::from(column));
            weights[(command, command)] = weight;
        }
        let inverse = SMatrix::<f64, 6, 6>::from_diagonal(&weights.diagonal().map(f64::recip));
        let reach = matrix * inverse * matrix.transpose();
        let flat = RANK * reach.norm();
        let pseudo_inverse = reach
            .pseudo_inverse(flat)
            .map(|reach| inverse * matrix.transpose() * reach)
            .unwrap_or_else(|_| SMatrix::zeros());
        Ok(Self {
            matrix,
            pseudo_inverse,
            weight: weights,
            commands,
            gains: None,
        })
    }

    /// Number of commands.
    pub fn commands(&self) -> usize {
        self.commands
    }

    /// `B` (6×6); columns beyond the last command are zero.
    pub fn matrix(&self) -> &SMatrix<f64, 6, 6> {
        &self.matrix
    }

    /// `W` (6×6); the identity beyond the last command.
    pub fn weight(&self) -> &SMatrix<f64, 6, 6> {
        &self.weight
    }

    /// `W_f⁻¹` and `W_m⁻¹`; `None` unless commands are force and moment themselves.
    pub(crate) fn gains(&self) -> Option<&[Matrix3<f64>; 2]> {
        self.gains.as_ref()
    }

    /// The same commands, but that only those in the range of `selection` (6×U) do anything.
    pub(crate) fn limited_to<const U: usize>(&self, selection: &SMatrix<f64, 6, U>) -> Self {
        let kept = selection * selection.transpose();
        Self {
            matrix: self.matrix * kept,
            pseudo_inverse: kept * self.pseudo_inverse,
            gains: None,
            ..self.clone()
        }
    }

    /// `B w`.
    pub fn load(&self, command: &SVector<f64, 6>) -> Load {
        let load = self.matrix * command;
        Load {
            force: load.fixed_rows::<3>(0).into_owned(),
            moment: load.fixed_rows::<3>(3).into_owned(),
        }
    }

    /// What an interval's command costs: `(h/2) wᵀ W w`.
    pub fn cost(&self, h: f64, command: &SVector<f64, 6>) -> f64 {
        0.5 * h * command.dot(&(self.weight * command))
    }

    /// The cheapest command whose load this is, or comes nearest to it: `W⁻¹Bᵀ (B W⁻¹ Bᵀ)⁺ u`.
    pub fn command(&self, load: &Load) -> SVector<f64, 6> {
        let load = SVector::from_iterator(load.force.iter().chain(&load.moment).copied());
        if self.gains.is_some() {
            return load;
        }
        self.pseudo_inverse * load
    }

    /// What an interval's load costs: that of the cheapest command that has this load, or comes nearest to it.
    pub fn cost_of(&self, h: f64, load: &Load) -> f64 {
        self.cost(h, &self.command(load))
    }
}
