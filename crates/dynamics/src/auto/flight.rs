use super::accuracy::Accuracy;
use crate::{BodyState, Load, Method, MethodError, StepError, System};

/// Equal intervals of a pilot flight, at whose ends it is looked at.
pub(super) const SAMPLES: usize = 16;

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
    /// Steps in each interval.
    pub(super) steps: u64,
    /// Evaluations of gravity in each step that the method makes.
    pub(super) evaluations: u64,
}

impl Plan {
    /// Evaluations of gravity that it takes.
    pub(super) fn evaluations(&self) -> u64 {
        let steps = self.steps.saturating_mul(SAMPLES as u64);
        steps.saturating_mul(self.evaluations)
    }
}

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

    /// Flies a plan from the start.
    pub(super) fn fly(&mut self, plan: Plan) -> Result<Flight, Failure> {
        if plan.evaluations() > self.left() {
            return Err(Failure::Allowance);
        }
        let interval = plan.horizon / SAMPLES as f64;
        let h = interval / plan.steps as f64;
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
        for _ in 0..SAMPLES {
            for _ in 0..plan.steps {
                let report = integrator
                    .step(self.system, &mut states, &self.controls, h)
                    .map_err(Failure::Step)?;
                let made = u64::from(report.cuts.max(1));
                flight.steps += made;
                self.spent += made * plan.evaluations;
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
