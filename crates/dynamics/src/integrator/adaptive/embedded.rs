use super::super::flow::{Components, pack, place, unpack};
use super::super::stages::Stages;
use super::super::tableau::Pair;
use super::dense::Dense;
use super::norm::Norm;
use super::step_size::StepSize;
use super::{Solution, Work};
use crate::{BodyState, Load, RigidBody, StepError, System};

/// A solution by an embedded Runge–Kutta pair.
pub(super) struct Embedded {
    pair: &'static Pair,
    tolerance: f64,
    stages: Stages,
    norm: Norm,
    step_size: StepSize,
    dense: Dense,
    /// State and time at the beginning and at the end of the last step.
    y: Vec<Components>,
    begin: f64,
    end: Vec<Components>,
    until: f64,
    work: Work,
}

impl Embedded {
    pub(super) fn new(pair: &'static Pair, tolerance: f64, bodies: &[RigidBody]) -> Self {
        let count = bodies.len();
        Self {
            pair,
            tolerance,
            stages: Stages::new(pair.tableau.stages.len() + 1 + pair.extra.len(), count),
            norm: Norm::new(bodies),
            step_size: StepSize::default(),
            dense: Dense::new(count),
            y: vec![[0.0; 18]; count],
            begin: 0.0,
            end: vec![[0.0; 18]; count],
            until: 0.0,
            work: Work::default(),
        }
    }

    /// Index of the stage that holds the derivative at the end of a step.
    fn last(&self) -> usize {
        self.pair.tableau.stages.len()
    }
}

impl Solution for Embedded {
    fn work(&self) -> Work {
        self.work
    }

    fn evaluations_a_step(&self) -> u64 {
        self.last() as u64
    }

    fn controls(&self) -> &[Load] {
        self.stages.controls()
    }

    fn until(&self) -> f64 {
        self.until
    }

    fn end(&mut self, _system: &System, states: &mut Vec<BodyState>) {
        states.clear();
        states.extend(self.end.iter().map(unpack));
    }

    fn prepare(&mut self, _system: &System) {
        self.step_size = StepSize::default();
    }

    fn start(
        &mut self,
        system: &mut System,
        states: &[BodyState],
        controls: &[Load],
    ) -> Result<(), StepError> {
        self.begin = 0.0;
        self.until = 0.0;
        for (end, state) in self.end.iter_mut().zip(states) {
            *end = pack(state);
        }
        let last = self.last();
        self.stages.set_controls(controls);
        self.stages.evaluate_at(system, &self.end, last);
        self.work.evaluations += 1;
        let derivatives = self.stages.derivative(last);
        if let Some(body) = derivatives.iter().position(|k| !unpack(k).is_finite()) {
            return Err(StepError::NotFinite { body });
        }
        if !self.step_size.is_known() {
            let bodies = self.norm.scales().iter().zip(system.bodies());
            let motions = states.iter().zip(derivatives);
            let each = bodies.zip(motions);
            self.step_size.guess(
                self.tolerance,
                each.map(|((scale, body), (state, k))| (scale, body, *state, unpack(k))),
            );
        }
        Ok(())
    }

    fn advance(&mut self, system: &mut System, target: f64) -> Result<u32, StepError> {
        let Self { pair, stages, .. } = self;
        let last = pair.tableau.stages.len();
        std::mem::swap(&mut self.y, &mut self.end);
        stages.reuse(last, 0);
        self.begin = self.until;
        self.dense.clear();
        let least = 4.0 * f64::EPSILON * self.begin.abs().max(target.abs());
        let forward = if target < self.begin { -1.0 } else { 1.0 };
        let mut attempts = 0;
        loop {
            let proposed = self.step_size.get(target.abs());
            // The step is smaller than `least`, infinite or NaN.
            if !(proposed >= least && proposed > 0.0 && proposed.is_finite()) {
                return Err(StepError::StepSizeUnderflow {
                    step: proposed,
                    least,
                });
            }
            attempts += 1;
            self.until = self.begin + forward * proposed;
            let h = self.until - self.begin;
            for (index, stage) in pair.tableau.stages.iter().enumerate().skip(1) {
                stages.evaluate(system, &self.y, h, stage, index);
            }
            self.work.evaluations += last as u64 - 1;
            stages.finish(system, &self.y, h, pair.tableau.weights, &mut self.end);
            let rate =
                self.norm
                    .error_rate(pair, stages, [&self.y, &self.end], self.step_size.longest());
            if self.step_size.judge(h.abs() * rate / self.tolerance) {
                break;
            }
            self.work.rejected += 1;
        }
        stages.evaluate_at(system, &self.end, last);
        self.work.evaluations += 1;
        self.work.accepted += 1;
        Ok(attempts)
    }

    fn show(&mut self, system: &mut System, target: f64, states: &mut Vec<BodyState>) {
        if target == self.until {
            self.end(system, states);
            return;
        }
        let h = self.until - self.begin;
        if !self.dense.is_known() {
            for (stage, index) in self.pair.extra.iter().zip(self.last() + 1..) {
                self.stages.evaluate(system, &self.y, h, stage, index);
                self.work.evaluations += 1;
            }
            self.dense
                .set(self.pair, &self.stages, [&self.y, &self.end], h);
        }
        let t = target - self.begin;
        let mut shown = [0.0; 18];
        states.clear();
        for (index, (body, y)) in system.bodies().iter().zip(&self.y).enumerate() {
            place(body, y, t, &mut shown, |shown| {
                self.dense.evaluate(index, y, t / h, shown);
            });
            states.push(unpack(&shown));
        }
    }
}
