//! Minimum fuel: the cost is the magnitude of the commands, not its square.

use std::ops::Range;

use nalgebra::Matrix3;

use super::{Actuation, Command, Transfer, TransferError};

/// A price on the norm of some of the commands: `p |w|` per unit of time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Price {
    /// The commands, three at most.
    pub(crate) commands: Range<usize>,
    /// `p`
    pub(crate) price: f64,
}

impl Price {
    /// `|w|` of its commands.
    pub(crate) fn magnitude(&self, command: &Command) -> f64 {
        command
            .rows(self.commands.start, self.commands.len())
            .norm()
    }
}

impl Transfer {
    /// The transfer at least fuel: the cost of an interval is `h p |f|` instead of `(h/2) wᵀ W w`, for every actuator or
    /// thruster, or for the force as a whole if the commands are force and moment. The weights are the prices `p`. Moments that
    /// are commands keep their quadratic cost.
    ///
    /// # Errors
    /// Returns an error if a command with a price has no limit among the constraints, which come first, if the weights of the
    /// force differ by axis, or if the commands are torques of wheels.
    pub fn minimizing_fuel(self) -> Result<Self, TransferError> {
        let limits = self.inequalities.command_limits();
        Ok(Self {
            actuation: self.actuation.minimizing_fuel(&limits)?,
            ..self
        })
    }
}

impl Actuation {
    /// The actuation with its weights as prices. The quadratic weights become those for which both costs are the same at twice
    /// the limits.
    fn minimizing_fuel(&self, limits: &Command) -> Result<Self, TransferError> {
        if self.is_of_wheels() {
            return Err(TransferError::FuelOfWheels);
        }
        let limited = |command: usize| match limits[command] {
            limit if limit.is_finite() => Ok(limit),
            _ => Err(TransferError::Unlimited { command }),
        };
        let weights = self.weight().diagonal();
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
            return Err(TransferError::ForcePrices(force.into()));
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
}
