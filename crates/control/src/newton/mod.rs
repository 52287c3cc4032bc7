//! Newton's method on all stages (multiple shooting): states, commands and multipliers are solved for together, with
//! one linear-quadratic problem per iteration.

mod conditions;
mod descent;
mod follow;
pub(crate) mod guess;
mod iteration;
mod model;
mod problem;
mod search;
mod trial;
mod turning;

pub(crate) use conditions::{Ending, Inequalities, Satisfied, Unconstrained};
pub(crate) use iteration::{Ended, Newton, Standing, Tolerances};
pub(crate) use model::Kind;
pub(crate) use problem::{Iterate, Problem, strictness};
pub(crate) use turning::Turning;
