//! What a simulation leaves out, and what that costs in accuracy.
//!
//! Gravity consists of [interactions](crate::gravity::Interaction), each of which is computed in full, as between points of
//! mass, or not at all. What leaves nothing out but rounding is always taken ([`Skip::Exact`]). Beyond that an
//! [`Allowance`] says how much of every body's acceleration may be neglected for a tolerance at the end of a run, shared by the
//! body's interactions as their costs are; it tells the distance from which each may be simplified. That no more is neglected is
//! proven. That the end errs by no more than the tolerance is as certain as how fast errors grow, which is measured in six
//! directions and taken twice as great: an error that grows more than twice as fast in another direction may exceed it. Distances are watched, in every evaluation and along every step: one that brings a pair nearer than that is made
//! anew with the pair in more detail, so that what is neglected stays within the allowance.
//!
//! A body on which gravity has no moment turns freely. Where its rotation is known in closed form it turns once a step, in
//! however many stages the step is made, and not at all while it is at rest.

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

/// What may be left out of a simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Skip {
    /// Nothing: every interaction is computed in full, and every body's rotation in every stage.
    #[default]
    Nothing,
    /// What makes no difference but rounding.
    Exact,
    /// That, and what neglects no more than is allowed.
    Within(Allowance),
}
