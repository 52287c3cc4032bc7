use std::ops::ControlFlow;

use super::cost::{Cost, STAGES, splitting};
use super::{ChoiceError, Run};
use crate::integrator::Adaptive;
use crate::{Accuracy, BodyState, Load, Method, StepError, System};

/// What a rehearsal may cost, about nanoseconds.
pub(super) const BUDGET: f64 = 6e9;

/// Instants at which flights are compared, the factor between them, and how many parts of a run may have one at their end.
const INSTANTS: i32 = 64;
const PARTS: u64 = 64;

/// Flights, as dear as a coarse reference, that a choice takes: a guess, for its progress.
const EXPECTED: f64 = 25.0;

/// What is spent between two reports of progress, about nanoseconds.
const REPORT: f64 = 1e7;

/// Flies a run again and again, and counts what that takes.
pub(super) struct Flights<'a> {
    system: &'a mut System,
    start: &'a [BodyState],
    controls: Vec<Load>,
    run: Run,
    pub(super) cost: Cost,
    pub(super) accuracy: Accuracy,
    /// Parts into which each step of the run is cut, so that instants lie within a run of few steps.
    pub(super) parts: u32,
    /// Instants, in parts since the start; the last is the end.
    instants: Vec<u64>,
    meter: Meter<'a>,
}

/// Counts what is spent and reports it.
struct Meter<'a> {
    progress: &'a mut dyn FnMut(f64) -> ControlFlow<()>,
    evaluations: f64,
    spent: f64,
    reported: f64,
    /// What is expected to be spent.
    expected: f64,
    stopped: bool,
}

/// How far a flight went.
pub(super) struct Course {
    /// States at the instants that it reached.
    pub(super) states: Vec<Vec<BodyState>>,
    /// What it cost.
    pub(super) cost: f64,
    /// Internal steps that it made.
    pub(super) steps: f64,
    /// Why it went no farther.
    pub(super) end: End,
}

/// Why a flight ended.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum End {
    /// The run is over.
    Whole,
    /// Its observer had seen enough.
    Enough,
    /// It would have cost more than it may.
    Costly,
    /// A step cannot be made.
    Failed(StepError),
}

impl Meter<'_> {
    /// Spends so much; whether to go on.
    fn spend(&mut self, cost: f64, evaluations: f64) -> bool {
        self.spent += cost;
        self.evaluations += evaluations;
        if self.spent >= self.reported + REPORT {
            self.reported = self.spent;
            let part = (self.spent / self.expected).min(0.99);
            self.stopped |= (self.progress)(part).is_break();
        }
        !self.stopped
    }
}

impl<'a> Flights<'a> {
    pub(super) fn new(
        system: &'a mut System,
        start: &'a [BodyState],
        run: Run,
        cost: Cost,
        progress: &'a mut dyn FnMut(f64) -> ControlFlow<()>,
    ) -> Self {
        let parts = PARTS.div_ceil(run.steps);
        let all = run.steps * parts;
        let instant = |i: i32| {
            let part = all as f64 * libm::exp2(0.25 * f64::from(i - INSTANTS));
            (libm::ceil(part) as u64).clamp(1, all)
        };
        let mut instants: Vec<_> = (1..=INSTANTS).map(instant).collect();
        instants.dedup();
        Self {
            accuracy: Accuracy::new(system.bodies(), start),
            controls: vec![Load::default(); start.len()],
            parts: parts as u32,
            instants,
            meter: Meter {
                progress,
                evaluations: 0.0,
                spent: 0.0,
                reported: 0.0,
                expected: BUDGET,
                stopped: false,
            },
            system,
            start,
            run,
            cost,
        }
    }

    /// Has progress count from what a coarse reference costs.
    pub(super) fn expect(&mut self, coarse: f64) {
        self.meter.expected = EXPECTED * coarse;
    }

    /// Evaluations of gravity so far.
    pub(super) fn evaluations(&self) -> u64 {
        self.meter.evaluations as u64
    }

    /// How many instants there are.
    pub(super) fn instants(&self) -> usize {
        self.instants.len()
    }

    /// Time of an instant.
    pub(super) fn time(&self, instant: usize) -> f64 {
        let steps = self.instants[instant] as f64 / f64::from(self.parts);
        steps * (self.run.duration / self.run.steps as f64)
    }

    /// Predicted cost of a run by a method, of which `internal` steps are known to be made where it chooses them.
    pub(super) fn price(&self, method: Method, substeps: u32, internal: f64) -> f64 {
        let steps = self.run.steps as f64;
        match splitting(method) {
            Some((splitting, rotor)) => {
                steps * f64::from(substeps) * self.cost.step(&splitting, rotor)
            }
            None => internal * self.cost.internal_step() + self.cost.shown(internal, steps),
        }
    }

    /// Flies the run by Dormand and Prince's method as long as it costs no more than `most` and `goes_on` wants more after
    /// being told of an instant.
    pub(super) fn adaptive(
        &mut self,
        tolerance: f64,
        most: f64,
        mut goes_on: impl FnMut(usize, &[BodyState]) -> bool,
    ) -> Result<Course, ChoiceError> {
        let price = self.cost.internal_step();
        let mut integrator = Adaptive::to(tolerance, self.system.bodies());
        let mut states = self.start.to_vec();
        let mut course = Course::default();
        if let Err(error) = integrator.begin(self.system, &states) {
            course.end = End::Failed(error);
            return Ok(course);
        }
        for instant in 0..self.instants.len() {
            let time = self.time(instant);
            let mut made = 0;
            let Course { steps, cost, .. } = &mut course;
            let meter = &mut self.meter;
            let shown = integrator.show_at(self.system, time, &mut states, |attempts| {
                let more = f64::from(attempts - made);
                made = attempts;
                *steps += more;
                *cost += more * price;
                meter.spend(more * price, more * f64::from(STAGES)) && *cost <= most
            });
            if self.meter.stopped {
                return Err(ChoiceError::Interrupted);
            }
            if let Err(error) = shown {
                course.end = match error {
                    StepError::TooManySteps { .. } => End::Costly,
                    error => End::Failed(error),
                };
                return Ok(course);
            }
            course.states.push(states.clone());
            if !goes_on(instant, &states) {
                course.end = End::Enough;
                return Ok(course);
            }
        }
        Ok(course)
    }

    /// The same by a method of equal steps.
    pub(super) fn equal(
        &mut self,
        method: Method,
        substeps: u32,
        mut goes_on: impl FnMut(usize, &[BodyState]) -> bool,
    ) -> Result<Course, ChoiceError> {
        let made = self.run.steps as f64 * f64::from(substeps);
        let price = self.price(method, substeps, 0.0) / made;
        let evaluations = splitting(method).map_or(0, |(splitting, _)| splitting.work().0);
        let h = self.run.duration / self.run.steps as f64 / f64::from(substeps);
        let each = u64::from(substeps / self.parts);
        let mut integrator = method.integrator(self.system)?;
        let mut states = self.start.to_vec();
        let mut next = states.clone();
        let mut course = Course::default();
        integrator.start(self.system, &states);
        let mut step = 0;
        for instant in 0..self.instants.len() {
            while step < self.instants[instant] * each {
                let made = integrator.step_to(self.system, &states, &mut next, &self.controls, h);
                if let Err(error) = made {
                    course.end = End::Failed(error);
                    return Ok(course);
                }
                std::mem::swap(&mut states, &mut next);
                step += 1;
                course.steps += 1.0;
                if !self.meter.spend(price, evaluations.into()) {
                    return Err(ChoiceError::Interrupted);
                }
            }
            course.states.push(states.clone());
            if !goes_on(instant, &states) {
                course.end = End::Enough;
                return Ok(course);
            }
        }
        Ok(course)
    }
}

impl Default for Course {
    fn default() -> Self {
        Self {
            states: Vec::new(),
            cost: 0.0,
            steps: 0.0,
            end: End::Whole,
        }
    }
}
