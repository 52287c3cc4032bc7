//! Conversion of solutions to the transfer's own units and back.

use lgvi_dynamics::Load;
use nalgebra::SVector;

use super::Units;
use crate::shooting::{Extremal, Iteration, ShootingError};
use crate::{Plan, PlanError, Progress};

impl Units {
    /// Converts a plan of the transfer to a plan of [`Units::transfer`].
    pub(crate) fn enter(&self, plan: &Plan) -> Plan {
        self.inverse().scaled(plan.clone())
    }

    /// Converts a plan of [`Units::transfer`] to a plan of the transfer.
    pub(crate) fn leave(&self, plan: Plan) -> Plan {
        self.scaled(plan)
    }

    /// Converts an error back, with its plan if it has one.
    pub(crate) fn leave_error(&self, error: PlanError) -> PlanError {
        error.with_plan(|plan| Some(self.leave(plan)))
    }

    /// Converts the progress of a solution back.
    pub(crate) fn leave_progress(&self, now: &Progress) -> Progress {
        Progress {
            cost: self.cost * now.cost,
            ..*now
        }
    }

    /// Converts the progress of shooting back.
    pub(crate) fn leave_iteration(&self, now: &Iteration) -> Iteration {
        Iteration {
            cost: self.cost * now.cost,
            ..*now
        }
    }

    /// Converts the error of shooting back.
    pub(crate) fn leave_shooting(&self, error: ShootingError) -> ShootingError {
        let leave = |now: Iteration| self.leave_iteration(&now);
        match error {
            ShootingError::Singular(now) => ShootingError::Singular(leave(now)),
            ShootingError::LineSearch(now) => ShootingError::LineSearch(leave(now)),
            ShootingError::MaxIterations { last, tolerance } => ShootingError::MaxIterations {
                last: leave(last),
                tolerance,
            },
            ShootingError::Stopped(now) => ShootingError::Stopped(leave(now)),
            other => other,
        }
    }

    /// Converts an extremal of the transfer to one of [`Units::transfer`].
    pub(crate) fn enter_extremal(&self, extremal: &Extremal) -> Extremal {
        self.inverse().scaled_extremal(extremal.clone())
    }

    /// Converts an extremal of [`Units::transfer`] to one of the transfer.
    pub(crate) fn leave_extremal(&self, extremal: Extremal) -> Extremal {
        self.scaled_extremal(extremal)
    }

    /// Converts multipliers of the transfer to those of [`Units::transfer`].
    pub(crate) fn enter_multipliers(&self, multipliers: &SVector<f64, 12>) -> SVector<f64, 12> {
        multipliers.component_mul(&self.inverse().multipliers())
    }

    /// Converts multipliers of [`Units::transfer`] to those of the transfer.
    pub(crate) fn leave_multipliers(&self, multipliers: &SVector<f64, 12>) -> SVector<f64, 12> {
        multipliers.component_mul(&self.multipliers())
    }

    /// The units of multipliers, which pair with variations to give a cost.
    fn multipliers(&self) -> SVector<f64, 12> {
        self.variations().map(|unit| self.cost / unit)
    }

    fn scaled(&self, mut plan: Plan) -> Plan {
        let [multipliers, variations] = [self.multipliers(), self.variations()];
        let loads = self.loads();
        plan.h *= self.time;
        plan.cost *= self.cost;
        plan.paid *= self.cost;
        plan.sweep.scale(self.cost, self.time);
        for state in &mut plan.states {
            *state = self.state(state);
        }
        for command in &mut plan.commands {
            command.component_mul_assign(&self.commands);
        }
        for control in &mut plan.controls {
            *control = self.load(control);
        }
        for multiplier in &mut plan.multipliers {
            multiplier.component_mul_assign(&multipliers);
        }
        for gain in &mut plan.feedback {
            for (mut column, variation) in gain.column_iter_mut().zip(&variations) {
                column.component_mul_assign(&(loads / *variation));
            }
        }
        for gain in &mut plan.actuator_feedback {
            for (mut column, variation) in gain.column_iter_mut().zip(&variations) {
                column.component_mul_assign(&(self.commands / *variation));
            }
        }
        plan
    }

    fn scaled_extremal(&self, mut extremal: Extremal) -> Extremal {
        let multipliers = self.multipliers();
        extremal.cost *= self.cost;
        for state in &mut extremal.states {
            *state = self.state(state);
        }
        for control in &mut extremal.controls {
            *control = self.load(control);
        }
        for multiplier in &mut extremal.multipliers {
            multiplier.component_mul_assign(&multipliers);
        }
        extremal
    }

    fn load(&self, load: &Load) -> Load {
        Load {
            force: self.force() * load.force,
            moment: self.moment() * load.moment,
        }
    }
}
