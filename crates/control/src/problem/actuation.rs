use std::ops::RangeInclusive;

use lgvi_dynamics::Load;
use lgvi_dynamics::thrusters::{Thruster, Thrusters};
use lgvi_dynamics::wheels::Wheels;
use nalgebra::{Matrix3, SMatrix, SVD, SVector, Vector3};
use thiserror::Error;

use super::Price;
use super::transfer::invert;

/// The largest number of commands.
pub const MAX_COMMANDS: usize = 15;

/// The number of commands up to which the solver and the sums are those of force and moment.
pub(crate) const FEW: usize = 6;

/// Commands `w` of an interval; zero beyond the last command.
pub type Command = SVector<f64, MAX_COMMANDS>;

/// `B`: rows are force and moment, with one column per command.
pub(crate) type Effects = SMatrix<f64, 6, MAX_COMMANDS>;

/// A weight of commands.
pub(crate) type Weight = SMatrix<f64, MAX_COMMANDS, MAX_COMMANDS>;

/// The map from commands `w` to force and moment, `u = B w`, and their cost per interval, `(h/2) wᵀ W w` or that of
/// [minimum fuel](Actuation::minimizing_fuel).
#[derive(Clone, Debug, PartialEq)]
pub struct Actuation {
    /// `B`; columns beyond the last command are zero.
    matrix: Effects,
    /// `W`, symmetric positive definite; the identity beyond the last command.
    weight: Weight,
    /// Number of commands.
    commands: usize,
    /// True if the forces turn with the body.
    fixed_to_body: bool,
    /// True if the commands are torques of the body's wheels.
    of_wheels: bool,
    /// `W⁻¹Bᵀ (B W⁻¹ Bᵀ)⁺`
    pseudo_inverse: SMatrix<f64, MAX_COMMANDS, 6>,
    /// `W_f⁻¹` and `W_m⁻¹` if the commands are force and moment themselves.
    gains: Option<[Matrix3<f64>; 2]>,
    /// Prices of commands at minimum fuel. Their weights then are those of initial guesses.
    prices: Vec<Price>,
}

/// Allowed sizes of nonzero components of a column and of weights, for which `B W⁻¹ Bᵀ` has a finite norm.
const SIZES: RangeInclusive<f64> = 1e-30..=1e30;

/// Iteration limit of the singular value decomposition; a finite matrix takes a few dozen.
const MOST: usize = 1000;

/// Singular values below this part of the norm count as zero.
const RANK: f64 = 1e-12;

/// The reason why an actuation is invalid.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ActuationError {
    /// A weight is not symmetric positive definite.
    #[error("the {which} weight is not symmetric positive definite: {rows:?}")]
    Weight {
        /// Name of the weight, "force" or "moment".
        which: &'static str,
        /// Its rows.
        rows: [[f64; 3]; 3],
    },
    /// A command's weight is not a number from 1e-30 to 1e30.
    #[error("the weight of command {command} is {weight:e}, expected a number from 1e-30 to 1e30")]
    CommandWeight {
        /// Index of the command, from 0.
        command: usize,
        /// Its weight.
        weight: f64,
    },
    /// The number of columns is not 1 to [`MAX_COMMANDS`].
    #[error("the actuation has {found} commands, expected 1 to {MAX_COMMANDS}")]
    Commands {
        /// Number of columns.
        found: usize,
    },
    /// There are more or fewer weights than thrusters or wheels.
    #[error("{found} weights for {expected} {what}, expected one for each")]
    Weights {
        /// "thrusters" or "wheels".
        what: &'static str,
        /// Number of weights.
        found: usize,
        /// Number of thrusters or wheels.
        expected: usize,
    },
    /// A command with a price has no limit.
    #[error("command {command} has no limit, expected one: minimum fuel needs it")]
    Unlimited {
        /// Index of the command, from 0.
        command: usize,
    },
    /// The price of the force depends on its direction.
    #[error("the weight of the force is {0:?}, expected one number: the price of its norm")]
    ForcePrices([[f64; 3]; 3]),
    /// Torques of wheels cost no fuel.
    #[error("the commands are torques of reaction wheels, expected commands that cost fuel")]
    FuelOfWheels,
    /// A column is zero, or a component is out of range.
    #[error(
        "column {command} of the actuation is {column:?}, expected 0 or numbers of a size from 1e-30 to 1e30, not all 0"
    )]
    Column {
        /// Index of the column, from 0.
        command: usize,
        /// Force and moment.
        column: [f64; 6],
    },
}

impl Actuation {
    /// Makes an actuation whose commands are force and moment themselves. The weights (3×3, symmetric positive
    /// definite) are in the inertial frame for forces and in the body frame for moments.
    pub fn full(
        force_weight: &Matrix3<f64>,
        moment_weight: &Matrix3<f64>,
    ) -> Result<Self, ActuationError> {
        let gains = [
            invert("force", force_weight)?,
            invert("moment", moment_weight)?,
        ];
        let mut weight = Weight::identity();
        weight.fixed_view_mut::<3, 3>(0, 0).copy_from(force_weight);
        weight.fixed_view_mut::<3, 3>(3, 3).copy_from(moment_weight);
        Ok(Self {
            matrix: SMatrix::identity(),
            pseudo_inverse: SMatrix::identity(),
            weight,
            commands: 6,
            fixed_to_body: false,
            of_wheels: false,
            gains: Some(gains),
            prices: Vec::new(),
        })
    }

    /// Makes an actuation of 1 to [`MAX_COMMANDS`] actuators, each given by the force (inertial frame) and moment (body
    /// frame) of a unit command, and its weight.
    pub fn actuators(columns: &[([f64; 6], f64)]) -> Result<Self, ActuationError> {
        let commands = columns.len();
        if !(1..=MAX_COMMANDS).contains(&commands) {
            return Err(ActuationError::Commands { found: commands });
        }
        let mut matrix = Effects::zeros();
        let mut weights = Weight::identity();
        for (command, &(column, weight)) in columns.iter().enumerate() {
            let is_known = |c: &f64| *c == 0.0 || SIZES.contains(&c.abs());
            if !column.iter().all(is_known) || column.iter().all(|c| *c == 0.0) {
                return Err(ActuationError::Column { command, column });
            }
            if !SIZES.contains(&weight) {
                return Err(ActuationError::CommandWeight { command, weight });
            }
            matrix.set_column(command, &SVector::from(column));
            weights[(command, command)] = weight;
        }
        Ok(Self {
            matrix,
            pseudo_inverse: pseudo_inverse(&matrix, &weights),
            weight: weights,
            commands,
            fixed_to_body: false,
            of_wheels: false,
            gains: None,
            prices: Vec::new(),
        })
    }

    /// The actuation by a body's thrusters, whose commands are their forces, with a weight for each.
    pub fn thrusters(thrusters: &Thrusters, weights: &[f64]) -> Result<Self, ActuationError> {
        let thrusters = thrusters.thrusters();
        if weights.len() != thrusters.len() {
            return Err(ActuationError::Weights {
                what: "thrusters",
                found: weights.len(),
                expected: thrusters.len(),
            });
        }
        let column = |thruster: &Thruster| {
            let moment = thruster.position.cross(&thruster.direction);
            let column = thruster.direction.iter().chain(&moment);
            SVector::<f64, 6>::from_iterator(column.copied()).into()
        };
        let weights = weights.iter().copied();
        let columns: Vec<_> = thrusters.iter().map(column).zip(weights).collect();
        Self::actuators(&columns).map(Self::fixed_to_body)
    }

    /// The actuation by a body's reaction wheels, whose commands are the torques on them, with a weight for each. Limits of
    /// the torques are constraints, as [`CommandLimit`](crate::constraint::CommandLimit).
    pub fn wheels(wheels: &Wheels, weights: &[f64]) -> Result<Self, ActuationError> {
        let wheels = wheels.wheels();
        if weights.len() != wheels.len() {
            return Err(ActuationError::Weights {
                what: "wheels",
                found: weights.len(),
                expected: wheels.len(),
            });
        }
        let column = |axis: Vector3<f64>| [0.0, 0.0, 0.0, -axis.x, -axis.y, -axis.z];
        let columns = wheels.iter().map(|wheel| column(wheel.axis));
        let columns: Vec<_> = columns.zip(weights.iter().copied()).collect();
        Ok(Self {
            of_wheels: true,
            ..Self::actuators(&columns)?
        })
    }

    /// The first wheel about whose axis its torque does not act.
    pub(crate) fn aside(&self, wheels: &Wheels) -> Option<usize> {
        let acts = |index: usize, axis: &Vector3<f64>| {
            let moment = self.matrix.fixed_view::<3, 1>(3, index);
            moment
                .iter()
                .zip(axis)
                .all(|(moment, axis)| *moment == -axis)
        };
        let mut each = wheels.wheels().iter().enumerate();
        each.find_map(|(index, wheel)| (!acts(index, &wheel.axis)).then_some(index))
    }

    /// The same commands as exchanges of momentum: in the place of forces are the torques on what the body stores, against
    /// the moments on the body.
    pub(crate) fn exchanging(&self) -> Self {
        let mut matrix = self.matrix;
        let moments = matrix.fixed_rows::<3>(3).into_owned();
        matrix.fixed_rows_mut::<3>(0).copy_from(&-moments);
        Self {
            pseudo_inverse: pseudo_inverse(&matrix, &self.weight),
            matrix,
            of_wheels: false,
            ..self.clone()
        }
    }

    /// The actuation with actuators that are fixed to the body, such as thrusters: forces are in the body frame, too, and
    /// turn with it. At each end of a step they have the attitude there.
    pub(crate) fn fixed_to_body(self) -> Self {
        Self {
            fixed_to_body: true,
            gains: None,
            ..self
        }
    }

    /// The actuation by `columns`, as [`Actuation::actuators`], whose forces turn with the body if those of `self` do.
    pub(crate) fn with_columns(&self, columns: &[([f64; 6], f64)]) -> Result<Self, ActuationError> {
        Ok(Self {
            fixed_to_body: self.fixed_to_body,
            ..Self::actuators(columns)?
        })
    }

    /// The actuation with prices on commands.
    pub(super) fn with_prices(self, prices: Vec<Price>) -> Self {
        Self { prices, ..self }
    }

    /// Prices of commands at minimum fuel; none if the cost is quadratic.
    pub(crate) fn prices(&self) -> &[Price] {
        &self.prices
    }

    /// Returns true if the cost is that of fuel.
    pub fn minimizes_fuel(&self) -> bool {
        !self.prices.is_empty()
    }

    /// Returns true if the commands are force and moment themselves.
    pub fn is_of_loads(&self) -> bool {
        self.gains.is_some()
    }

    /// Whether a command has a price.
    pub(crate) fn has_price(&self, command: usize) -> bool {
        let mut prices = self.prices.iter();
        prices.any(|price| price.commands.contains(&command))
    }

    /// The actuation with the given units of force and moment (`loads`), of commands, and of cost per time
    /// (`rate`).
    pub(crate) fn in_units(
        &self,
        loads: &SVector<f64, 6>,
        commands: &Command,
        rate: f64,
    ) -> Result<Self, ActuationError> {
        let weight =
            Weight::from_fn(|i, j| self.weight[(i, j)] * (commands[i] * commands[j] / rate));
        let price = |price: &Price| Price {
            price: price.price * (commands[price.commands.start] / rate),
            ..price.clone()
        };
        let prices = self.prices.iter().map(price).collect();
        if self.gains.is_some() {
            let [force, moment] = [0, 3].map(|at| weight.fixed_view::<3, 3>(at, at).into_owned());
            return Ok(Self::full(&force, &moment)?.with_prices(prices));
        }
        let columns: Vec<_> = (0..self.commands)
            .map(|command| {
                let column = self.matrix.column(command) * commands[command];
                let column = column.component_div(loads);
                (column.into(), weight[(command, command)])
            })
            .collect();
        Ok(self.with_columns(&columns)?.with_prices(prices))
    }

    /// The number of commands.
    pub fn commands(&self) -> usize {
        self.commands
    }

    /// Returns true if the forces turn with the body.
    pub fn is_fixed_to_body(&self) -> bool {
        self.fixed_to_body
    }

    /// Returns true if the commands are torques of the body's wheels.
    pub fn is_of_wheels(&self) -> bool {
        self.of_wheels
    }

    /// `B`; columns beyond the last command are zero.
    pub fn matrix(&self) -> &SMatrix<f64, 6, MAX_COMMANDS> {
        &self.matrix
    }

    /// The number of independent forces and moments that the commands exert without those of these indices.
    pub fn rank_without(&self, off: &[usize]) -> usize {
        let columns = (0..self.commands).filter(|command| !off.contains(command));
        let mut matrix = Effects::zeros();
        for command in columns {
            matrix.set_column(command, &self.matrix.column(command));
        }
        // Forces and moments are independent in any units, so each row has its own.
        for mut row in matrix.row_iter_mut() {
            let size = row.amax();
            if size > 0.0 {
                row /= size;
            }
        }
        let gram = matrix * matrix.transpose();
        let Some(svd) = SVD::try_new(gram, false, false, 5.0 * f64::EPSILON, MOST) else {
            return 0;
        };
        svd.rank(RANK * svd.singular_values.amax())
    }

    /// `W`; the identity beyond the last command.
    pub fn weight(&self) -> &SMatrix<f64, MAX_COMMANDS, MAX_COMMANDS> {
        &self.weight
    }

    /// `W_f⁻¹` and `W_m⁻¹`; `None` unless commands are force and moment themselves.
    pub(crate) fn gains(&self) -> Option<&[Matrix3<f64>; 2]> {
        self.gains.as_ref()
    }

    /// The actuation with the same commands, but only those in the range of `selection` have an effect.
    pub(crate) fn limited_to<const U: usize>(
        &self,
        selection: &SMatrix<f64, MAX_COMMANDS, U>,
    ) -> Self {
        let kept = selection * selection.transpose();
        Self {
            matrix: self.matrix * kept,
            pseudo_inverse: kept * self.pseudo_inverse,
            gains: None,
            ..self.clone()
        }
    }

    /// `B w`; the force is in the body frame if the actuators are fixed to the body.
    pub fn load(&self, command: &Command) -> Load {
        let load = if self.commands <= FEW {
            self.matrix.fixed_columns::<FEW>(0) * command.fixed_rows::<FEW>(0)
        } else {
            self.matrix * command
        };
        Load {
            force: load.fixed_rows::<3>(0).into_owned(),
            moment: load.fixed_rows::<3>(3).into_owned(),
        }
    }

    /// A load in the axes of [`Actuation::load`], from one whose force is in the inertial frame.
    pub(crate) fn in_own_axes(&self, load: &Load, attitude: &Matrix3<f64>) -> Load {
        self.turned(load, &attitude.transpose())
    }

    /// A load whose force is in the inertial frame, from one in the axes of [`Actuation::load`].
    pub fn in_inertial_axes(&self, load: &Load, attitude: &Matrix3<f64>) -> Load {
        self.turned(load, attitude)
    }

    fn turned(&self, load: &Load, turn: &Matrix3<f64>) -> Load {
        if self.fixed_to_body {
            let force = turn * load.force;
            Load { force, ..*load }
        } else {
            *load
        }
    }

    /// The cost of an interval's command: `(h/2) wᵀ W w` of the commands without a price, and `h p |w|` of the others.
    pub fn cost(&self, h: f64, command: &Command) -> f64 {
        let mut unpriced = *command;
        for Price { commands, .. } in &self.prices {
            unpriced.rows_mut(commands.start, commands.len()).fill(0.0);
        }
        self.quadratic(h, &unpriced) + h * self.rate(command)
    }

    /// The cost of fuel per unit of time.
    pub(crate) fn rate(&self, command: &Command) -> f64 {
        let prices = self.prices.iter();
        prices
            .map(|price| price.price * price.magnitude(command))
            .sum()
    }

    fn quadratic(&self, h: f64, command: &Command) -> f64 {
        let product = if self.commands <= FEW {
            let command = command.fixed_rows::<FEW>(0);
            command.dot(&(self.weight.fixed_view::<FEW, FEW>(0, 0) * command))
        } else {
            command.dot(&(self.weight * command))
        };
        0.5 * h * product
    }

    /// The cheapest command whose load is `load`, or comes nearest to it: `W⁻¹Bᵀ (B W⁻¹ Bᵀ)⁺ u`. The force is in the axes of
    /// [`Actuation::load`].
    pub fn command(&self, load: &Load) -> Command {
        let load = stacked(load);
        if self.gains.is_some() {
            return load.fixed_resize(0.0);
        }
        self.pseudo_inverse * load
    }

    /// About the cheapest command of a load that is not negative where it must not be: the cheapest of all, without those
    /// components that would have to be negative.
    pub(crate) fn allocated(&self, load: &Load, one_sided: &[bool; MAX_COMMANDS]) -> Command {
        let wanted = stacked(load);
        let mut used = Command::repeat(1.0);
        let mut command = self.command(load);
        for _ in 0..self.commands {
            let shut = Command::from_fn(|i, _| {
                let negative = one_sided[i] && command[i] < 0.0;
                if negative { 0.0 } else { used[i] }
            });
            if shut == used {
                break;
            }
            used = shut;
            let chosen = self.matrix * Weight::from_diagonal(&used);
            command = pseudo_inverse(&chosen, &self.weight) * wanted;
        }
        command
    }

    /// The cost of an interval's load: that of the cheapest command with this load, or with the load nearest to it.
    pub fn cost_of(&self, h: f64, load: &Load) -> f64 {
        self.cost(h, &self.command(load))
    }
}

/// Force and moment in one vector.
pub(crate) fn stacked(load: &Load) -> SVector<f64, 6> {
    SVector::from_iterator(load.force.iter().chain(&load.moment).copied())
}

/// `W⁻¹Bᵀ (B W⁻¹ Bᵀ)⁺` for a diagonal weight.
pub(super) fn pseudo_inverse(matrix: &Effects, weight: &Weight) -> SMatrix<f64, MAX_COMMANDS, 6> {
    let inverse = Weight::from_diagonal(&weight.diagonal().map(f64::recip));
    let mut reach = matrix * inverse * matrix.transpose();
    // Each component is measured in units of its own reach, so that the nearest load does not depend on the units of force
    // and moment.
    let units = reach.diagonal().map(|reach| {
        if reach > 0.0 {
            reach.sqrt().recip()
        } else {
            0.0
        }
    });
    let units = SMatrix::<f64, 6, 6>::from_diagonal(&units);
    reach = units * reach * units;
    let flat = RANK * reach.norm();
    SVD::try_new(reach, true, true, 5.0 * f64::EPSILON, MOST)
        .and_then(|values| values.pseudo_inverse(flat).ok())
        .map_or_else(SMatrix::zeros, |reach| {
            inverse * matrix.transpose() * units * reach * units
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With values beyond these limits, the singular value decomposition would not terminate.
    #[test]
    fn actuators_and_weights_beyond_the_limits_are_refused() {
        let push = |size: f64| [size, 0.0, 0.0, 0.0, 0.5 * size, 0.0];
        for size in [1e160, -1e160, 1e-160, f64::MAX, 5e-324, f64::NAN] {
            let refused = Actuation::actuators(&[(push(size), 1.0)]);
            assert!(
                matches!(refused, Err(ActuationError::Column { command: 0, .. })),
                "{refused:?}"
            );
            let refused = Actuation::actuators(&[(push(1.0), size)]);
            assert!(
                matches!(
                    refused,
                    Err(ActuationError::CommandWeight { command: 0, .. })
                ),
                "{refused:?}"
            );
        }
        let load = Load {
            force: Vector3::x(),
            moment: Vector3::zeros(),
        };
        for size in [3e-30, 1.0, 1e30] {
            for weight in [1e-30, 1.0, 1e30] {
                let actuation = Actuation::actuators(&[(push(size), weight)]).unwrap();
                let command = actuation.command(&load)[0] * size;
                // Halfway, because the errors of force and moment count equally.
                assert!(
                    (command - 0.5).abs() < 1e-12,
                    "{size:e} {weight:e}: {command}"
                );
            }
        }
    }
}
