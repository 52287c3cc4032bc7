//! Transfers whose final time is free within a range.

mod approach;
mod ceiling;
mod minimum;
mod root;
mod slope;

use thiserror::Error;

use crate::discrete::DecouplingError;
use crate::solver::{NewtonSettings, PlanError, Progress, Start, solve};
use crate::{Plan, Transfer, TransferError};
pub use minimum::{MinimumTime, TimeRange, search_minimum_time, solve_minimum_time};
use root::{Next, Root};

/// A free final time `T = N h` and its cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FinalTime {
    /// Lower bound of `T`.
    pub shortest: f64,
    /// Upper bound of `T`.
    pub longest: f64,
    /// Cost per unit of time: `J + weight·T` is minimized.
    pub weight: f64,
    /// Relative tolerance of `T`.
    pub tolerance: f64,
}

/// Optimality of the final time found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeOptimality {
    /// Any change of the final time increases the cost.
    Stationary,
    /// The shortest final time, although a shorter one would cost less.
    Shortest,
    /// The longest final time, although a longer one would cost less.
    Longest,
}

/// A plan with its final time.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedPlan {
    /// The plan; its step size is `T/N`.
    pub plan: Plan,
    /// `T`
    pub final_time: f64,
    /// Optimality of `T`.
    pub optimality: TimeOptimality,
    /// `d(J + weight·T)/dT` at `T`.
    pub slope: f64,
    /// Number of transfers solved.
    pub solves: u32,
}

/// The reason why no plan with a free final time was found.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum FinalTimeError {
    /// The range of final times is invalid.
    #[error(
        "the final time ranges from {shortest} to {longest}, expected finite numbers, 0 < shortest <= longest"
    )]
    Range {
        /// Its lower end.
        shortest: f64,
        /// Its upper end.
        longest: f64,
    },
    /// The cost of time is not finite, or the tolerance is not finite and positive.
    #[error("{what} is {value}, expected a finite number {expected}")]
    Value {
        /// Name of the parameter.
        what: &'static str,
        /// The value.
        value: f64,
        /// The expected range.
        expected: &'static str,
    },
    /// The final time of a plan that uses propellant is not optimized.
    #[error("the commands use propellant, expected commands that use none")]
    Propellant,
    /// No plan was found at a final time: at the first one, or closer and closer to one that had a plan.
    #[error("final time {final_time}: {source}")]
    Plan {
        /// `T`
        final_time: f64,
        /// The error of the solver.
        source: Box<PlanError>,
    },
    /// The time has no minimum, since a command can be arbitrarily large.
    #[error(
        "command {command} has no limit, expected limits of all commands: without them the time has no minimum"
    )]
    Unlimited {
        /// Index of the command, from 0.
        command: usize,
    },
    /// The shortest time is found from costs that are quadratic and have no part beside that of the commands.
    #[error("a minimum time is planned beside {beside}, expected none")]
    Beside {
        /// What it is.
        beside: &'static str,
    },
    /// No plan was found at the longest final time.
    #[error("the target is not reached within the longest final time {longest}: {source}")]
    Unreached {
        /// The upper bound of `T`.
        longest: f64,
        /// The error of the solver at that time.
        source: Box<PlanError>,
    },
    /// The derivative of the cost cannot be computed.
    #[error(transparent)]
    Slope(#[from] DecouplingError),
    /// The search has not converged.
    #[error(
        "the final time is not found after {solves} transfers: slope {slope:.3e} at {final_time}"
    )]
    NotConverged {
        /// Number of transfers solved.
        solves: u32,
        /// The last `T`.
        final_time: f64,
        /// The slope at that `T`.
        slope: f64,
    },
}

impl Transfer {
    /// The transfer with the same number of steps in another final time `T`.
    pub fn with_final_time(self, final_time: f64) -> Result<Self, TransferError> {
        let h = final_time / self.intervals as f64;
        if !(h.is_finite() && h > 0.0) {
            return Err(TransferError::Step(h));
        }
        Ok(Self { h, ..self })
    }

    /// The index of the first planned command without a limit on both sides, for which [`solve_minimum_time`] has no
    /// solution.
    pub fn unlimited_command(&self) -> Option<usize> {
        match ceiling::rate(self) {
            Err(FinalTimeError::Unlimited { command }) => Some(command),
            _ => None,
        }
    }
}

/// Maximum number of transfers solved.
const MOST: u32 = 100;

/// Maximum number of times that a step to another final time is halved because no plan was found.
const HALVINGS: u32 = 12;

/// Minimizes `J + weight·T`. Finds the local minimum downhill from the transfer's own final time, or from the nearest
/// end of the range. Each transfer starts from the path of the previous plan, so that the winding of the attitude is
/// kept.
///
/// # Assumptions and limitations
/// `J` may have several minima over `T`; one of them is found. The number of intervals is fixed, so that the step size
/// grows with `T`.
pub fn solve_final_time(
    transfer: &Transfer,
    time: &FinalTime,
    start: Start<'_>,
    settings: &NewtonSettings,
    mut observe: impl FnMut(&Progress) -> bool,
) -> Result<TimedPlan, FinalTimeError> {
    check(time)?;
    if transfer.uses_propellant() {
        return Err(FinalTimeError::Propellant);
    }
    if transfer.chances.is_some() {
        let beside = "a free final time";
        return Err(FinalTimeError::Plan {
            final_time: transfer.h * transfer.intervals as f64,
            source: Box::new(PlanError::ChancesBeside { beside }),
        });
    }
    let intervals = transfer.intervals as f64;
    let mut search = Root::new([time.shortest, time.longest], time.tolerance);
    let mut final_time = (transfer.h * intervals).clamp(time.shortest, time.longest);
    let mut last: Option<(f64, Plan)> = None;
    let mut halvings = 0;
    let mut slope = f64::NAN;
    for solves in 1..=MOST {
        let timed = Transfer {
            h: final_time / intervals,
            ..transfer.clone()
        };
        let before = match (&last, start) {
            (Some((_, plan)), _) => Some(retimed(plan, timed.h)),
            (None, Start::Warm(plan)) => Some(retimed(plan, timed.h)),
            (None, Start::Cold) => None,
        };
        let start = before.as_ref().map_or(Start::Cold, Start::Warm);
        let plan = match (solve(&timed, start, settings, &mut observe), &last) {
            (Ok(plan), _) => plan,
            (Err(error), Some((good, _))) if is_missing(&error) && halvings < HALVINGS => {
                halvings += 1;
                final_time = 0.5 * (final_time + good);
                continue;
            }
            (Err(source), _) => {
                return Err(FinalTimeError::Plan {
                    final_time,
                    source: Box::new(source),
                });
            }
        };
        slope = slope::by_step(&timed, &plan)? / intervals + time.weight;
        let optimality = match search.next(final_time, slope) {
            Next::Try(next) => {
                last = Some((final_time, plan));
                final_time = next;
                continue;
            }
            Next::Minimum => TimeOptimality::Stationary,
            Next::Lower => TimeOptimality::Shortest,
            Next::Upper => TimeOptimality::Longest,
        };
        return Ok(TimedPlan {
            plan,
            final_time,
            optimality,
            slope,
            solves,
        });
    }
    Err(FinalTimeError::NotConverged {
        solves: MOST,
        final_time,
        slope,
    })
}

/// True if the solver found no plan for the transfer, whatever stands in the way.
fn is_missing(error: &PlanError) -> bool {
    matches!(
        error,
        PlanError::NotConverged { .. }
            | PlanError::Infeasible { .. }
            | PlanError::NotFound { .. }
            | PlanError::Between { .. }
            | PlanError::WheelSpeed { .. }
            | PlanError::Dynamics { .. }
    )
}

/// The plan's path with another step size: momenta scale as `1/h`, commands and multipliers as `1/h²`.
fn retimed(plan: &Plan, h: f64) -> Plan {
    let ratio = plan.h / h;
    let mut plan = plan.clone();
    plan.h = h;
    let last = plan.states.len().saturating_sub(1);
    for state in plan.states.iter_mut().take(last).skip(1) {
        state.linear_momentum *= ratio;
        state.angular_momentum *= ratio;
    }
    for command in &mut plan.commands {
        *command *= ratio * ratio;
    }
    for multiplier in &mut plan.multipliers {
        *multiplier *= ratio * ratio;
    }
    plan
}

fn check(time: &FinalTime) -> Result<(), FinalTimeError> {
    let FinalTime {
        shortest,
        longest,
        weight,
        tolerance,
    } = *time;
    check_range(shortest, longest, tolerance)?;
    if !weight.is_finite() {
        return Err(FinalTimeError::Value {
            what: "the cost of time",
            value: weight,
            expected: "",
        });
    }
    Ok(())
}

fn check_range(shortest: f64, longest: f64, tolerance: f64) -> Result<(), FinalTimeError> {
    let range = shortest > 0.0 && shortest <= longest && longest.is_finite();
    if !range {
        return Err(FinalTimeError::Range { shortest, longest });
    }
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(FinalTimeError::Value {
            what: "the tolerance",
            value: tolerance,
            expected: "> 0",
        });
    }
    Ok(())
}
