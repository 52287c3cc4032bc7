use super::body::{Body, State};
use super::flight::{Batch, Outcome};
use super::gravity::Gravity;
use crate::integrator::check_finite;
use crate::lane::Lane;
use crate::{BodyState, StepError};

/// The active lanes, and the results of the flights that have ended.
pub(super) struct Ends {
    /// Mask whose bit k is set if lane k is active.
    flying: u32,
    /// True if a lane has failed in the current step.
    failing: bool,
    /// Errors of the lanes that failed in the current step.
    failures: Vec<Option<StepError>>,
    outcomes: Vec<Option<Outcome>>,
}

impl Ends {
    /// Creates the record with all `lanes` active.
    pub(super) fn new(lanes: usize) -> Self {
        Self {
            flying: (1 << lanes) - 1,
            failing: false,
            failures: vec![None; lanes],
            outcomes: vec![None; lanes],
        }
    }

    /// Mask whose bit k is set if lane k is active and has not failed in the current step.
    #[inline(always)]
    pub(super) fn flying(&self) -> u32 {
        self.flying
    }

    /// Ends the flight of lane k with an error.
    pub(super) fn fail(&mut self, k: usize, error: StepError) {
        self.failures[k] = Some(error);
        self.failing = true;
        self.flying &= !(1 << k);
    }

    /// Returns true if a flight ends in the current step.
    #[inline(always)]
    pub(super) fn failing(&self) -> bool {
        self.failing
    }

    /// Stores the outcomes of the flights that failed in the current step, which began in `begun`. Returns true if no
    /// lane is active any more.
    #[cold]
    #[inline(never)]
    pub(super) fn ground<T: Lane>(&mut self, begun: &[State<T>], step: u64) -> bool {
        for (k, (failure, outcome)) in self.failures.iter_mut().zip(&mut self.outcomes).enumerate()
        {
            if let Some(failure) = failure.take() {
                *outcome = Some(Outcome {
                    states: lane(begun, k),
                    steps: step,
                    failure: Some(failure),
                });
            }
        }
        self.failing = false;
        self.flying == 0
    }

    /// Appends the outcomes of all flights. Flights that have not failed end in `states`.
    #[inline(never)]
    pub(super) fn land<T: Lane>(
        self,
        states: &[State<T>],
        batch: &Batch,
        outcomes: &mut Vec<Outcome>,
    ) {
        let each = self.outcomes.into_iter().enumerate();
        outcomes.extend(each.map(|(k, outcome)| {
            outcome.unwrap_or_else(|| Outcome {
                states: lane(states, k),
                steps: batch.flight.steps,
                failure: None,
            })
        }));
    }
}

fn lane<T: Lane>(states: &[State<T>], k: usize) -> Vec<BodyState> {
    states.iter().map(|state| state.lane(k)).collect()
}

/// Ends the flights of lanes whose states are not finite, or in which a body has entered another body or a source.
#[inline(always)]
pub(super) fn check<T: Lane>(
    ends: &mut Ends,
    batch: &Batch,
    bodies: &[Body<T>],
    gravity: &[Gravity<T>],
    states: &[State<T>],
) {
    let mut good = u32::MAX;
    for state in states {
        let zero = state.zero_if_finite();
        good &= zero.at_most(zero.constant(0.0));
    }
    if batch.layout.extents {
        for gravity in gravity {
            good &= gravity.clear(bodies, states);
        }
    }
    if ends.flying() & !good != 0 {
        end_failed(ends, ends.flying() & !good, batch, states);
    }
}

/// Checks each of `lanes` individually, because a sum may overflow even if its terms are finite.
#[cold]
#[inline(never)]
fn end_failed<T: Lane>(ends: &mut Ends, lanes: u32, batch: &Batch, states: &[State<T>]) {
    for (k, member) in batch.members.iter().enumerate() {
        if lanes & (1 << k) == 0 {
            continue;
        }
        let states = lane(states, k);
        let checked = check_finite(&states)
            .and_then(|()| member.system.check_clearance(&states).map_err(Into::into));
        if let Err(error) = checked {
            ends.fail(k, error);
        }
    }
}
