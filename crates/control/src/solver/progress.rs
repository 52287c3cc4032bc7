use crate::Plan;
use crate::newton::Standing;

/// How the solver goes about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewtonSettings {
    /// Largest norm of the terminal miss at which a plan is accepted, relative to the size of each quantity. What rounding
    /// makes of a quantity always is.
    ///
    /// A position is as large as the greatest distance from the origin at either end; a momentum as the greatest at either
    /// end, or the one that covers that distance in the duration; an attitude is 1 rad; an angular momentum is as large as
    /// the greatest at either end, or the one that turns the body by 1 rad in the duration. Sizes are rounded down to powers
    /// of two of the transfer's own units.
    pub violation: f64,
    /// [`Certificate::stationarity`](crate::Certificate::stationarity) at which a plan is accepted.
    pub stationarity: f64,
    /// Newton steps at most, for each resolution and guess.
    pub iterations: u32,
    /// Intervals of the first resolution at least.
    pub coarse: usize,
}

impl Default for NewtonSettings {
    fn default() -> Self {
        Self {
            violation: 1e-12,
            stationarity: 1e-8,
            iterations: 300,
            coarse: 50,
        }
    }
}

/// Where a solution starts from.
#[derive(Clone, Copy, Debug)]
pub enum Start<'p> {
    /// From nothing.
    Cold,
    /// From a plan of a similar transfer.
    Warm(&'p Plan),
}

/// What the solver is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// At fewer intervals than asked for.
    Coarse,
    /// At all intervals, without inequalities.
    Fine,
    /// At all intervals, under inequalities.
    Constrained,
}

/// Where the iteration stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Newton steps so far.
    pub iteration: u32,
    /// Trial points so far.
    pub trials: u32,
    /// Length of the last step; 1 before the first.
    pub step_length: f64,
    /// Largest norm of a defect or the terminal miss, relative to the size of each quantity.
    pub violation: f64,
    /// Largest component of the Lagrangian's gradient by commands, relative to the largest term.
    pub stationarity: f64,
    /// The objective.
    pub cost: f64,
    /// What the solver is at.
    pub phase: Phase,
}

impl Standing {
    pub(super) fn progress(&self, phase: Phase) -> Progress {
        Progress {
            iteration: self.iteration,
            trials: self.trials,
            step_length: self.length,
            violation: self.violation,
            stationarity: self.stationarity,
            cost: self.cost,
            phase,
        }
    }
}
