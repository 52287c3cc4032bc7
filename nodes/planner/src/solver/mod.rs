//! What the worker does: a task in, a plan out, by the method that the scene asks for.

mod duration;
mod formation;
mod iteration;
mod outcome;
mod phases;
mod shooting;
mod shortest;
mod task;
#[cfg(test)]
mod tests;
mod violated;

use std::borrow::Cow;
use std::slice;
use std::sync::Arc;

use lgvi_control::processing::{ProcessingError, flown, processed};
use lgvi_control::{Minimum, NewtonSettings, Plan, SearchSettings, Start, Transfer, Winding};
use lgvi_scene::{Commands, Maneuver, Minimize, Scene, Search, Solver, SolverMethod};
use tracing::info;

#[cfg(feature = "node")]
use crate::prediction::Forecast;

pub use self::iteration::Iteration;
#[cfg(feature = "node")]
pub(crate) use self::iteration::violation;
pub use self::outcome::Reason;
#[cfg(feature = "node")]
pub(crate) use self::outcome::{NOT_MINIMUM, NOT_MINIMUM_IN_FLIGHT};
pub(crate) use self::outcome::{Phased, Solved, Unsolved};
pub(crate) use self::task::{End, Guess, Initial, Predicted, Task};

const NO_MANEUVER: &str = "the scene has no maneuver";
const LATER: &str = "what the wheels store at a later step is known only from the plan that is flown until then, and there is none";
const LIGHTER: &str = "what propellant is left at a later step is known only from the plan that is flown until then, and there is none";
const LATER_PHASES: &str = "the lengths of the phases are found for the whole maneuver only: a later plan keeps those of an earlier one";

/// Sees each iteration, and may end the task.
type Observe<'o> = &'o mut dyn FnMut(&Iteration) -> bool;

/// Solves a task of the scene's maneuver.
pub(crate) fn solve(scene: &Scene, task: &Task, observe: Observe<'_>) -> Result<Solved, Unsolved> {
    let Some(maneuver) = &scene.maneuver else {
        return Err(Unsolved::new(Reason::Refused, NO_MANEUVER));
    };
    if maneuver.separation.is_some() {
        return formation::solve(scene, maneuver, task, observe);
    }
    let (initial, maneuver) = match &task.initial {
        Initial::State(state) => {
            check_known(scene, maneuver, task.first_step)?;
            let body = &scene.bodies[maneuver.body].body;
            (Predicted::of(body, *state), Cow::Borrowed(maneuver))
        }
        Initial::Known(body) => (body.clone(), Cow::Borrowed(maneuver)),
        #[cfg(feature = "node")]
        Initial::Forecast(forecast) => {
            let (mut predicted, seen) = foretold(scene, maneuver, forecast, task.first_step)?;
            let seen = seen.map_or(Cow::Borrowed(maneuver), Cow::Owned);
            (predicted.swap_remove(0), seen)
        }
    };
    let problem = Problem {
        scene,
        maneuver: &maneuver,
        initial: &initial,
        falls_back: true,
    };
    let mut solved = match task.end {
        End::After(_) if task.finds_phases(&maneuver) => {
            if task.first_step > 0 {
                return Err(Unsolved::new(Reason::Refused, LATER_PHASES));
            }
            phases::solve(problem, task.guess.as_ref(), observe)?
        }
        End::After(intervals) => {
            let proportional = || maneuver.proportional_switches(scene.steps);
            let switches = task.switches.clone().unwrap_or_else(proportional);
            let transfer = problem.transfer(intervals, &switches)?;
            let rest = |guess: &Guess| guess.remaining(slice::from_ref(&transfer));
            let guess = task.guess.as_ref().map_or_else(Vec::new, rest);
            let solved = problem.solve(&transfer, &switches, guess.first(), observe)?;
            if !switches.is_empty() {
                info!("{}", phases::described(&maneuver, &switches, scene.steps));
            }
            let phased = Phased {
                switches,
                schedules: 1,
                solves: 1,
            };
            Solved { phased, ..solved }
        }
        End::Free(range) => match range.minimize {
            Minimize::Cost => duration::solve(problem, range, observe)?,
            Minimize::Time => shortest::solve(problem, range, observe)?,
        },
    };
    solved.describe();
    if let Cow::Owned(seen) = maneuver {
        solved.seen = Some(Arc::new(seen));
    }
    Ok(solved)
}

/// What is foretold of the bodies of a maneuver at a step, and the maneuver as it is seen in flight, if other bodies have a part in
/// it.
#[cfg(feature = "node")]
fn foretold(
    scene: &Scene,
    maneuver: &Maneuver,
    forecast: &Forecast,
    step: u64,
) -> Result<(Vec<Predicted>, Option<Maneuver>), Unsolved> {
    let predicted = forecast.of(scene, maneuver, step);
    let predicted = predicted.map_err(|error| Unsolved::new(Reason::Refused, error))?;
    let seen = forecast.seen(scene);
    let seen = seen.map_err(|error| Unsolved::new(Reason::Refused, error))?;
    Ok((predicted, seen))
}

/// Refuses plans from a later state if the actuators are not known there.
pub(crate) fn check_known(
    scene: &Scene,
    maneuver: &Maneuver,
    first_step: u64,
) -> Result<(), Unsolved> {
    let unknown = [
        (maneuver.commands() == Commands::Wheels, LATER),
        (maneuver.uses_propellant(scene), LIGHTER),
    ];
    match unknown
        .iter()
        .find(|(unknown, _)| *unknown && first_step > 0)
    {
        Some((_, why)) => Err(Unsolved::new(Reason::Refused, why)),
        None => Ok(()),
    }
}

/// The maneuver of a scene, from a state.
#[derive(Clone, Copy)]
struct Problem<'p> {
    scene: &'p Scene,
    /// That of the scene, or as it is seen in flight.
    maneuver: &'p Maneuver,
    initial: &'p Predicted,
    /// Whether Newton's method starts anew where a guess leads to no plan.
    falls_back: bool,
}

impl Problem<'_> {
    /// The transfer whose phases after the first begin at the steps `switches` of the run.
    fn transfer(&self, intervals: usize, switches: &[u64]) -> Result<Transfer, Unsolved> {
        let Self {
            scene,
            maneuver,
            initial,
            ..
        } = self;
        let transfer = scene.transfer_of(maneuver, initial.state, intervals, switches);
        let with_propellant = |transfer: Transfer| match initial.propellant {
            Some(left) if maneuver.uses_propellant(scene) => transfer.with_propellant(left),
            _ => Ok(transfer),
        };
        transfer
            .and_then(with_propellant)
            .and_then(|transfer| transfer.with_wheel_momenta(&initial.wheel_momenta))
            .map_err(|error| Unsolved::new(Reason::Refused, error))
    }

    /// Solves one transfer with these switches.
    fn solve(
        &self,
        transfer: &Transfer,
        switches: &[u64],
        guess: Option<&Plan>,
        observe: Observe<'_>,
    ) -> Result<Solved, Unsolved> {
        let &Self {
            scene, maneuver, ..
        } = self;
        self.attempt(transfer, guess, observe)
            .map_err(|unsolved| match &unsolved.violated {
                None => unsolved,
                Some(violated) => Unsolved {
                    message: violated.told(scene, maneuver, transfer.intervals(), switches),
                    ..unsolved
                },
            })
    }

    /// Solves from a guess, and from nothing if that leads to no plan and the search is to be `thorough`. The iterations are added
    /// to those `made`. Returns the number of starts, too.
    fn solve_from(
        &self,
        (transfer, switches): (&Transfer, &[u64]),
        guess: Option<&Plan>,
        thorough: bool,
        made: &mut Iteration,
        observe: Observe<'_>,
    ) -> (Result<Solved, Unsolved>, u32) {
        let near = Problem {
            falls_back: false,
            ..*self
        };
        if guess.is_some() {
            let found = near.solve(transfer, switches, guess, &mut made.continued(observe));
            if !thorough || !found.as_ref().is_err_and(Unsolved::is_missing) {
                return (found, 1);
            }
        }
        let found = self.solve(transfer, switches, None, &mut made.continued(observe));
        (found, 1 + u32::from(guess.is_some()))
    }

    fn attempt(
        &self,
        transfer: &Transfer,
        guess: Option<&Plan>,
        observe: Observe<'_>,
    ) -> Result<Solved, Unsolved> {
        let &Self {
            scene, maneuver, ..
        } = self;
        if !maneuver.processed {
            return self.by_method(transfer, guess, observe);
        }
        let refused = |error: ProcessingError| Unsolved::new(Reason::Refused, error);
        let early = processed(transfer.clone()).map_err(refused)?;
        let Solved { plan, remark, .. } = self.by_method(&early, None, observe)?;
        let plan = flown(&scene.bodies[maneuver.body].body, plan).map_err(refused)?;
        Ok(Solved::new(plan, remark))
    }

    fn by_method(
        &self,
        transfer: &Transfer,
        guess: Option<&Plan>,
        observe: Observe<'_>,
    ) -> Result<Solved, Unsolved> {
        let Maneuver { solver, search, .. } = self.maneuver;
        let settings = NewtonSettings {
            falls_back: self.falls_back,
            ..newton_settings(solver)
        };
        let plan = match (solver.method, *search, guess) {
            (SolverMethod::Shooting, ..) => shooting::solve(transfer, solver, observe)?,
            (SolverMethod::Newton, Some(search), None) => {
                return best(transfer, search, settings, observe);
            }
            (SolverMethod::Newton, ..) => newton(transfer, guess, &settings, observe)?,
        };
        Ok(Solved::new(plan, String::new()))
    }
}

/// The cheapest local minimum of a search; the ranking goes to the log.
fn best(
    transfer: &Transfer,
    Search { starts, seed }: Search,
    newton: NewtonSettings,
    observe: Observe<'_>,
) -> Result<Solved, Unsolved> {
    let settings = SearchSettings {
        starts,
        seed,
        newton,
    };
    let minima = lgvi_control::search(transfer, &settings, |now| observe(&now.into()))?;
    let ranked: Vec<_> = (1..)
        .zip(&minima)
        .map(|(rank, minimum)| described(rank, minima.len(), minimum))
        .collect();
    for minimum in &ranked {
        info!("{minimum}");
    }
    match (minima.into_iter().next(), ranked.into_iter().next()) {
        (Some(Minimum { plan, .. }), Some(remark)) => Ok(Solved::new(plan, remark)),
        _ => {
            let message = "no start leads to a minimum";
            Err(Unsolved::new(Reason::NotConverged, message))
        }
    }
}

/// A local minimum in words.
fn described(rank: usize, of: usize, minimum: &Minimum) -> String {
    let (cost, starts) = (minimum.plan.cost, minimum.starts);
    let Winding { rotation, angle } = minimum.winding;
    let rotation: [f64; 3] = rotation.into();
    format!(
        "minimum {rank} of {of}: cost {cost}, turns by {angle:.2} rad in all, {rotation:.2?} about the body's axes, \
         from {starts} starts"
    )
}

fn newton_settings(solver: &Solver) -> NewtonSettings {
    let defaults = NewtonSettings::default();
    NewtonSettings {
        violation: solver.tolerance.unwrap_or(defaults.violation),
        iterations: solver.max_iterations.unwrap_or(defaults.iterations),
        ..defaults
    }
}

fn newton(
    transfer: &Transfer,
    guess: Option<&Plan>,
    settings: &NewtonSettings,
    observe: Observe<'_>,
) -> Result<Plan, Unsolved> {
    let start = guess.map_or(Start::Cold, Start::Warm);
    lgvi_control::solve(transfer, start, settings, |now| observe(&now.into())).map_err(Into::into)
}
