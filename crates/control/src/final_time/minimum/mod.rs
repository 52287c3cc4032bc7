mod families;
mod leap;

use super::approach::Approach;
use super::{FinalTimeError, MOST, ceiling, check_range, is_missing, retimed, slope};
use crate::solver::{NewtonSettings, PlanError, Progress, Start, Warmth, solve, solve_near};
use crate::{Command, Plan, Transfer};
pub use families::search_minimum_time;

/// The part of a final time from which on a shorter one is nearly the same.
const CLOSE: f64 = 0.999;

/// The final times among which the shortest is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeRange {
    /// Lower bound of `T`.
    pub shortest: f64,
    /// Upper bound of `T`.
    pub longest: f64,
    /// Relative tolerance of `T`.
    pub tolerance: f64,
}

/// The plan of the shortest final time `T*`, to the tolerance of the range.
#[derive(Clone, Debug, PartialEq)]
pub struct MinimumTime {
    /// The plan of least cost in that time; its step size is `T/N`.
    pub plan: Plan,
    /// `T`
    pub final_time: f64,
    /// A lower bound of `T*`, or 0 if none is known. It holds for plans of the same family, that is, if the least cost
    /// `J(T)` is a convex function from `T*` to the longest final time tried.
    pub lower_bound: f64,
    /// The longest final time below `T` at which no plan was found. This does not prove that there is none.
    pub not_found: Option<f64>,
    /// Number of transfers solved on the way of this family, including those without a solution.
    pub solves: u32,
}

/// Finds the shortest final time at which there is a plan within the limits of the commands.
///
/// It is the limit `ε → 0` of the least `T + ε J`. From a plan of least cost, Newton's method with the length of the steps as one more
/// unknown leads to the minimum for a small `ε`, and a plan of least cost is planned there. Where this does not narrow `T` enough, plans of
/// least cost are followed to shorter final times, where `dJ/dT = −1/ε` tends to `−∞`. The first plan is that of the transfer's own final
/// time, or of the nearest end of the range, or of the longest if there is none. `T` of the last one is the shortest of the range, or
/// exceeds by at most the tolerance the lower bound or a final time at which no plan was found from this last one or, where commands are
/// one-sided, from a cold start.
///
/// # Assumptions and limitations
/// The minimum is that of the family of plans that contains the first one; [`search_minimum_time`] compares several. The
/// number of intervals is fixed: the minimum in `N` LGVI steps differs from that in continuous time by `O(1/N²)`.
///
/// # Errors
/// Returns an error if a planned command has no limit on both sides, if there is no plan at the longest final time, if the
/// cost is that of fuel, or if a constraint has a price or a probability.
pub fn solve_minimum_time(
    transfer: &Transfer,
    range: &TimeRange,
    start: Start<'_>,
    settings: &NewtonSettings,
    mut observe: impl FnMut(&Progress) -> bool,
) -> Result<MinimumTime, FinalTimeError> {
    let fastest = Fastest::new(transfer, range, settings)?;
    let first = fastest.first(start, &mut observe)?;
    fastest.descend(first, &mut observe)
}

/// A transfer that is to take the least time.
#[derive(Clone, Copy)]
struct Fastest<'t> {
    transfer: &'t Transfer,
    range: TimeRange,
    settings: &'t NewtonSettings,
    /// The greatest cost per unit of time.
    rate: f64,
    /// True if commands are at a limit where they are zero. Near the shortest final time the solver easily loses such plans, and a cold
    /// start may find them again.
    one_sided: bool,
}

/// A plan, its final time, and the number of transfers solved to find it.
struct Timed {
    final_time: f64,
    plan: Plan,
    solves: u32,
}

impl Timed {
    /// The error of the solver at another final time, with this plan if somebody stopped it.
    fn failed(&self, final_time: f64, error: PlanError) -> FinalTimeError {
        match error {
            PlanError::Stopped { .. } => {
                let best = Some(Box::new(self.plan.clone()));
                failed(self.final_time, PlanError::Stopped { best })
            }
            error => failed(final_time, error),
        }
    }
}

impl<'t> Fastest<'t> {
    fn new(
        transfer: &'t Transfer,
        range: &TimeRange,
        settings: &'t NewtonSettings,
    ) -> Result<Self, FinalTimeError> {
        check_range(range.shortest, range.longest, range.tolerance)?;
        if transfer.uses_propellant() {
            return Err(FinalTimeError::Propellant);
        }
        let priced = transfer.inequalities.prices().next().is_some();
        let beside = [
            (transfer.actuation.minimizes_fuel(), "a cost of fuel"),
            (transfer.chances.is_some(), "a probability of constraints"),
            (priced, "a price of a violation"),
        ];
        if let Some((_, beside)) = beside.into_iter().find(|(given, _)| *given) {
            return Err(FinalTimeError::Beside { beside });
        }
        Ok(Self {
            transfer,
            range: *range,
            settings,
            rate: ceiling::rate(transfer)?,
            one_sided: is_one_sided(transfer),
        })
    }

    fn at(&self, final_time: f64) -> Transfer {
        Transfer {
            h: final_time / self.transfer.intervals as f64,
            ..self.transfer.clone()
        }
    }

    /// The plan of the transfer's own final time, or else of the longest.
    fn first(
        &self,
        start: Start<'_>,
        observe: &mut dyn FnMut(&Progress) -> bool,
    ) -> Result<Timed, FinalTimeError> {
        let TimeRange {
            shortest, longest, ..
        } = self.range;
        let mut final_time = self.transfer.h * self.transfer.intervals as f64;
        final_time = final_time.clamp(shortest, longest);
        let mut solves = 0;
        loop {
            solves += 1;
            let timed = self.at(final_time);
            let before = match start {
                Start::Warm(plan) => Some(retimed(plan, timed.h)),
                Start::Cold => None,
            };
            let start = before.as_ref().map_or(Start::Cold, Start::Warm);
            match solve(&timed, start, self.settings, &mut *observe) {
                Ok(plan) => {
                    return Ok(Timed {
                        final_time,
                        plan,
                        solves,
                    });
                }
                Err(error) if !is_missing(&error) => return Err(failed(final_time, error)),
                Err(error) if final_time == longest => {
                    let source = Box::new(error);
                    return Err(FinalTimeError::Unreached { longest, source });
                }
                Err(_) => final_time = longest,
            }
        }
    }

    /// Follows the family of a plan to its shortest final time.
    fn descend(
        &self,
        first: Timed,
        observe: &mut dyn FnMut(&Progress) -> bool,
    ) -> Result<MinimumTime, FinalTimeError> {
        let mut approach = Approach::new(self.range.shortest, self.range.tolerance, self.rate);
        let mut now = first;
        let mut slope = self.slope(&now)?;
        approach.take(now.final_time, now.plan.cost, slope);
        if approach.next().is_some() {
            let leap = self.leap(&now, observe)?;
            approach.prove(leap.bound);
            now.solves += leap.solves;
            if let Some(found) = leap.found {
                (now.final_time, now.plan) = found;
                slope = self.slope(&now)?;
                approach.take(now.final_time, now.plan.cost, slope);
            }
        }
        // The last final time that was tried again without a plan, and whether cold starts find more.
        let (mut confirmed, mut cold) = (None, false);
        loop {
            let next = approach.next();
            let last = approach
                .missed()
                .filter(|missed| confirmed != Some(*missed));
            let Some(shorter) = next.or(last) else {
                return Ok(MinimumTime {
                    plan: now.plan,
                    final_time: now.final_time,
                    lower_bound: approach.bound(),
                    not_found: approach.missed(),
                    solves: now.solves,
                });
            };
            if now.solves >= MOST {
                return Err(FinalTimeError::NotConverged {
                    solves: now.solves,
                    final_time: now.final_time,
                    slope,
                });
            }
            now.solves += 1;
            let timed = self.at(shorter);
            if next.is_none() {
                confirmed = Some(shorter);
            }
            let tries = next.is_some() || !self.one_sided;
            let near = tries.then(|| self.near(&timed, &now.plan, observe));
            let found = match near {
                Some(found) if !(cold && found.as_ref().is_err_and(is_missing)) => found,
                _ => {
                    confirmed = Some(shorter);
                    let found = solve(&timed, Start::Cold, self.settings, &mut *observe);
                    cold |= found.is_ok();
                    found
                }
            };
            match found {
                Ok(found) => {
                    (now.final_time, now.plan) = (shorter, found);
                    slope = self.slope(&now)?;
                    approach.take(now.final_time, now.plan.cost, slope);
                }
                Err(error) if is_missing(&error) => approach.miss(shorter),
                Err(error) => return Err(now.failed(shorter, error)),
            }
        }
    }

    /// The plan of a transfer near one in another time.
    fn near(
        &self,
        timed: &Transfer,
        plan: &Plan,
        observe: &mut dyn FnMut(&Progress) -> bool,
    ) -> Result<Plan, PlanError> {
        let near = retimed(plan, timed.h);
        let mut from = |warmth| solve_near(timed, &near, warmth, self.settings, &mut *observe);
        match from(Warmth::OTHER_TIME) {
            Err(error) if is_missing(&error) && timed.h > CLOSE * plan.h => from(Warmth::ONCE),
            done => done,
        }
    }

    /// `dJ/dT`
    fn slope(&self, at: &Timed) -> Result<f64, FinalTimeError> {
        let slope = slope::by_step(&self.at(at.final_time), &at.plan)?;
        Ok(slope / self.transfer.intervals as f64)
    }
}

fn is_one_sided(transfer: &Transfer) -> bool {
    let none = Command::zeros();
    let mut rows = transfer.inequalities.command.iter();
    rows.any(|row| row.price.is_none() && row.value(&none) == 0.0)
}

fn failed(final_time: f64, source: PlanError) -> FinalTimeError {
    let source = Box::new(source);
    FinalTimeError::Plan { final_time, source }
}
