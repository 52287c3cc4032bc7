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
/// from the path of the best plan before it, whose phases are stretched. What cannot be planned counts as infinitely dear. Strides of
/// more than a step give up where the path leads to no plan; a step away from the result a cold start follows.
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
    let mut cost = schedules.cost(&at, true)?;
    loop {
        let mut moved = false;
        for next in neighbors(maneuver, scene.steps, &at, stride) {
            let other = schedules.cost(&next, stride == 1)?;
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
        (Some(Best { plan, .. }), _) => {
            let tried = known.len();
            let remark = format!(
                "{}; {tried} schedules planned in {solves} solves, no neighbor of this one is cheaper",
                described(maneuver, &at, scene.steps)
            );
            info!("{remark}");
            let phased = Phased {
                switches: at,
                schedules: tried as u32,
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

/// The plan of the least objective so far.
struct Best {
    cost: f64,
    switches: Vec<u64>,
    plan: Plan,
}

impl Best {
    /// A guess for other steps at which phases begin.
    fn at(&self, switches: &[u64]) -> Option<Plan> {
        let [from, to] = [&*self.switches, switches]
            .map(|steps| steps.iter().map(|&step| step as usize).collect::<Vec<_>>());
        self.plan.rescheduled(&from, &to)
    }
}

struct Schedules<'s, 'o> {
    problem: Problem<'s>,
    /// An earlier plan of the whole maneuver, to start from.
    guess: Option<&'s Plan>,
    observe: Observe<'o>,
    /// Iterations of all schedules so far.
    made: Iteration,
    /// By the steps at which phases begin: the objective, and whether it was sought thoroughly.
    known: BTreeMap<Vec<u64>, (f64, bool)>,
    /// Number of transfers solved.
    solves: u32,
    best: Option<Best>,
    /// Why the first that failed did.
    failure: Option<Unsolved>,
}

impl Schedules<'_, '_> {
    /// The objective of the best plan whose phases begin then; infinite where there is none. Unless this is to be `thorough`, the path
    /// of the best plan is the only start, if there is one.
    fn cost(&mut self, switches: &[u64], thorough: bool) -> Result<f64, Unsolved> {
        let thorough = thorough || self.best.is_none();
        if let Some(&(cost, sought)) = self.known.get(switches)
            && (cost.is_finite() || sought || !thorough)
        {
            return Ok(cost);
        }
        let steps = self.problem.scene.steps as usize;
        let transfer = self.problem.transfer(steps, switches)?;
        let best = self.best.as_ref();
        let stretched = best.and_then(|best| best.at(switches));
        let guess = stretched.as_ref().or(self.guess);
        let (made, observe) = (&mut self.made, &mut *self.observe);
        let stated = (&transfer, switches);
        let (found, solves) = self
            .problem
            .solve_from(stated, guess, thorough, made, observe);
        self.solves += solves;
        let cost = match found {
            Ok(Solved { plan, .. }) => {
                let cost = plan.total_cost();
                let least = best.map_or(f64::INFINITY, |best| best.cost);
                if cost < least - CHEAPER * least.abs() || least.is_infinite() {
                    self.best = Some(Best {
                        cost,
                        switches: switches.to_vec(),
                        plan,
                    });
                }
                cost
            }
            Err(unsolved) if !unsolved.is_missing() => {
                let best = self.best.take().map(|best| Box::new(best.plan));
                return Err(Unsolved { best, ..unsolved });
            }
            Err(unsolved) => {
                self.failure.get_or_insert(unsolved);
                f64::INFINITY
            }
        };
        self.known.insert(switches.to_vec(), (cost, thorough));
        Ok(cost)
    }
}

#[cfg(test)]
mod tests;
