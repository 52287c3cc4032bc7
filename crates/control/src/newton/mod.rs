//! Newton's method on all stages (multiple shooting): states, commands and multipliers together, a linear-quadratic
//! problem an iteration.

mod conditions;
