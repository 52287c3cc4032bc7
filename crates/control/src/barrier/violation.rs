/// A violated inequality and its step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Violation {
    /// Index of the constraint, from 0.
    pub(crate) constraint: usize,
    /// Index of the step, from 0: the step itself for a command, its end for a state.
    pub(crate) step: usize,
    /// `g`
    pub(crate) amount: f64,
    /// The violation relative to the limit, or as defined by [`StateInequality::excess`](crate::problem::StateInequality::excess).
    pub(crate) excess: f64,
}
