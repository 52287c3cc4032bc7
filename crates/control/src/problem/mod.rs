//! What is asked: dynamics, boundary conditions, actuation, cost and constraints.

mod actuation;
mod constraint;
mod dynamics;
mod terminal;
mod transfer;

pub use actuation::{Actuation, ActuationError};
pub use constraint::Constraint;
pub use dynamics::{Dynamics, Motion};
pub use terminal::{RotationTarget, Terminal, TranslationTarget};
pub use transfer::{Transfer, TransferError, miss};
pub(crate) use transfer::{Vector12, block};
