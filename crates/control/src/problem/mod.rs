//! The statement of a problem: dynamics, boundary conditions, actuation, cost and constraints.

mod actuation;
mod allocation;
mod by_step;
mod chances;
mod comparable;
pub mod constraint;
mod dynamics;
mod fuel;
mod off;
mod parameter;
mod pointing;
pub mod terminal;
mod transfer;

pub use actuation::{Actuation, ActuationError, Command, MAX_COMMANDS};
pub(crate) use actuation::{Effects, FEW, Weight, stacked};
pub use allocation::Allocation;
pub(crate) use by_step::ByStep;
pub use chances::{Chances, Uncertainty};
pub(crate) use chances::{Deviations, OF_BODY, OF_STATE};
pub use comparable::Comparable;
pub(crate) use constraint::{
    CommandInequality, InequalitySet, PositionCost, StateInequality, WheelSpeed,
};
pub use constraint::{Constraint, Place};
pub use dynamics::{Dynamics, Motion};
pub(crate) use fuel::Price;
pub(crate) use off::Off;
pub use parameter::ParameterError;
pub use terminal::Terminal;
pub(crate) use terminal::{HalfSet, TerminalSet};
pub use transfer::{Transfer, TransferError, miss};
pub(crate) use transfer::{Vector12, block};
