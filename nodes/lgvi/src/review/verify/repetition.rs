//! One course of a flight while it is repeated.

use std::iter::Peekable;
use std::slice::Iter;

use lgvi_msgs::msg::{Intervention, SystemState};
use lgvi_propagator::{Controls, Flight, SetStates};
use lgvi_scene::Scene;

use super::compare::compare;
use super::difference::Difference;
use crate::Unusable;
use crate::course::Course;
use crate::flight_bag::FlightBag;

pub(super) struct Repetition<'c> {
    bag: &'c FlightBag,
    flight: Flight,
    /// The number of the state that comes next, and of the one behind the last.
    next: u64,
    end: u64,
    /// States that are not in the bag, before those that are.
    pub(super) missing: u64,
    /// Sequences that have yet to be accepted, the next one last, each with the step by which it must be.
    controls: Vec<(u64, Controls)>,
    /// What is set on the way.
    set: Peekable<Iter<'c, (u64, &'c Intervention)>>,
}

impl<'c> Repetition<'c> {
    /// Begins at the scene's start. The controls of the course are accepted in their order, each by the first step at which
    /// it or one behind it acts: all at the start would be so many to look through in each step.
    pub(super) fn begin(bag: &'c FlightBag, course: &'c Course<'c>) -> Result<Self, Unusable> {
        let flight = Flight::new(&bag.scene).map_err(Unusable::new)?;
        let controls = bag.check(course.controls).collect::<Result<Vec<_>, _>>()?;
        let mut by = u64::MAX;
        let controls = controls.into_iter().rev().map(|controls| {
            by = by.min(controls.first_step);
            (by, controls)
        });
        Ok(Self {
            bag,
            flight,
            controls: controls.collect(),
            next: course.samples.start,
            end: course.samples.end,
            missing: 0,
            set: course.set.iter().peekable(),
        })
    }

    /// Goes on to the next state, and compares.
    pub(super) fn compare(&mut self, state: &SystemState) -> Result<Option<Difference>, Unusable> {
        let Self {
            bag,
            flight,
            controls,
            ..
        } = self;
        let number = state.sequence;
        let missing = number.checked_sub(self.next).ok_or_else(|| {
            let (topic, next) = (bag.state_topic(), self.next);
            bag.refuse(&format!("{topic}: state {number} comes where {next} or a later one is expected: it is out of order, or a reset is missing"))
        })?;
        self.missing += missing;
        self.next = number.saturating_add(1);
        if let Some((_, intervention)) = self.set.next_if(|(sample, _)| *sample == number) {
            set_states(&bag.scene, flight, intervention).map_err(|error| bag.refuse(&error))?;
        }
        let prepare = |flight: &mut Flight| {
            let step = flight.step();
            while let Some((_, next)) = controls.pop_if(|(by, _)| *by <= step) {
                flight.accept(next).map_err(|error| error.to_string())?;
            }
            Ok(())
        };
        compare(&bag.scene, flight, state, prepare).map_err(|error| bag.refuse(&error))
    }

    /// Whether no state of the course is left.
    pub(super) fn is_over(&self) -> bool {
        self.next == self.end
    }
}

/// Sets states as they were set in the flight.
fn set_states(
    scene: &Scene,
    flight: &mut Flight,
    intervention: &Intervention,
) -> Result<(), String> {
    let Intervention { step, bodies, .. } = intervention;
    let states = SetStates::of_message(scene, bodies)
        .map_err(|error| format!("states set at step {step}: {error}"))?;
    flight
        .set_states(&states)
        .map_err(|error| format!("states set at step {step}: {error}"))
}
