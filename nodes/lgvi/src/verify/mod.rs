//! Repeats a recorded flight.

mod compare;
mod difference;
mod repetition;
mod verdict;

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::Path;
use std::process::ExitCode;

use lgvi_middleware::node::NodeError;

use self::repetition::Repetition;
use self::verdict::{Outcome, Verdict};
use crate::bars;
use crate::flight_bag::FlightBag;
use crate::output::say;

/// Compares every recorded state with the repetition; exit code 0 if all agree, 1 if one differs or states are missing.
pub(crate) fn verify(path: &Path, flight: Option<&str>, json: bool) -> Result<ExitCode, NodeError> {
    let bag = FlightBag::open(path, flight)?;
    let verdict = repeat(&bag, path)?;
    if json {
        say(&serde_json::to_string(&verdict).map_err(NodeError::runtime)?)?;
    } else {
        say(&verdict)?;
    }
    Ok(ExitCode::from(u8::from(verdict.outcome != Outcome::Agrees)))
}

/// Repeats the flight up to the first difference. Where stamps tell the time, states of several courses alternate: each
/// course is under way from its first state to its last.
fn repeat(bag: &FlightBag, path: &Path) -> Result<Verdict, NodeError> {
    let mut verdict = Verdict::new(bag, path);
    let courses = bag.courses()?;
    let mut under_way = BTreeMap::new();
    let mut latest = 0;
    let bar = bars::bar("repeating", bag.state_count(), "states");
    for state in bag.states() {
        let state = state?;
        bar.inc(1);
        let number = courses.partition_point(|course| course.samples.end <= state.sequence);
        let course = courses.get(number).ok_or_else(|| {
            let (topic, sequence) = (bag.state_topic(), state.sequence);
            bag.refuse(&format!("{topic}: sequence {sequence} is of no course"))
        })?;
        let repetition = match under_way.entry(number) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => {
                verdict.sequences += course.controls.len();
                entry.insert(Repetition::begin(bag, course)?)
            }
        };
        let before = repetition.missing;
        let difference = repetition.compare(&state)?;
        verdict.missing += repetition.missing - before;
        if repetition.is_over() {
            under_way.remove(&number);
        }
        verdict.states += 1;
        if state.sequence >= latest {
            latest = state.sequence;
            verdict.step = state.step;
            verdict.complete = state.step == verdict.steps;
        }
        if let Some(difference) = difference {
            verdict.differ(difference);
            break;
        }
    }
    bar.finish_and_clear();
    if verdict.states == 0 {
        let topic = bag.state_topic();
        return Err(bag.refuse(&format!("{topic}: no states, expected at least one")));
    }
    Ok(verdict)
}
