//! Repeats a recorded flight.

mod compare;
mod difference;
mod repetition;
mod verdict;

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

pub use self::difference::{Difference, Value};
use self::repetition::Repetition;
pub use self::verdict::{Outcome, Verdict};
use crate::Unusable;
use crate::flight_bag::FlightBag;

/// Repeats the flight up to the first difference, and compares every recorded state with the repetition. Where stamps tell
/// the time, states of several courses alternate: each course is under way from its first state to its last. `go_on` is told
/// the number of states compared so far, and whether to go on is asked of it.
///
/// # Errors
/// Returns an error if the bag cannot be repeated, and if `go_on` has said no.
pub fn verify(bag: &FlightBag, go_on: &mut dyn FnMut(u64) -> bool) -> Result<Verdict, Unusable> {
    let mut verdict = Verdict::new(bag);
    let courses = bag.courses()?;
    let mut under_way = BTreeMap::new();
    let mut latest = 0;
    for state in bag.states() {
        let state = state?;
        if !go_on(verdict.states) {
            return Err(bag.refuse(&"the repetition was interrupted"));
        }
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
    if verdict.states == 0 {
        let topic = bag.state_topic();
        return Err(bag.refuse(&format!("{topic}: no states, expected at least one")));
    }
    Ok(verdict)
}
