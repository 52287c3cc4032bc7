use std::ops::ControlFlow;

use super::cost::{Cost, STAGES, work};
use super::{ChoiceError, Run};
use crate::integrator::{Adaptive, ClosedForm, Integrator};
use crate::{Accuracy, BodyState, Load, Method, StepError, System};

/// Budget of a rehearsal, in approximate nanoseconds.
pub(super) const BUDGET: f64 = 6e9;

/// Number of instants at which flights are compared (four per factor of two in time), and minimum number of parts of a
/// run. Instants lie at the ends of parts.
const INSTANTS: i32 = 64;
const PARTS: u64 = 64;

/// Expected cost of a choice, in multiples of a coarse reference flight. A rough figure for the progress report.
const EXPECTED: f64 = 25.0;

/// Cost between two progress reports, in approximate nanoseconds.
const REPORT: f64 = 1e7;

/// The methods that choose their own steps.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Tuned {
    DormandPrince,
    Taylor,
}

impl Tuned {
    /// The method with this tolerance.
    pub(super) fn to(self, tolerance: f64) -> Method {
        match self {
            Self::DormandPrince => Method::DormandPrince853 { tolerance },
            Self::Taylor => Method::Taylor { tolerance },
        }
    }
}

/// Integrates a run repeatedly and counts the cost.
pub(super) struct Flights<'a> {
    system: &'a mut System,
    start: &'a [BodyState],
    controls: Vec<Load>,
    run: Run,
    pub(super) cost: Cost,
    pub(super) accuracy: Accuracy,
    /// Number of parts into which each step of the run is divided, so that a run of few steps has instants inside its
    /// steps.
    parts: u32,
    /// Instants, in parts since the start. The last one is the end of the run.
    instants: Vec<u64>,
    meter: Meter<'a>,
}

/// Counts the cost and reports progress.
struct Meter<'a> {
    progress: &'a mut dyn FnMut(f64) -> ControlFlow<()>,
    evaluations: f64,
    spent: f64,
    reported: f64,
    /// Expected total cost.
    expected: f64,
    stopped: bool,
}

/// The course of a flight.
pub(super) struct Course {
    /// States at the instants that the flight reached.
    pub(super) states: Vec<Vec<BodyState>>,
    /// Cost of the flight.
    pub(super) cost: f64,
    /// Internal steps made.
    pub(super) steps: f64,
    /// Reason for the end of the flight.
    pub(super) end: End,
}

/// Reasons for the end of a flight.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum End {
    /// The run is complete.
    Whole,
    /// The observer stopped the flight.
    Enough,
    /// The flight would have exceeded its cost limit.
    Costly,
    /// A step failed.
    Failed(StepError),
}

impl Meter<'_> {
    /// Adds to the cost and the count of evaluations. Returns true if the search may continue.
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

    /// Returns true if a body has drag.
    pub(super) fn has_drag(&self) -> bool {
        self.system.has_drag()
    }

    /// Sets the expected total cost from the cost of a coarse reference.
    pub(super) fn expect(&mut self, coarse: f64) {
        self.meter.expected = EXPECTED * coarse;
    }

    /// Gravity evaluations so far.
    pub(super) fn evaluations(&self) -> u64 {
        self.meter.evaluations as u64
    }

    /// The number of instants.
    pub(super) fn instants(&self) -> usize {
        self.instants.len()
    }

    /// Time of an instant.
    pub(super) fn time(&self, instant: usize) -> f64 {
        let steps = self.instants[instant] as f64 / f64::from(self.parts);
        steps * (self.run.duration / self.run.steps as f64)
    }

    /// The steps of a method of equal steps up to an instant; `None` if it is inside a step.
    pub(super) fn steps_to(&self, instant: usize, substeps: u32) -> Option<u64> {
        let (reached, parts) = (
            self.instants[instant].saturating_mul(substeps.into()),
            u64::from(self.parts),
        );
        reached.is_multiple_of(parts).then_some(reached / parts)
    }

    /// Predicted cost of a run by a method. `internal` is the number of steps of a method that chooses its own steps.
    pub(super) fn price(&self, method: Method, substeps: u32, internal: f64) -> f64 {
        let steps = self.run.steps as f64;
        if method.has_error_control() {
            internal * self.internal_step(method) + self.shown(method, internal)
        } else {
            steps * f64::from(substeps) * self.cost.step(method)
        }
    }

    /// Predicted cost of an internal step of a method that chooses its own steps.
    fn internal_step(&self, method: Method) -> f64 {
        match (method, method.order()) {
            (Method::Taylor { .. }, Some(order)) => self.cost.expansion(order),
            _ => self.cost.internal_step(),
        }
    }

    /// Predicted cost of the output of a run by a method that chooses its own steps.
    fn shown(&self, method: Method, internal: f64) -> f64 {
        let steps = self.run.steps as f64;
        match (method, method.order()) {
            (Method::Taylor { .. }, Some(order)) => self.cost.evaluated(order, steps),
            _ => self.cost.shown(internal, steps),
        }
    }

    /// The run in closed form.
    pub(super) fn closed_form(&mut self) -> Result<Course, ChoiceError> {
        let mut integrator = ClosedForm::new(self.system)?;
        let mut course = Course {
            cost: self.cost.closed_form(self.run.steps as f64),
            ..Course::default()
        };
        for instant in 0..self.instants.len() {
            let mut states = self.start.to_vec();
            integrator.start(self.system, self.start);
            integrator
                .step(self.system, &mut states, &self.controls, self.time(instant))
                .map_err(ChoiceError::Flight)?;
            course.states.push(states);
        }
        Ok(course)
    }

    /// Integrates the run by a method that chooses its own steps while it costs at most `most` and `goes_on`, called at
    /// each instant, returns true.
    pub(super) fn adaptive(
        &mut self,
        tuned: Tuned,
        tolerance: f64,
        most: f64,
        mut goes_on: impl FnMut(usize, &[BodyState]) -> bool,
    ) -> Result<Course, ChoiceError> {
        let method = tuned.to(tolerance);
        let price = self.internal_step(method);
        let (mut integrator, evaluations) = match tuned {
            Tuned::DormandPrince => (Adaptive::to(tolerance, self.system.bodies()), STAGES),
            Tuned::Taylor => {
                let integrator = Adaptive::taylor(tolerance, self.system)?;
                (integrator, method.order().unwrap_or_default())
            }
        };
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
                meter.spend(more * price, more * f64::from(evaluations)) && *cost <= most
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

    /// Integrates the run by a method of equal steps while `goes_on`, called at each instant that is the end of a step,
    /// returns true.
    pub(super) fn equal(
        &mut self,
        method: Method,
        substeps: u32,
        mut goes_on: impl FnMut(usize, &[BodyState]) -> bool,
    ) -> Result<Course, ChoiceError> {
        let made = self.run.steps as f64 * f64::from(substeps);
        let price = self.price(method, substeps, 0.0) / made;
        let (evaluations, _) = work(method);
        let h = self.run.duration / self.run.steps as f64 / f64::from(substeps);
        let mut integrator = method.integrator(self.system)?;
        let mut states = self.start.to_vec();
        let mut next = states.clone();
        let mut course = Course::default();
        integrator.start(self.system, &states);
        let mut step = 0;
        for instant in 0..self.instants.len() {
            let Some(reached) = self.steps_to(instant, substeps) else {
                continue;
            };
            while step < reached {
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
