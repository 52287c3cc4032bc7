//! Units of a transfer's own size, so that no answer depends on those in which it is stated.
//!
//! Every unit is a power of two: into them and back, numbers change their exponents alone. A transfer stated in other units
//! that are powers of two apart is the same transfer in its own, bit for bit, and so is its plan.
//!
//! Momenta have units of their own, not those of `mass · length / time`: a spacecraft's angular momentum is nothing beside
//! its mass times its orbit's radius times its speed. Mass and inertia follow from them, so that steps stay what they are:
//! `δx = (h/m) γ` and `Ω = J⁻¹ Π`.

mod field;
mod problem;
mod rounding;
mod solution;
#[cfg(test)]
mod tests;

use nalgebra::{SVector, Vector3};

pub(crate) use field::Rescaled;

use crate::{Actuation, Transfer};

/// What a quantity misses by rounding at least, relative to its size.
pub(crate) const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// The size of each unit; all are powers of two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Units {
    time: f64,
    length: f64,
    linear_momentum: f64,
    angular_momentum: f64,
    /// Of each command.
    commands: SVector<f64, 6>,
    cost: f64,
}

impl Units {
    /// Those of a transfer: its duration; the greatest distance from the origin at either end; the greatest momentum at
    /// either end, or the one that covers that distance in the duration; the greatest angular momentum at either end, or the
    /// one that turns the body by a radian in the duration.
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
        let distance = initial.position.norm().max(size(placed, &end.position));
        let lengths = [
            distance.max(h * momentum / mass),
            // Nothing moves the center of mass but what the body itself does.
            (inertia / mass).sqrt(),
        ];
        let length = lengths.into_iter().find(|length| *length > 0.0);
        let length = length.unwrap_or(1.0);
        let [time, linear_momentum, angular_momentum] = [
            duration,
            momentum.max(mass * length / duration),
            spin.max(inertia / duration),
        ]
        .map(power);
        let without_commands = Self {
            time,
            length: power(length),
            linear_momentum,
            angular_momentum,
            commands: SVector::repeat(1.0),
            cost: 1.0,
        };
        without_commands.with_commands(&transfer.actuation)
    }

    /// Units of one, those of the transfer itself.
    pub(crate) fn ones() -> Self {
        Self {
            time: 1.0,
            length: 1.0,
            linear_momentum: 1.0,
            angular_momentum: 1.0,
            commands: SVector::repeat(1.0),
            cost: 1.0,
        }
    }

    pub(crate) fn length(&self) -> f64 {
        self.length
    }

    pub(crate) fn commands(&self) -> &SVector<f64, 6> {
        &self.commands
    }

    /// Those of commands, by which none exerts more than a unit, and of the cost, by which none weighs more.
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

    /// Their reciprocals: what is stated in these units is stated in the transfer's by them.
    pub(crate) fn inverse(&self) -> Self {
        Self {
            time: self.time.recip(),
            length: self.length.recip(),
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

    /// Of force and moment.
    fn loads(&self) -> SVector<f64, 6> {
        SVector::from_fn(|row, _| if row < 3 { self.force() } else { self.moment() })
    }

    /// Of `[δx, δγ, ζ, δΠ]`.
    pub(crate) fn variations(&self) -> SVector<f64, 12> {
        let units = [
            self.length,
            self.linear_momentum,
            1.0,
            self.angular_momentum,
        ];
        SVector::from_fn(|row, _| units[row / 3])
    }
}

/// The greatest power of two up to `size`; 1 where there is none.
fn power(size: f64) -> f64 {
    const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
    if size.is_normal() {
        f64::from_bits(size.to_bits() & EXPONENT)
    } else {
        1.0
    }
}
