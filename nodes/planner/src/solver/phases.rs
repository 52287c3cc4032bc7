use std::collections::BTreeMap;

use lgvi_control::Plan;
use lgvi_scene::{Maneuver, Phase};
use tracing::info;

use super::{Guess, Iteration, Observe, Phased, Problem, Reason, Solved, Unsolved};

/// Relative difference from which a plan counts as cheaper than another.
const CHEAPER: f64 = 1e-9;

/// The plan of a maneuver whose phases after the first begin when it is best: none that begins them a step earlier or later, one of
/// them or several neighbors together, is cheaper.
///
/// A pattern search over the steps at which they begin: strides of a quarter of the widest range, halved where no side is better, each
/// plan from the best before it. What cannot be planned counts as infinitely dear.
pub(super) fn solve(
    problem: Problem<'_>,
    guess: Option<&Guess>,
    observe: Observe<'_>,
) -> Result<Solved, Unsolved> {
    let Problem {
        scene, maneuver, ..
    } = problem;
    let mut schedules = Schedules {
        problem,
        guess: guess.map(|guess| &*guess.plan),
        observe,
        made: Iteration::NONE,
        known: BTreeMap::new(),
        solves: 0,
        best: None,
        failure: None,
    };
    let room = |phase: &Phase| phase.max_steps - phase.min_steps;
    let widest = maneuver.phases.iter().map(room).max().unwrap_or(0);
    let mut stride = (widest / 4).max(1);
    let mut at = maneuver.proportional_switches(scene.steps);
    let mut cost = schedules.cost(&at)?;
    loop {
        let mut moved = false;
        for next in neighbors(maneuver, scene.steps, &at, stride) {
            let other = schedules.cost(&next)?;
            if other < cost - CHEAPER * cost.abs() || cost.is_infinite() && other.is_finite() {
                (at, cost, moved) = (next, other, true);
                break;
            }
        }
        if !moved {
            if stride == 1 {
                break;
            }
            stride = stride.div_ceil(2);
        }
    }
    let Schedules {
        known,
        solves,
        best,
        failure,
        ..
    } = schedules;
    match (best, failure) {
        (Some((_, plan)), _) => {
            let remark = format!(
                "{}; {} schedules planned in {solves} solves, no neighbor of this one is cheaper",
                described(maneuver, &at, scene.steps),
                known.len()
            );
            info!("{remark}");
            let phased = Phased {
                switches: at,
                schedules: known.len() as u32,
                solves,
            };
            Ok(Solved {
                phased,
                ..Solved::new(plan, remark)
            })
        }
        (None, Some(unsolved)) => Err(unsolved),
        (None, None) => Err(Unsolved::new(Reason::NotConverged, "no schedule was tried")),
    }
}

/// When the phases begin, in words.
pub(super) fn described(maneuver: &Maneuver, switches: &[u64], steps: u64) -> String {
    let each = maneuver.schedule(switches, steps);
    let each = each.map(|(phase, [begin, end])| {
        let name = &phase.name;
        format!("`{name}` lasts from step {begin} to {end}")
    });
    each.collect::<Vec<_>>().join(", ")
}

/// The schedules in which a phase, or several that follow each other, begin `stride` steps later or earlier, or as many as the ranges allow.
fn neighbors(maneuver: &Maneuver, steps: u64, at: &[u64], stride: u64) -> Vec<Vec<u64>> {
    let lengths: Vec<_> = maneuver
        .schedule(at, steps)
        .map(|(_, [begin, end])| end - begin)
        .collect();
    let phases = &maneuver.phases;
    let longer = |phase: usize| phases[phase].max_steps.saturating_sub(lengths[phase]);
    let shorter = |phase: usize| lengths[phase].saturating_sub(phases[phase].min_steps);
    let mut all = Vec::new();
    for first in 0..at.len() {
        for last in first..at.len() {
            // Between the phases before the first of them and the last of them.
            let later = longer(first).min(shorter(last + 1)).min(stride);
            let earlier = shorter(first).min(longer(last + 1)).min(stride);
            let moved = |by: &dyn Fn(u64) -> u64| {
                let mut moved = at.to_vec();
                moved[first..=last].iter_mut().for_each(|at| *at = by(*at));
                moved
            };
            if later > 0 {
                all.push(moved(&|at| at + later));
            }
            if earlier > 0 {
                all.push(moved(&|at| at - earlier));
            }
        }
    }
    all
}

struct Schedules<'s, 'o> {
    problem: Problem<'s>,
    /// An earlier plan of the whole maneuver, to start from.
    guess: Option<&'s Plan>,
    observe: Observe<'o>,
    /// Iterations of all schedules so far.
    made: Iteration,
    /// The objective by the steps at which phases begin.
    known: BTreeMap<Vec<u64>, f64>,
    /// Number of transfers solved.
    solves: u32,
    /// The least objective, and its plan.
    best: Option<(f64, Plan)>,
    /// Why the first that failed did.
    failure: Option<Unsolved>,
}

impl Schedules<'_, '_> {
    /// The objective of the best plan whose phases begin then; infinite where there is none.
    fn cost(&mut self, switches: &[u64]) -> Result<f64, Unsolved> {
        if let Some(cost) = self.known.get(switches) {
            return Ok(*cost);
        }
        let steps = self.problem.scene.steps as usize;
        let transfer = self.problem.transfer(steps, switches)?;
        let (mut before, made) = (self.made, &mut self.made);
        let observe = &mut *self.observe;
        let best = self.best.as_ref().map(|(_, plan)| plan);
        let guess = best.or(self.guess);
        let mut planned = None;
        for start in [guess, None] {
            let mut count = |now: &Iteration| {
                *made = Iteration {
                    iteration: before.iteration + now.iteration,
                    trials: before.trials + now.trials,
                    ..*now
                };
                observe(made)
            };
            self.solves += 1;
            let found = self.problem.solve(&transfer, switches, start, &mut count);
            before = *made;
            let again = match &found {
                Ok(_) => false,
                Err(unsolved) => {
                    let open = [Reason::Infeasible, Reason::NotConverged];
                    start.is_some() && open.contains(&unsolved.reason)
                }
            };
            planned = Some(found);
            if !again {
                break;
            }
        }
        let cost = match planned {
            Some(Ok(Solved { plan, .. })) => {
                let cost = plan.total_cost();
                let least = self
                    .best
                    .as_ref()
                    .map_or(f64::INFINITY, |(least, _)| *least);
                if cost < least - CHEAPER * least.abs() || least.is_infinite() {
                    self.best = Some((cost, plan));
                }
                cost
            }
            Some(Err(unsolved))
                if matches!(unsolved.reason, Reason::Cancelled | Reason::Refused) =>
            {
                let best = self.best.take().map(|(_, plan)| Box::new(plan));
                return Err(Unsolved { best, ..unsolved });
            }
            Some(Err(unsolved)) => {
                self.failure.get_or_insert(unsolved);
                f64::INFINITY
            }
            None => f64::INFINITY,
        };
        self.known.insert(switches.to_vec(), cost);
        Ok(cost)
    }
}

#[cfg(test)]
mod tests;
