//! Conversion of a transfer to its own units.

use std::sync::Arc;

use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use nalgebra::SMatrix;

use super::{Rescaled, Units};
use crate::problem::{ByStep, TerminalSet};
use crate::{Transfer, TransferError};

impl Units {
    /// `transfer` in these units.
    ///
    /// # Errors
    /// Returns an error if a value leaves the range of floating-point numbers.
    pub(crate) fn transfer(&self, transfer: &Transfer) -> Result<Transfer, TransferError> {
        let own = self.inverse();
        let body = &transfer.body;
        let inertia = Inertia::new(own.inertia() * body.inertia().matrix())
            .map_err(|source| TransferError::Body(source.into()))?;
        let initial = own.state(&transfer.initial);
        let actuation =
            transfer
                .actuation
                .in_units(&self.loads(), &self.commands, self.cost / self.time)?;
        let drag = body.drag();
        let mut body = RigidBody::new(own.mass() * body.mass(), inertia, Vec::new())?;
        if let Some(drag) = drag {
            body = body.with_drag(drag.in_units(self.length, self.mass(), self.time));
        }
        Ok(Transfer {
            terminal: TerminalSet::new(&transfer.target, self),
            inequalities: transfer.inequalities.in_units(self),
            body,
            field: Arc::new(Rescaled::new(&transfer.field, &transfer.body, self)),
            h: own.time * transfer.h,
            intervals: transfer.intervals,
            initial,
            target: transfer.target.clone(),
            actuation,
            dynamics: transfer.dynamics,
            motion: transfer.motion,
            chances: transfer.chances,
            orbit: transfer.orbit.as_deref().map(|orbit| {
                let positions = orbit.iter().map(|position| own.length * position);
                positions.collect()
            }),
            exchange: transfer.exchange.as_deref().map(|exchange| {
                let unit = self.commands * (self.time / self.place);
                let rows = SMatrix::from_fn(|row, column| unit[column] * exchange[(row, column)]);
                Arc::new(rows)
            }),
            by_step: transfer
                .by_step
                .as_ref()
                .map(|by_step| Arc::new(self.by_step(by_step))),
            rounding: self.rounding(transfer),
            off: transfer.off.clone(),
        })
    }

    /// What changes from step to step, in these units.
    fn by_step(&self, by_step: &ByStep) -> ByStep {
        let costs = self.commands * (self.time / self.cost);
        by_step.scaled(&costs, [self.force(), self.moment()].map(f64::recip))
    }

    /// `state` multiplied by the units.
    pub(crate) fn state(&self, state: &BodyState) -> BodyState {
        BodyState {
            position: self.place * state.position,
            linear_momentum: self.linear_momentum * state.linear_momentum,
            attitude: state.attitude,
            angular_momentum: self.angular_momentum * state.angular_momentum,
        }
    }
}
