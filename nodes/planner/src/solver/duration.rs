use std::collections::BTreeMap;

use lgvi_control::Plan;
use lgvi_dynamics::BodyState;
use lgvi_scene::{FinalTime, Scene};
use tracing::info;

use super::{Iteration, Observe, Reason, Unsolved, once, transfer};

/// The plan of the best duration: a whole number of the run's steps, so that it is flown as it is planned, at which
/// `J + weight · T` is less than with a step more or a step less, or which is a bound of the range.
///
/// A pattern search over the number of steps, from the middle of the range: steps of an eighth of it, halved where
/// neither side is better, each plan from the best before it. Durations that cannot be planned count as infinitely dear.
pub(super) fn solve(
    scene: &Scene,
    initial: &BodyState,
    range: FinalTime,
    observe: Observe<'_>,
) -> Result<Plan, Unsolved> {
    let mut durations = Durations {
        scene,
        initial,
        range,
        observe,
        made: Iteration {
            iteration: 0,
            trials: 0,
            step_length: 1.0,
            violation: f64::INFINITY,
            stationarity: 0.0,
            cost: f64::INFINITY,
            phase: "duration",
        },
        known: BTreeMap::new(),
        best: None,
        failure: None,
    };
    let FinalTime {
        min_steps,
        max_steps,
        ..
    } = range;
    let mut stride = ((max_steps - min_steps) / 8).max(1);
    let mut at = min_steps + (max_steps - min_steps) / 2;
    let mut cost = durations.cost(at)?;
    loop {
        let sides = [
            at.saturating_add(stride).min(max_steps),
            at.saturating_sub(stride).max(min_steps),
        ];
        let mut moved = false;
        for side in sides {
            let other = durations.cost(side)?;
            if other < cost {
                (at, cost, moved) = (side, other, true);
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
    let bound = if at == min_steps || at == max_steps {
        ", a bound of the range"
    } else {
        ""
    };
    match (durations.best, durations.failure) {
        (Some((_, plan)), _) => {
            info!(
                "the best duration is {at} steps{bound}: {} durations planned",
                durations.known.len()
            );
            Ok(plan)
        }
        (None, Some(unsolved)) => Err(unsolved),
        (None, None) => Err(Unsolved::new(Reason::NotConverged, "no duration was tried")),
    }
}

struct Durations<'s, 'o> {
    scene: &'s Scene,
    initial: &'s BodyState,
    range: FinalTime,
    observe: Observe<'o>,
    /// Iterations of all durations so far.
    made: Iteration,
    /// `J + weight · T` by number of steps.
    known: BTreeMap<u64, f64>,
    /// The least of them, and its plan.
    best: Option<(f64, Plan)>,
    /// Why the last that failed did.
    failure: Option<Unsolved>,
}

impl Durations<'_, '_> {
    /// `J + weight · T` of the best plan in so many steps; infinite where there is none.
    fn cost(&mut self, steps: u64) -> Result<f64, Unsolved> {
        if let Some(cost) = self.known.get(&steps) {
            return Ok(*cost);
        }
        let transfer = transfer(self.scene, self.initial, steps as usize)?;
        let (before, made) = (self.made, &mut self.made);
        let observe = &mut *self.observe;
        let mut count = |now: &Iteration| {
            *made = Iteration {
                iteration: before.iteration + now.iteration,
                trials: before.trials + now.trials,
                ..*now
            };
            observe(made)
        };
        let guess = self.best.as_ref().map(|(_, plan)| plan);
        let warm = once(self.scene, &transfer, guess, &mut count);
        let planned = match warm {
            Err(Unsolved {
                reason: Reason::Infeasible | Reason::NotConverged,
                ..
            }) if guess.is_some() => once(self.scene, &transfer, None, &mut count),
            planned => planned,
        };
        let cost = match planned {
            Ok(plan) => {
                let time = steps as f64 * self.scene.h();
                let cost = plan.cost + self.range.weight * time;
                if self.best.as_ref().is_none_or(|(least, _)| cost < *least) {
                    self.best = Some((cost, plan));
                }
                cost
            }
            Err(unsolved) if matches!(unsolved.reason, Reason::Cancelled | Reason::Refused) => {
                let best = self.best.take().map(|(_, plan)| Box::new(plan));
                return Err(Unsolved { best, ..unsolved });
            }
            Err(unsolved) => {
                self.failure = Some(unsolved);
                f64::INFINITY
            }
        };
        self.known.insert(steps, cost);
        Ok(cost)
    }
}
