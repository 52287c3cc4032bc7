//! One course of a flight while it is repeated.

use std::iter::Peekable;
use std::slice::Iter;

use lgvi_middleware::node::NodeError;
use lgvi_msgs::msg::{Intervention, SystemState};
use lgvi_propagator::{Flight, SetStates};
use lgvi_scene::Scene;

use super::compare::compare;
use super::difference::Difference;
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
    /// What is set on the way.
    set: Peekable<Iter<'c, (u64, &'c Intervention)>>,
}

impl<'c> Repetition<'c> {
    /// Begins at the scene's start, with all controls of the course.
    pub(super) fn begin(bag: &'c FlightBag, course: &'c Course<'c>) -> Result<Self, NodeError> {
        let mut flight = Flight::new(&bag.scene).map_err(NodeError::input)?;
        for controls in bag.check(course.controls) {
            flight
                .accept(controls?)
                .map_err(|error| bag.refuse(&error))?;
        }
        Ok(Self {
            bag,
            flight,
            next: course.samples.start,
            end: course.samples.end,
            missing: 0,
            set: course.set.iter().peekable(),
        })
    }

    /// Goes on to the next state, and compares.
    pub(super) fn compare(&mut self, state: &SystemState) -> Result<Option<Difference>, NodeError> {
        let Self { bag, flight, .. } = self;
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
        compare(&bag.scene, flight, state).map_err(|error| bag.refuse(&error))
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
