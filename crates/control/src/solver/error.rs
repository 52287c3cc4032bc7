use lgvi_dynamics::rotation::Unsolvable;
use thiserror::Error;

use crate::discrete::DecouplingError;
use crate::{Dynamics, Motion, Plan, TransferError};

/// The reason why no plan was found.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum PlanError {
    /// Start or target violate an inequality.
    #[error(
        "infeasible: the start or the target fixes the state at step {step}, which violates constraint {constraint} by \
         {violation:.3e} (in parts of a limit, a radius or a length, in radians of a cone)"
    )]
    Infeasible {
        /// Index of the constraint, from 0.
        constraint: usize,
        /// Index of the step, from 0.
        step: usize,
        /// The violation, in parts of a sphere's radius or a corridor's length, or in radians of a cone.
        violation: f64,
    },
    /// No plan that satisfies the inequalities was found, although one may exist.
    #[error(
        "no feasible plan was found; the closest one violates constraint {constraint} by {violation:.3e} at \
         step {step} (in parts of a limit, a radius or a length, in radians of a cone)"
    )]
    NotFound {
        /// Index of the constraint, from 0.
        constraint: usize,
        /// Index of the step, from 0.
        step: usize,
        /// The smallest violation found, in parts of a limit, of a sphere's radius or of a corridor's length, or in
        /// radians of a cone.
        violation: f64,
    },
    /// A plan holds the inequalities at the ends of steps, but not between them, however much they are tightened at the ends.
    #[error(
        "between the ends of step {step}, constraint {constraint} is violated by {violation:.3e} (in parts of a limit, a \
         radius or a length, in radians of a cone); shorter steps help"
    )]
    Between {
        /// Index of the constraint, from 0.
        constraint: usize,
        /// Index of the step, from 0.
        step: usize,
        /// The largest violation in the step, in parts of a limit, of a sphere's radius or of a corridor's length, or in
        /// radians of a cone.
        violation: f64,
        /// The plan.
        best: Option<Box<Plan>>,
    },
    /// No initial guess led to a solution.
    #[error(
        "not converged after {iterations} iterations: violation {violation:.3e} relative to the size of each quantity, \
         expected at most {tolerance:.1e} or what rounding makes of it; stationarity {stationarity:.3e}"
    )]
    NotConverged {
        /// The best iterate as flown, if it can be flown.
        best: Option<Box<Plan>>,
        /// Newton steps made.
        iterations: u32,
        /// Violation of the last iterate.
        violation: f64,
        /// Stationarity of the last iterate.
        stationarity: f64,
        /// Tolerance of the violation.
        tolerance: f64,
    },
    /// A command that costs fuel has no limit among the transfer's constraints.
    #[error(
        "command {command} costs fuel and no constraint of the transfer limits it, expected one without a price"
    )]
    Unlimited {
        /// Index of the command, from 0.
        command: usize,
    },
    /// No plan was found that keeps its own deviations within an inequality.
    #[error(
        "constraint {constraint} does not hold with its probability at step {step}: the deviations of the plan exceed it by \
         {violation:.3e} (in parts of a limit, a radius or a length, in radians of a cone)"
    )]
    Chance {
        /// Index of the constraint, from 0.
        constraint: usize,
        /// Index of the step, from 0.
        step: usize,
        /// By how much the mean and the deviations exceed it.
        violation: f64,
        /// The last plan.
        best: Option<Box<Plan>>,
    },
    /// Constraints with a probability are not planned beside something else.
    #[error("constraints hold with a probability, expected none with one beside {beside}")]
    ChancesBeside {
        /// What it is.
        beside: &'static str,
    },
    /// The plan takes a wheel past the limit of its speed.
    #[error(
        "in step {step} the plan takes wheel {wheel} to the speed {speed:.6e}, expected at most {limit:.6e}"
    )]
    WheelSpeed {
        /// Index of the wheel, from 0.
        wheel: usize,
        /// Index of the step, from 0.
        step: usize,
        /// The speed relative to the body at the end of the step.
        speed: f64,
        /// Its limit.
        limit: f64,
    },
    /// A plan by reaction wheels moves the attitude only, by steps of the LGVI.
    #[error(
        "{motion:?} motion in {dynamics:?} steps, expected Rotation in Lgvi steps: wheels are the commands"
    )]
    WheelsDo {
        /// The discrete dynamics of the transfer.
        dynamics: Dynamics,
        /// The motion of the transfer.
        motion: Motion,
    },
    /// The plan needs more propellant than there is.
    #[error("the plan needs {needed:.6e} of propellant, expected at most {available:.6e}")]
    Propellant {
        /// Mass of the propellant that is used.
        needed: f64,
        /// Mass of the propellant at the start.
        available: f64,
    },
    /// A plan that uses propellant is made in steps of the LGVI; one by thrusters moves position and attitude.
    #[error(
        "{motion:?} motion in {dynamics:?} steps, expected Lgvi steps, and Full motion by thrusters: they use propellant"
    )]
    PropellantDoes {
        /// The discrete dynamics of the transfer.
        dynamics: Dynamics,
        /// The motion of the transfer.
        motion: Motion,
    },
    /// The caller asked to stop.
    #[error("stopped")]
    Stopped {
        /// The last iterate as flown, if it can be flown.
        best: Option<Box<Plan>>,
    },
    /// The transfer's values overflow or underflow in its own units.
    #[error("the transfer leaves the range of numbers in units of its own size: {0}")]
    Units(Box<TransferError>),
    /// One half of the motion cannot be planned by itself.
    #[error(transparent)]
    Decoupling(#[from] DecouplingError),
    /// The body turns too far in a step on every path that was tried.
    #[error("step {step}: {source}")]
    Dynamics {
        /// The step, from 0.
        step: usize,
        /// The turn that is too large.
        source: Unsolvable,
    },
}

impl PlanError {
    /// Whether no plan was found from this start, so that another may lead to one.
    pub(crate) fn is_missing(&self) -> bool {
        matches!(self, Self::NotFound { .. } | Self::NotConverged { .. })
    }

    /// The error with its plan, if it has one, replaced by what `change` makes of it.
    pub(crate) fn with_plan(mut self, change: impl FnOnce(Plan) -> Option<Plan>) -> Self {
        if let Self::Between { best, .. }
        | Self::Chance { best, .. }
        | Self::NotConverged { best, .. }
        | Self::Stopped { best } = &mut self
        {
            *best = best.take().and_then(|plan| change(*plan)).map(Box::new);
        }
        self
    }
}

impl From<TransferError> for PlanError {
    fn from(error: TransferError) -> Self {
        Self::Units(Box::new(error))
    }
}
