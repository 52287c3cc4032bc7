//! Minimum fuel: the cost is the magnitude of the commands, not its square.

use std::ops::Range;

use nalgebra::Matrix3;

use super::constraint::command_limits;
use super::{Actuation, ActuationError, Command, Constraint};

/// A price on the norm of some of the commands: `p |w|` per unit of time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Price {
    /// The commands, three at most.
    pub(crate) commands: Range<usize>,
    /// `p`
    pub(crate) price: f64,
}

impl Price {
    /// The direction of its commands, or `None` if they are zero.
    pub(crate) fn direction(&self, command: &Command) -> Option<Command> {
        let mut own = Command::zeros();
        let (first, count) = (self.commands.start, self.commands.len());
        own.rows_mut(first, count)
            .copy_from(&command.rows(first, count));
        own.try_normalize(0.0)
    }

    /// `|w|` of its commands.
    pub(crate) fn magnitude(&self, command: &Command) -> f64 {
        command
            .rows(self.commands.start, self.commands.len())
            .norm()
    }
}

impl Actuation {
    /// The actuation at least fuel: the cost of an interval is `h p |w|` instead of `(h/2) wᵀ W w`, for every actuator or thruster, or
    /// for the force as a whole if the commands are force and moment. The weights are the prices `p`. Moments that are commands
    /// keep their quadratic cost.
    ///
    /// # Errors
    /// Returns an error if no constraint without a price limits a command that costs fuel, if the weights of the force differ by axis, or if the
    /// commands are torques of wheels.
    pub fn minimizing_fuel(&self, constraints: &[Constraint]) -> Result<Self, ActuationError> {
        if self.is_of_wheels() {
            return Err(ActuationError::FuelOfWheels);
        }
        if self.minimizes_fuel() {
            return Ok(self.clone());
        }
        let limits = self.limits(constraints);
        let limited = |command: usize| match limits[command] {
            limit if limit.is_finite() => Ok(limit),
            _ => Err(ActuationError::Unlimited { command }),
        };
        let weights = self.weight().diagonal();
        // The quadratic weights of initial guesses: half the price at the limit.
        if self.gains().is_none() {
            let mut prices = Vec::new();
            let mut columns = Vec::new();
            for command in 0..self.commands() {
                let price = weights[command];
                prices.push(Price {
                    commands: command..command + 1,
                    price,
                });
                let column = self.matrix().column(command).into_owned();
                columns.push((column.into(), price / limited(command)?));
            }
            return Ok(self.with_columns(&columns)?.with_prices(prices));
        }
        let force = self.weight().fixed_view::<3, 3>(0, 0).into_owned();
        let price = force[(0, 0)];
        if force != Matrix3::from_diagonal_element(price) {
            let rows = std::array::from_fn(|i| std::array::from_fn(|j| force[(i, j)]));
            return Err(ActuationError::ForcePrices(rows));
        }
        let mut least = f64::INFINITY;
        for axis in 0..3 {
            least = least.min(limited(axis)?);
        }
        let moment = self.weight().fixed_view::<3, 3>(3, 3).into_owned();
        let own = Self::full(&Matrix3::from_diagonal_element(price / least), &moment)?;
        Ok(own.with_prices(vec![Price {
            commands: 0..3,
            price,
        }]))
    }

    /// For each command, the largest size that the constraints allow it alone, or infinity.
    fn limits(&self, constraints: &[Constraint]) -> Command {
        let rows = constraints.iter().flat_map(|constraint| match constraint {
            Constraint::Commands(constraint) => constraint.inequalities(self),
            _ => Vec::new(),
        });
        command_limits(&rows.collect::<Vec<_>>())
    }
}
