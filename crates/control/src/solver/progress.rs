use crate::Plan;
use crate::newton::Standing;

/// Settings of the solver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewtonSettings {
    /// Largest norm of the terminal miss at which a plan is accepted, relative to the size of each quantity. The
    /// rounding error of a quantity is always accepted.
    ///
    /// The size of a position is the greatest distance from the origin at either end. The size of a momentum is the
    /// greatest at either end, or the momentum that covers that distance in the duration. The size of an attitude is 1
    /// rad. The size of an angular momentum is the greatest at either end, or the one that turns the body by 1 rad in
    /// the duration. Sizes are rounded down to powers of two of the transfer's own units.
    pub violation: f64,
    /// [`Certificate::stationarity`](crate::Certificate::stationarity) at which a plan is accepted.
    pub stationarity: f64,
    /// Maximum number of Newton steps for each resolution and initial guess.
    pub iterations: u32,
    /// Minimum number of intervals of the first resolution.
    pub coarse: usize,
    /// Whether a cold start follows where a plan to start from leads to none, also one of a series that a solution makes.
    pub falls_back: bool,
}

impl Default for NewtonSettings {
    fn default() -> Self {
        Self {
            violation: 1e-12,
            stationarity: 1e-8,
            iterations: 300,
            coarse: 50,
            falls_back: true,
        }
    }
}

/// The starting point of a solution.
#[derive(Clone, Copy, Debug)]
pub enum Start<'p> {
    /// A cold start without a known plan.
    Cold,
    /// A warm start from the plan of a similar transfer.
    Warm(&'p Plan),
}

/// The phase of a solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Fewer intervals than the transfer has.
    Coarse,
    /// All intervals, without inequalities.
    Fine,
    /// All intervals, with inequalities.
    Constrained,
}

/// Progress of the iteration.
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
    /// Largest component of the gradient of the Lagrangian by commands, relative to the largest term.
    pub stationarity: f64,
    /// The objective.
    pub cost: f64,
    /// The phase of the solution.
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
            cost: self.cost + self.fuel,
            phase,
        }
    }
}

/// Progress of several solutions, whose iterations and trials are counted consecutively.
pub(crate) struct Consecutive<'o> {
    observe: &'o mut dyn FnMut(&Progress) -> bool,
    /// Iterations and trials before the present solution, and with it.
    before: [u32; 2],
    made: [u32; 2],
}

impl<'o> Consecutive<'o> {
    pub(crate) fn new(observe: &'o mut dyn FnMut(&Progress) -> bool) -> Self {
        Self::after([0; 2], observe)
    }

    /// After so many iterations and trials.
    pub(crate) fn after(made: [u32; 2], observe: &'o mut dyn FnMut(&Progress) -> bool) -> Self {
        Self {
            observe,
            before: made,
            made,
        }
    }

    /// Iterations and trials so far.
    pub(crate) fn made(&self) -> [u32; 2] {
        self.made
    }

    /// Observes another solution.
    pub(crate) fn next(&mut self) -> impl FnMut(&Progress) -> bool {
        self.before = self.made;
        move |now: &Progress| {
            self.made = [self.before[0] + now.iteration, self.before[1] + now.trials];
            (self.observe)(&Progress {
                iteration: self.made[0],
                trials: self.made[1],
                ..*now
            })
        }
    }
}

/// How a solver starts from a plan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Warmth {
    /// True if a cold start follows where the plan leads to none.
    pub(super) again: bool,
    /// The barrier parameter to begin with where the plan's multipliers are known, relative to the share of the cost per inequality.
    pub(super) barrier: f64,
}

impl Warmth {
    /// Whether a cold start follows where the plan leads to none.
    pub(crate) fn falls_back(&self) -> bool {
        self.again
    }

    /// From any plan, as the settings say.
    pub(crate) fn of(settings: &NewtonSettings) -> Self {
        Self {
            again: settings.falls_back,
            ..Self::ANY
        }
    }

    /// From any plan.
    pub(crate) const ANY: Self = Self {
        again: true,
        barrier: 1e-4,
    };
    /// The same, without a cold start.
    pub(crate) const ONCE: Self = Self {
        again: false,
        ..Self::ANY
    };
    /// From the plan of another final time, without a cold start. At the small parameter, commands take long to leave their limits;
    /// at this one, plans that are nearly infeasible are not found.
    pub(crate) const OTHER_TIME: Self = Self {
        barrier: 1e-2,
        ..Self::ONCE
    };
}
