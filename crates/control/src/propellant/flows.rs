//! The mass that commands let flow out.

use crate::problem::Price;
use crate::{Command, Transfer};

/// The mass flow `Σ q |w|` of commands `w`: of the force of each thruster, or of that of the engine.
pub(super) struct Flows {
    each: Vec<Price>,
    one_sided: bool,
}

impl Flows {
    pub(super) fn of(transfer: &Transfer) -> Self {
        let flow = |commands, exhaust_velocity: f64| Price {
            commands,
            price: exhaust_velocity.recip(),
        };
        let mut each = Vec::new();
        if let Some(all) = transfer.body.thrusters() {
            let thrusters = all.thrusters().iter().enumerate();
            each.extend(thrusters.map(|(i, one)| flow(i..i + 1, one.exhaust_velocity)));
            each.extend(
                all.engine()
                    .map(|engine| flow(0..3, engine.exhaust_velocity)),
            );
        }
        Self {
            each,
            one_sided: transfer.actuation.is_fixed_to_body(),
        }
    }

    /// Commands, of which a solver may leave forces of thrusters below 0 by its tolerance.
    pub(super) fn open(&self, command: &Command) -> Command {
        if self.one_sided {
            command.map(|force| force.max(0.0))
        } else {
            *command
        }
    }

    /// `Σ q |w|`
    pub(super) fn rate(&self, command: &Command) -> f64 {
        let command = self.open(command);
        let each = self.each.iter();
        each.map(|flow| flow.price * flow.magnitude(&command)).sum()
    }

    /// The derivative of the mass flow by commands in the direction of `along`.
    pub(super) fn gradient(&self, along: &Command) -> Command {
        let each = self.each.iter();
        each.fold(Command::zeros(), |mut sum, flow| {
            if self.one_sided {
                sum[flow.commands.start] = flow.price;
            } else if let Some(direction) = flow.direction(along) {
                sum += flow.price * direction;
            }
            sum
        })
    }

    /// The largest `|f|/q` of the forces `f` of a condition.
    pub(super) fn largest(&self, forces: &Command) -> f64 {
        let flowing = self.each.iter().filter(|flow| flow.price > 0.0);
        let sizes = flowing.map(|flow| flow.magnitude(forces) / flow.price);
        sizes.fold(0.0, f64::max)
    }
}
