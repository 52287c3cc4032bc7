//! Newton's method on all stages (multiple shooting): states, commands and multipliers are solved for together, with
//! one linear-quadratic problem per iteration.

mod body_frame;
mod conditions;
mod descent;
mod follow;
pub(crate) mod guess;
mod iteration;
mod model;
mod neighbor;
mod problem;
mod search;
mod step_size;
mod trial;

pub(crate) use body_frame::BodyFrame;
pub(crate) use conditions::{Ending, Inequalities, Satisfied, Unconstrained};
pub(crate) use iteration::{AUGMENTATIONS, Closeness, Ended, Newton, REUSED, Standing, Tolerances};
pub(crate) use model::{ModelError, ModelSettings};
pub(crate) use neighbor::Policies;
pub(crate) use problem::{Iterate, Problem, strictness};
pub(crate) use step_size::{Beside, BySize};
