//! Omission of interactions in a simulation, and its effect on the accuracy.
//!
//! Gravity consists of [interactions](crate::gravity::Interaction). Each one is computed in full, in a simplified form
//! (for example between point masses), or not at all. Simplifications that change the result only by rounding are
//! always allowed ([`Skip::Exact`]). Beyond that, an [`Allowance`] limits the neglected acceleration of each body for a
//! given tolerance at the end of a run. A body's interactions share it in proportion to their costs, and it determines
//! the distance from which each may be simplified.
//!
//! The limit on the neglected acceleration is strict. The limit on the final error is only as certain as the measured
//! growth of errors, which is sampled in six directions and doubled: an error that grows more than twice as fast in
//! another direction may exceed the tolerance. Distances are checked in every evaluation and along every step. If a
//! step brings a pair too close for its level, it is repeated with the pair in more detail, so that the allowance is
//! respected.
//!
//! A body without gravitational moments rotates freely. If its rotation is known in closed form, it is computed once
//! per step regardless of the number of stages, and not at all while the body is at rest.

mod allowance;
mod levels;
mod response;
mod summary;
mod switching;
mod term;

pub use allowance::{Allowance, Refusal};
pub use summary::{BodySummary, InteractionSummary, Rotation, Summary, Translation};

pub(crate) use levels::Levels;
pub(crate) use switching::LevelSwitching;

/// The omissions allowed in a simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Skip {
    /// No omissions: every interaction is computed in full, and every body's rotation in every stage.
    #[default]
    Nothing,
    /// Omissions that change the result only by rounding.
    Exact,
    /// In addition, omissions within the allowance.
    Within(Allowance),
}
