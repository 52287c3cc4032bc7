//! The choice of an integrator and its step for a system and an accuracy.
//!
//! A run wants states at `steps` equal times; each step between them may be cut into substeps of a method. [`choose`]
//! finds method and substeps that reach an accuracy at the end of the run at the least predicted cost:
//!
//! 1. Structure: the methods that can integrate the system (`family`), what a step of each costs (`cost`).
//! 2. A short pilot flight, a few turns of what moves fastest, against a much finer reference, tells the error
//!    constants of the methods. They race (`race`): the one that looks cheapest is measured next, until the cheapest
//!    is one that is measured.
//! 3. A longer pilot, the whole run where that is cheap, tells how errors grow (`growth`) and repeats the race among those
//!    that are left.
//!
//! Nothing depends on a clock: the same input gives the same choice on every machine.

mod accuracy;
mod choice;
mod contender;
mod cost;
mod error;
mod family;
mod flight;
mod growth;
mod pilot;
mod race;

pub use accuracy::Accuracy;
pub use choice::{Candidate, Choice, Outlook};
pub use error::ChoiceError;

use accuracy::rate;

use crate::{BodyState, System};
use cost::Cost;
use family::Family;
use flight::Flights;
use pilot::Pilot;
use race::Race;

/// What is wanted of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Duration, > 0.
    pub duration: f64,
    /// Steps, each of which ends in a state that is wanted, ≥ 1.
    pub steps: u64,
}

/// Evaluations of gravity that pilot flights may always take.
pub const ALLOWANCE: u64 = 200_000;

/// Part of the evaluations of gravity, in the flight that the first pilot lets expect, that pilot flights may take where that
/// is more.
pub const PART: f64 = 0.05;

/// Radians of the fastest motion that the first pilot flies.
const SHORT: f64 = 64.0;

/// Where that is too much, it is made shorter by this factor as long as it is longer than these radians.
const SHORTER: f64 = 0.5;
const LEAST: f64 = 1.0;

/// The second pilot is this much longer at least.
const LONGER: f64 = 1.5;

/// Flights' worth of evaluations that the second pilot is expected to take, of the reference and of the chosen method.
const REPEATS: [f64; 2] = [3.0, 4.0];

/// All that stays the same throughout a choice.
struct Task {
    run: Run,
    tolerance: f64,
    accuracy: Accuracy,
    /// Of the fastest motion (rad per unit of time).
    rate: f64,
    families: Vec<Family>,
}

/// Chooses method and substeps for `system`, from `states` (one a body), such that the error at the end of `run` is at most
/// `tolerance` as [`Accuracy`] measures it. Controls are none.
///
/// # Assumptions and limitations
/// What comes after the pilot flights is extrapolated: an error that has grown as a power of time, or exponentially, is
/// taken to go on so. A close encounter later in the run is not foreseen. The tolerance may be out of reach;
/// [`Choice::outlook`] tells.
pub fn choose(
    system: &mut System,
    states: &[BodyState],
    run: Run,
    tolerance: f64,
) -> Result<Choice, ChoiceError> {
    error::check(system, states, run, tolerance)?;
    let mut states = states.to_vec();
    system.constrain(&mut states);
    let cost = Cost::new(system);
    if system.is_free() && cost.is_closed_form_cheap(run.steps as f64) {
        let exact = cost.flight(&Family::closed_form(), run.steps as f64, run.steps as f64);
        return Ok(Choice::closed_form(exact));
    }
    let task = Task {
        run,
        tolerance,
        accuracy: Accuracy::new(system.bodies(), &states),
        rate: rate(system, &states).max(1.0 / run.duration),
        families: Family::all(system),
    };
    let mut flights = Flights::new(system, &states, ALLOWANCE / 2);
    let mut race = Race::new(&task, cost);
    let mut pilot = short(&mut flights, &task)?;
    race.run(&mut flights, &task, &pilot);
    let mut candidates = race.candidates(&pilot);
    if let Some(long) = long(&mut flights, &task, &pilot, &race) {
        race.expect(pilot.target);
        race.run(&mut flights, &task, &long);
        let again = race.candidates(&long);
        if !again.is_empty() {
            (pilot, candidates) = (long, again);
        }
    }
    let horizon = pilot.horizon(&task);
    let chosen = candidates.first().ok_or(ChoiceError::Costly {
        horizon,
        evaluations: flights.allowed(),
    })?;
    Ok(Choice {
        method: chosen.method,
        substeps: chosen.substeps,
        outlook: pilot.outlook,
        horizon,
        evaluations: flights.spent(),
        candidates,
    })
}

/// The first pilot, a few turns of what moves fastest.
fn short(flights: &mut Flights<'_>, task: &Task) -> Result<Pilot, ChoiceError> {
    let mut horizon = task.run.duration.min(SHORT / task.rate);
    loop {
        match Pilot::new(flights, task, horizon, Family::reference(task.tolerance)) {
            Err(ChoiceError::Costly { .. }) if horizon * task.rate > LEAST => horizon *= SHORTER,
            pilot => return pilot,
        }
    }
}

/// A second pilot, as much longer than the first as flights may be.
fn long(flights: &mut Flights<'_>, task: &Task, first: &Pilot, race: &Race) -> Option<Pilot> {
    let (duration, horizon) = (task.run.duration, first.horizon(task));
    let flight = race.evaluations(first)?;
    flights.allow(((PART * flight) as u64).max(ALLOWANCE));
    let (family, resolution, reference) = race.reference(first)?;
    let needed = REPEATS[0] * reference + REPEATS[1] * flight;
    let mut longer = duration * (flights.left() as f64 / needed).min(1.0);
    while longer > horizon && (longer > LONGER * horizon || longer == duration) {
        if let Ok(pilot) = Pilot::new(flights, task, longer, (family, resolution)) {
            return Some(pilot);
        }
        longer *= SHORTER;
    }
    None
}
