//! Units of a transfer's own size, so that results do not depend on the units in which the transfer is stated.
//!
//! Every unit is a power of two, so that conversions only change exponents. Two statements of a transfer whose units
//! differ by powers of two become the same transfer in its own units, bit for bit, and so do their plans.
//!
//! Momenta have independent units instead of `mass · length / time`: a spacecraft's angular momentum is negligible
//! compared with its mass times its orbit's radius times its speed. The units of mass and inertia follow from them, so
//! that the steps keep their form: `δx = (h/m) γ` and `Ω = J⁻¹ Π`.

mod field;
mod problem;
mod rounding;
mod solution;
#[cfg(test)]
mod tests;

use nalgebra::{SVector, Vector3};

pub(crate) use field::Rescaled;

use crate::{Actuation, Command, Transfer};

/// The least rounding error of a quantity, relative to its size.
pub(crate) const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// The size of each unit; all are powers of two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Units {
    time: f64,
    length: f64,
    /// The unit of what is in the place of positions in states.
    place: f64,
    linear_momentum: f64,
    angular_momentum: f64,
    /// The unit of each command.
    commands: Command,
    cost: f64,
}

impl Units {
    /// The units of a transfer. Time: its duration. Length: the greatest distance from the origin at either end. Linear
    /// momentum: the greatest at either end, or the one that covers that distance in the duration. Angular momentum:
    /// the greatest at either end, or the one that turns the body by a radian in the duration. That of wheels has the same
    /// unit.
    pub(crate) fn of(transfer: &Transfer) -> Self {
        let Transfer {
            body,
            h,
            intervals,
            initial,
            ..
        } = transfer;
        let (mass, inertia) = (body.mass(), body.inertia().matrix().trace());
        let duration = h * *intervals as f64;
        let mut end = *initial;
        let [[placed, moves], [_, spins]] = transfer.terminal.aim(&mut end);
        let size = |given: bool, v: &Vector3<f64>| if given { v.norm() } else { 0.0 };
        let momentum = initial
            .linear_momentum
            .norm()
            .max(size(moves, &end.linear_momentum));
        let spin = initial
            .angular_momentum
            .norm()
            .max(size(spins, &end.angular_momentum));
        let distance = transfer.place().norm().max(size(placed, &end.position));
        let lengths = [
            distance.max(h * momentum / mass),
            // The body's own size, for a center of mass that stays at the origin.
            (inertia / mass).sqrt(),
        ];
        let length = lengths.into_iter().find(|length| *length > 0.0);
        let length = length.unwrap_or(1.0);
        let mut sizes = [
            duration,
            momentum.max(mass * length / duration),
            spin.max(inertia / duration),
        ];
        if transfer.orbit.is_some() {
            // Both are angular momenta.
            sizes[2] = sizes[2].max(momentum);
            sizes[1] = sizes[2];
        }
        let [time, linear_momentum, angular_momentum] = sizes.map(power);
        let length = power(length);
        let without_commands = Self {
            time,
            length,
            // Exchanged momenta are angular momenta, too.
            place: match transfer.exchange {
                Some(_) => angular_momentum,
                None => length,
            },
            linear_momentum,
            angular_momentum,
            commands: SVector::repeat(1.0),
            cost: 1.0,
        };
        without_commands.with_commands(&transfer.actuation)
    }

    /// Units of one: those in which the transfer is stated.
    pub(crate) fn ones() -> Self {
        Self {
            time: 1.0,
            length: 1.0,
            place: 1.0,
            linear_momentum: 1.0,
            angular_momentum: 1.0,
            commands: SVector::repeat(1.0),
            cost: 1.0,
        }
    }

    pub(crate) fn time(&self) -> f64 {
        self.time
    }

    pub(crate) fn length(&self) -> f64 {
        self.length
    }

    pub(crate) fn place(&self) -> f64 {
        self.place
    }

    pub(crate) fn linear_momentum(&self) -> f64 {
        self.linear_momentum
    }

    pub(crate) fn angular_momentum(&self) -> f64 {
        self.angular_momentum
    }

    pub(crate) fn commands(&self) -> &Command {
        &self.commands
    }

    pub(crate) fn cost(&self) -> f64 {
        self.cost
    }

    /// Adds the units of the commands and of the cost. Each command's largest load component and the largest weight
    /// become numbers from 1 to 2.
    fn with_commands(mut self, actuation: &Actuation) -> Self {
        let count = actuation.commands();
        let loads = self.loads();
        for (command, unit) in self.commands.iter_mut().enumerate().take(count) {
            let column = actuation.matrix().column(command);
            *unit = power(column.component_div(&loads).amax()).recip();
        }
        let weights = actuation.weight().diagonal();
        let costs = self.commands.component_mul(&self.commands);
        let costs = costs.component_mul(&weights) * self.time;
        self.cost = power(costs.rows(0, count).max());
        self
    }

    /// The reciprocals of the units, which convert back to the units in which the transfer is stated.
    pub(crate) fn inverse(&self) -> Self {
        Self {
            time: self.time.recip(),
            length: self.length.recip(),
            place: self.place.recip(),
            linear_momentum: self.linear_momentum.recip(),
            angular_momentum: self.angular_momentum.recip(),
            commands: self.commands.map(f64::recip),
            cost: self.cost.recip(),
        }
    }

    fn mass(&self) -> f64 {
        self.linear_momentum * self.time / self.length
    }

    fn inertia(&self) -> f64 {
        self.angular_momentum * self.time
    }

    fn force(&self) -> f64 {
        self.linear_momentum / self.time
    }

    fn moment(&self) -> f64 {
        self.angular_momentum / self.time
    }

    /// The units of force and moment.
    pub(crate) fn loads(&self) -> SVector<f64, 6> {
        SVector::from_fn(|row, _| if row < 3 { self.force() } else { self.moment() })
    }

    /// The units of `[δx, δγ, ζ, δΠ]`.
    pub(crate) fn variations(&self) -> SVector<f64, 12> {
        let units = [self.place, self.linear_momentum, 1.0, self.angular_momentum];
        SVector::from_fn(|row, _| units[row / 3])
    }
}

/// The greatest power of two up to `size`, or 1 if `size` is not a normal number.
fn power(size: f64) -> f64 {
    const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
    if size.is_normal() {
        f64::from_bits(size.to_bits() & EXPONENT)
    } else {
        1.0
    }
}
