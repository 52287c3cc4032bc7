//! Inequalities on states between the ends of steps.
//!
//! A plan holds them at the ends of its steps. Where the motion of a step exceeds one in between, it is tightened at both ends
//! of the step, and the plan is solved again from where it is, until no step exceeds any.

use super::attempt::Solver;
use super::class::Class;
use super::crest::highest;
use super::error::PlanError;
use crate::Plan;
use crate::discrete::Within;
use crate::problem::InequalitySet;

/// By how much an inequality may be exceeded between the ends of steps, unless rounding makes more of it.
pub(crate) const TOLERANCE: f64 = 1e-7;
/// Maximum number of plans with tightened inequalities.
const ROUNDS: u32 = 24;
/// Maximum number of times that a tightening is halved because no plan was found.
const HALVINGS: u32 = 3;
/// Number of first rounds in which an inequality that is tightened by this much more than necessary is released again.
const RELEASES: u32 = 2;
/// Factor by which inequalities are tightened more in later rounds, so that they end.
const HURRY: f64 = 2.0;
const TOO_MUCH: f64 = 1e-3;
/// Part of a margin within which a value is at it.
const ACTIVE: f64 = 1e-3;
/// The most that a tightening may be extrapolated, in multiples of what is exceeded.
const FARTHEST: f64 = 4.0;

/// What an inequality reaches in a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reached {
    /// By how much it is exceeded, beyond what it is at fixed ends.
    pub(crate) excess: f64,
    /// The greater of the values at those ends that are planned, or `None` if neither is.
    pub(crate) ends: Option<f64>,
}

/// By how much an inequality is tightened at the ends of a step.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Margin {
    pub(crate) amount: f64,
    /// The last tightening, and by how much the inequality was exceeded before it.
    last: Option<[f64; 2]>,
}

impl Margin {
    /// Changes the margin by what is reached: first by all that a step exceeds its ends, then by secants.
    pub(crate) fn adjust(&mut self, reached: &Reached, aim: f64, hurry: f64) {
        let Some(ends) = reached.ends else {
            return;
        };
        let excess = reached.excess + aim;
        // What is not active yet has no effect.
        let idle = if excess > 0.0 {
            (-ends - self.amount).max(0.0)
        } else {
            0.0
        };
        let factor = match self.last {
            Some([change, before]) if idle <= change.abs() => {
                let slope = change / (before - excess);
                if slope > 0.0 {
                    slope.clamp(0.25, FARTHEST)
                } else {
                    1.0
                }
            }
            _ => 1.0,
        };
        let change = (hurry * factor * excess + idle).max(-self.amount);
        self.amount += change;
        self.last = Some([change, excess]);
    }

    /// True if the step is farther from exceeding the inequality than it has to be, because of this margin.
    fn is_too_much(&self, reached: &Reached) -> bool {
        let active = |ends: f64| ends >= -self.amount * (1.0 + ACTIVE);
        self.amount > TOO_MUCH && reached.excess < -TOO_MUCH && reached.ends.is_some_and(active)
    }
}

impl<C> Solver<'_, C> {
    /// A plan near one that holds the inequalities on states at the ends of steps, which holds them between the ends too.
    /// Returns `plan` itself if it does.
    pub(super) fn between<const X: usize, const U: usize>(
        &mut self,
        plan: Plan,
    ) -> Result<Plan, PlanError>
    where
        C: Class<X, U>,
    {
        let set = &self.transfer.inequalities;
        if set.state.is_empty() || set.only_at_ends {
            return Ok(plan);
        }
        let margins = vec![Margin::default(); self.transfer.intervals];
        self.settled(plan, vec![margins; set.state.len()])
    }

    /// The plan from a similar one that holds the inequalities between the ends of steps by margins: with these margins first.
    /// Returns `None` if it has none, or if there is no plan with them.
    pub(super) fn between_as<const X: usize, const U: usize>(
        &mut self,
        similar: &Plan,
    ) -> Result<Option<Plan>, PlanError>
    where
        C: Class<X, U>,
    {
        let set = &self.transfer.inequalities;
        let comparable = similar.states.len() == self.transfer.intervals + 1;
        if set.state.is_empty() || set.only_at_ends || !comparable {
            return Ok(None);
        }
        let tolerance = self.barrier_tolerances().violation.max(TOLERANCE);
        let kept = |reached: &Reached| {
            let touches = (-TOO_MUCH..=tolerance).contains(&reached.excess);
            let amount = reached.ends.filter(|ends| touches && *ends < -tolerance);
            Margin {
                amount: amount.map_or(0.0, |ends| -ends),
                last: None,
            }
        };
        let rows = self.reached(similar).into_iter();
        let margins: Vec<Vec<_>> = rows.map(|row| row.iter().map(kept).collect()).collect();
        if margins.iter().flatten().all(|margin| margin.amount == 0.0) {
            return Ok(None);
        }
        match self.once(similar, set, &margins)? {
            Some(plan) => self.settled(plan, margins).map(Some),
            None => Ok(None),
        }
    }

    /// [`Solver::between`] for a plan with these margins. A plan that holds the inequalities is kept until a cheaper one, with
    /// smaller margins, holds them too.
    fn settled<const X: usize, const U: usize>(
        &mut self,
        mut plan: Plan,
        mut margins: Vec<Vec<Margin>>,
    ) -> Result<Plan, PlanError>
    where
        C: Class<X, U>,
    {
        let set = &self.transfer.inequalities;
        let tolerance = self.barrier_tolerances().violation.max(TOLERANCE);
        let mut reached = self.reached(&plan);
        let mut held = None;
        for round in 0..=ROUNDS {
            let worst = worst(&reached);
            let releases = round < RELEASES;
            let hurry = if releases { 1.0 } else { HURRY };
            let mut all = margins.iter().flatten().zip(reached.iter().flatten());
            let too_much = releases && all.any(|(margin, reached)| margin.is_too_much(reached));
            if worst.excess <= tolerance {
                let inequality = &mut plan.certificate.inequality;
                *inequality = inequality.max(worst.excess);
                if !too_much {
                    return Ok(plan);
                }
                held = Some(plan.clone());
            }
            if round == ROUNDS {
                break;
            }
            let before = margins.clone();
            let all = margins.iter_mut().flatten().zip(reached.iter().flatten());
            for (margin, reached) in all {
                if reached.excess > tolerance || releases && margin.is_too_much(reached) {
                    margin.adjust(reached, 0.5 * tolerance, hurry);
                }
            }
            plan = match self.tightened(&plan, set, &before, &mut margins) {
                Ok(Some(next)) => next,
                Ok(None) => break,
                Err(PlanError::Stopped { best }) => {
                    let best = held.map(Box::new).or(best);
                    return Err(PlanError::Stopped { best });
                }
                Err(error) => return Err(error),
            };
            reached = self.reached(&plan);
        }
        if let Some(held) = held {
            return Ok(held);
        }
        let Worst { row, step, excess } = worst(&reached);
        let inequality = &set.state[row];
        Err(PlanError::Between {
            constraint: inequality.index,
            step,
            violation: inequality.excess(excess),
            best: Some(Box::new(plan)),
        })
    }

    /// The plan from `plan` with margins. If there is none, tries margins nearer to those before. Returns `None` if there is
    /// still none.
    fn tightened<const X: usize, const U: usize>(
        &mut self,
        plan: &Plan,
        set: &InequalitySet,
        before: &[Vec<Margin>],
        margins: &mut [Vec<Margin>],
    ) -> Result<Option<Plan>, PlanError>
    where
        C: Class<X, U>,
    {
        for _ in 0..=HALVINGS {
            if let Some(plan) = self.once(plan, set, margins)? {
                return Ok(Some(plan));
            }
            let all = margins.iter_mut().flatten();
            for (margin, before) in all.zip(before.iter().flatten()) {
                margin.amount = 0.5 * (margin.amount + before.amount);
                margin.last = None;
            }
        }
        Ok(None)
    }

    /// The plan from `plan` with these margins, if there is one.
    fn once<const X: usize, const U: usize>(
        &mut self,
        plan: &Plan,
        set: &InequalitySet,
        margins: &[Vec<Margin>],
    ) -> Result<Option<Plan>, PlanError>
    where
        C: Class<X, U>,
    {
        let tightened = set.tightened(self.by_end(margins));
        let Some((newton, forces)) = self.known(plan)? else {
            return Ok(None);
        };
        self.begin_anew();
        match self.impose(newton, Some(&forces), &tightened) {
            Ok(plan) => Ok(Some(plan)),
            Err(stopped @ PlanError::Stopped { .. }) => Err(stopped),
            Err(_) => Ok(None),
        }
    }

    /// The margins of each inequality at the planned ends of steps: the greater of those of both steps.
    fn by_end<const X: usize, const U: usize>(&self, margins: &[Vec<Margin>]) -> Vec<Vec<f64>>
    where
        C: Class<X, U>,
    {
        let intervals = self.transfer.intervals;
        let rows = self.transfer.inequalities.state.iter().zip(margins);
        let ends = rows.map(|(row, margins)| {
            let planned = self
                .given()
                .planned(row.coordinates(), C::OFFSETS, intervals);
            let at = |step: usize| margins.get(step).map_or(0.0, |margin| margin.amount);
            let end = |interval: usize| match planned.contains(&interval) {
                true => at(interval).max(at(interval + 1)),
                false => 0.0,
            };
            (0..intervals).map(end).collect()
        });
        ends.collect()
    }

    /// What each inequality on states reaches in each step of a plan.
    fn reached<const X: usize, const U: usize>(&self, plan: &Plan) -> Vec<Vec<Reached>>
    where
        C: Class<X, U>,
    {
        let transfer = self.transfer;
        let (h, intervals) = (transfer.h, transfer.intervals);
        let motions = Within::all(transfer, &plan.states);
        let rows = transfer.inequalities.state.iter();
        let row = rows.map(|row| {
            let planned = self
                .given()
                .planned(row.coordinates(), C::OFFSETS, intervals);
            let reached = |(step, motion): (usize, &Within)| {
                let nowhere = Reached {
                    excess: f64::NEG_INFINITY,
                    ends: None,
                };
                let range = row.within(step, intervals);
                if row.price.is_some()
                    || row.only_at_ends
                    || planned.is_empty()
                    || range[0] >= range[1]
                {
                    return nowhere;
                }
                let g = |part: f64| {
                    let state = if part == 1.0 {
                        motion.end(&plan.states[step + 1])
                    } else {
                        motion.at(part)
                    };
                    row.value_at(h * (step as f64 + part), &state) + row.spread_at(step, part)
                };
                let free = |end: usize| end > 0 && planned.contains(&(end - 1));
                let ends = [(step, range[0]), (step + 1, range[1])].map(|(end, part)| {
                    let value = g(part);
                    if free(end) {
                        (Some(value), 0.0)
                    } else {
                        (None, value)
                    }
                });
                let allowed = ends[0].1.max(ends[1].1).max(0.0);
                let ends = [ends[0].0, ends[1].0].into_iter().flatten();
                Reached {
                    excess: highest(range, g) - allowed,
                    ends: ends.reduce(f64::max),
                }
            };
            motions.iter().enumerate().map(reached).collect()
        });
        row.collect()
    }
}

/// The inequality that is exceeded the most, and where.
struct Worst {
    row: usize,
    step: usize,
    excess: f64,
}

fn worst(reached: &[Vec<Reached>]) -> Worst {
    let mut worst = Worst {
        row: 0,
        step: 0,
        excess: 0.0,
    };
    for (row, steps) in reached.iter().enumerate() {
        for (step, Reached { excess, .. }) in steps.iter().enumerate() {
            if *excess > worst.excess {
                worst = Worst {
                    row,
                    step,
                    excess: *excess,
                };
            }
        }
    }
    worst
}
