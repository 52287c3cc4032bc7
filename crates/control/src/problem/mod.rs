//! What is asked: dynamics, boundary conditions, actuation, cost and constraints.

mod actuation;
#[cfg(test)]
mod automatic;
pub mod constraint;
mod dynamics;
mod pointing;
mod terminal;
mod transfer;

pub use actuation::{Actuation, ActuationError};
pub(crate) use constraint::{CommandInequality, InequalitySet, StateInequality};
pub use constraint::{Constraint, ConstraintError, Place};
pub use dynamics::{Dynamics, Motion};
pub(crate) use terminal::{RotationSet, TerminalSet, TranslationSet};
pub use terminal::{RotationTarget, Terminal, TerminalError, TranslationTarget};
pub use transfer::{Transfer, TransferError, miss};
pub(crate) use transfer::{Vector12, block};
