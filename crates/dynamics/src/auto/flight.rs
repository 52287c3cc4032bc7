use super::accuracy::Accuracy;
use crate::{BodyState, Load, Method, MethodError, StepError, System};

/// Equal intervals of a pilot flight, at whose ends it is looked at.
pub(super) const SAMPLES: usize = 8;

/// Flies pilots of one system, and counts what they take.
pub(super) struct Flights<'a> {
    system: &'a mut System,
    start: &'a [BodyState],
    controls: Vec<Load>,
    spent: u64,
    allowed: u64,
}

/// A pilot flight, or as much of it as was flown.
pub(super) struct Flight {
    /// States at the ends of the intervals, all bodies of one after another.
    states: Vec<BodyState>,
    /// Steps that the method made, its own where it chooses them.
    pub(super) steps: u64,
}

/// Why a pilot flight was not made.
#[derive(Debug)]
pub(super) enum Failure {
    Step(StepError),
    Method(MethodError),
    /// It would take more evaluations than are left.
    Allowance,
}

/// A method and how it is to be flown.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plan {
    pub(super) method: Method,
    /// Duration of all intervals.
    pub(super) horizon: f64,
    /// Steps in all intervals.
    pub(super) steps: u64,
    /// Evaluations of gravity in each step that the method makes.
    pub(super) stages: u64,
    /// Whether the method chooses its steps, and those given are only where its states are wanted.
    pub(super) adaptive: bool,
}

/// Evaluations of gravity that an adaptive method needs for a state within a step.
const SHOWN: u64 = 4;

impl<'a> Flights<'a> {
    pub(super) fn new(system: &'a mut System, start: &'a [BodyState], allowed: u64) -> Self {
        Self {
            controls: vec![Load::default(); start.len()],
            system,
            start,
            spent: 0,
            allowed,
        }
    }

    /// Sets what all flights, past and to come, may take.
    pub(super) fn allow(&mut self, evaluations: u64) {
        self.allowed = evaluations;
    }

    /// Evaluations of gravity that are left.
    pub(super) fn left(&self) -> u64 {
        self.allowed.saturating_sub(self.spent)
    }

    /// What all flights may take.
    pub(super) fn allowed(&self) -> u64 {
        self.allowed
    }

    /// Evaluations of gravity so far.
    pub(super) fn spent(&self) -> u64 {
        self.spent
    }

    /// Flies a plan from the start, if it takes no more than `most` evaluations of gravity and than are left.
    pub(super) fn fly(&mut self, plan: Plan, most: u64) -> Result<Flight, Failure> {
        let most = most.min(self.left());
        if !plan.adaptive && plan.steps.saturating_mul(plan.stages) > most {
            return Err(Failure::Allowance);
        }
        let end = self.spent + most;
        let h = plan.horizon / plan.steps as f64;
        let mut integrator = plan
            .method
            .integrator(self.system)
            .map_err(Failure::Method)?;
        let mut states = self.start.to_vec();
        let mut flight = Flight {
            states: Vec::with_capacity(SAMPLES * states.len()),
            steps: 0,
        };
        integrator.start(self.system, &states);
        self.spent += 1;
        let mut step = 0;
        for sample in 1..=SAMPLES as u64 {
            let until = sample * (plan.steps / SAMPLES as u64)
                + sample * (plan.steps % SAMPLES as u64) / SAMPLES as u64;
            while step < until {
                step += 1;
                let report = integrator
                    .step(self.system, &mut states, &self.controls, h)
                    .map_err(Failure::Step)?;
                let (made, shown) = if plan.adaptive {
                    (report.cuts.into(), SHOWN)
                } else {
                    (1, 0)
                };
                flight.steps += made;
                self.spent += made * plan.stages + shown;
                if self.spent > end {
                    return Err(Failure::Allowance);
                }
            }
            flight.states.extend_from_slice(&states);
        }
        Ok(flight)
    }
}

impl Flight {
    /// Errors at the ends of the intervals.
    pub(super) fn errors(&self, reference: &Self, accuracy: &Accuracy) -> [f64; SAMPLES] {
        let bodies = self.states.len() / SAMPLES;
        std::array::from_fn(|sample| {
            let at = sample * bodies..(sample + 1) * bodies;
            accuracy.error(&self.states[at.clone()], &reference.states[at])
        })
    }
}
