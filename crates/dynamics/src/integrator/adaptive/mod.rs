//! Runge–Kutta pairs with error control and dense output.

mod dense;
mod step_size;

use super::flow::{Components, pack, place, unpack};
use super::scale::Scale;
use super::stages::Stages;
use super::tableau::{self, Pair};
use super::{Integrator, MethodError, StepError, StepReport, accept};
use crate::{BodyState, Load, RigidBody, System};
use dense::Dense;
use step_size::StepSize;

/// Internal steps that one output may take.
const LIMIT: u32 = 10_000_000;

/// Tolerances that can be met in double precision and mean something.
const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-15..=0.1;

/// An explicit Runge–Kutta pair of eighth order with error control, on x, γ, the nine numbers of R, and Π.
///
/// It has its own steps, chosen so that the estimated error of each is at most the tolerance: the root mean square over all
/// moving components, absolute for attitudes, relative for the rest. Positions are relative to the distance from the origin
/// plus the radius of gyration, momenta to their length plus what moves the body by a tenth of that radius, or turns it by
/// a tenth of a radian, in the longest step so far. The solution so found runs ahead of the states shown, which come from
/// a continuous extension of seventh order: how often the states are shown makes no difference to it, and little to its cost.
///
/// Where the controls change or a new trajectory starts, the internal solution starts anew from the states shown.
///
/// # Assumptions and limitations
/// The error over long times is the sum of many local ones, not the tolerance. R leaves SO(3) by that error; neither
/// symplectic nor time-reversible. After an error, the internal solution starts anew from the states shown. Close
/// approaches are looked for where states are shown and where internal steps end.
pub struct Adaptive {
    pair: &'static Pair,
    tolerance: f64,
    stages: Stages,
    scales: Vec<Scale>,
    moving: f64,
    step_size: StepSize,
    dense: Dense,
    /// The last internal step, from `y` at time `begin` to `end` at time `until`; times count from the last start.
    y: Vec<Components>,
    end: Vec<Components>,
    begin: f64,
    until: f64,
    /// Outputs shown since `origin`, all `h` apart.
    origin: f64,
    shown: u64,
    h: f64,
    started: bool,
    next: Vec<BodyState>,
    work: Work,
}

/// What an [`Adaptive`] method has done so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Internal steps made.
    pub accepted: u64,
    /// Internal steps given up because of their error.
    pub rejected: u64,
    /// Evaluations of gravity.
    pub evaluations: u64,
}

impl Adaptive {
    fn new(
        method: &'static str,
        pair: &'static Pair,
        tolerance: f64,
        bodies: &[RigidBody],
    ) -> Result<Self, MethodError> {
        if !TOLERANCES.contains(&tolerance) {
            return Err(MethodError::Parameter {
                method,
                parameter: "tolerance",
                value: tolerance,
                expected: "1e-15 to 0.1",
            });
        }
        let count = bodies.len();
        let scales: Vec<_> = bodies.iter().map(Scale::new).collect();
        Ok(Self {
            pair,
            tolerance,
            stages: Stages::new(pair.tableau.stages.len() + 1 + pair.extra.len(), count),
            moving: scales.iter().map(Scale::moving).sum(),
            scales,
            step_size: StepSize::default(),
            dense: Dense::new(count),
            y: vec![[0.0; 18]; count],
            end: vec![[0.0; 18]; count],
            begin: 0.0,
            until: 0.0,
            origin: 0.0,
            shown: 0,
            h: 0.0,
            started: false,
            next: Vec::with_capacity(count),
            work: Work::default(),
        })
    }

    /// Fehlberg's 7(8) pair, advanced with the formula of eighth order: 13 evaluations of gravity a step, and 4 where a state
    /// is shown within it. The tolerance is 1e-15 to 0.1.
    pub fn fehlberg78(tolerance: f64, bodies: &[RigidBody]) -> Result<Self, MethodError> {
        Self::new(
            "Runge–Kutta–Fehlberg 7(8)",
            &tableau::FEHLBERG,
            tolerance,
            bodies,
        )
    }

    /// The 8(5,3) formulas of Dormand and Prince: 12 evaluations of gravity a step, and 3 where a state is shown within it.
    /// The tolerance is 1e-15 to 0.1.
    pub fn dormand_prince853(tolerance: f64, bodies: &[RigidBody]) -> Result<Self, MethodError> {
        Self::new(
            "Dormand–Prince 8(5,3)",
            &tableau::DORMAND_PRINCE,
            tolerance,
            bodies,
        )
    }

    /// What it has done since it was made.
    pub fn work(&self) -> Work {
        self.work
    }

    /// Number of the stage that is the derivative at the end of a step.
    fn last(&self) -> usize {
        self.pair.tableau.stages.len()
    }

    /// Begins the internal solution at `states`, under `controls`.
    fn begin(
        &mut self,
        system: &mut System,
        states: &[BodyState],
        controls: &[Load],
    ) -> Result<(), StepError> {
        self.started = true;
        self.begin = 0.0;
        self.until = 0.0;
        self.origin = 0.0;
        self.shown = 0;
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
            let bodies = self.scales.iter().zip(system.bodies());
            let motions = states.iter().zip(derivatives);
            let each = bodies.zip(motions);
            self.step_size.guess(
                self.tolerance,
                each.map(|((scale, body), (state, k))| (scale, body, *state, unpack(k))),
            );
        }
        Ok(())
    }

    /// Makes one internal step towards `target`, with as many attempts as it takes; returns their number.
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
            // Smaller than `least` and NaN.
            if !(proposed >= least && proposed > 0.0) {
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
            let rate = error_rate(
                pair,
                stages,
                &self.scales,
                self.moving,
                [&self.y, &self.end],
                self.step_size.longest(),
            );
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

    /// Runs the internal solution up to `target`.
    fn reach(&mut self, system: &mut System, target: f64) -> Result<u32, StepError> {
        let mut attempts = 0;
        while self.until.abs() < target.abs() {
            attempts += self.advance(system, target)?;
            if self.until.abs() <= target.abs() {
                self.next.clear();
                self.next.extend(self.end.iter().map(unpack));
                system.check_clearance(&self.next)?;
            }
            if attempts > LIMIT {
                return Err(StepError::TooManySteps { limit: LIMIT });
            }
        }
        Ok(attempts)
    }

    /// Sets `next` to the states at `target`, within the last internal step.
    fn show(&mut self, system: &mut System, target: f64) {
        self.next.clear();
        if target == self.until {
            self.next.extend(self.end.iter().map(unpack));
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
        for (index, (body, y)) in system.bodies().iter().zip(&self.y).enumerate() {
            let dense = &self.dense;
            place(body, y, t, &mut shown, |shown| {
                dense.evaluate(index, y, t / h, shown);
            });
            self.next.push(unpack(&shown));
        }
    }

    fn try_step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError> {
        if !self.started || controls != self.stages.controls() || h * self.h < 0.0 {
            self.begin(system, states, controls)?;
            self.h = h;
        }
        if h != self.h {
            self.origin += self.shown as f64 * self.h;
            self.shown = 0;
            self.h = h;
        }
        let target = self.origin + (self.shown + 1) as f64 * h;
        let cuts = self.reach(system, target)?;
        self.show(system, target);
        accept(system, &self.next, states)?;
        self.shown += 1;
        Ok(StepReport {
            iterations: 0,
            cuts,
        })
    }
}

/// The estimated error of a step by its length, in the norm of [`Adaptive`] with momenta measured by the motion in `time`:
/// `e₅² / √(n (e₅² + e₃²/100))` with the sums of squares of both estimates (Hairer, Nørsett, Wanner, §II.10).
fn error_rate(
    pair: &Pair,
    stages: &Stages,
    scales: &[Scale],
    moving: f64,
    [y, end]: [&[Components]; 2],
    time: f64,
) -> f64 {
    let (mut fine, mut coarse) = (0.0, 0.0);
    let mut sum = [0.0; 18];
    for (index, scale) in scales.iter().enumerate() {
        let inverse = scale.inverse(&y[index], &end[index], time);
        let mut squares = |row| {
            stages.sum(index, row, &mut sum);
            sum_of_squares(&sum, &inverse)
        };
        fine += squares(pair.error);
        coarse += squares(pair.damping);
    }
    if fine == 0.0 {
        return 0.0;
    }
    fine / (moving * (fine + 0.01 * coarse)).sqrt()
}

/// `Σ (a_i b_i)²`, in six sums side by side.
#[inline]
fn sum_of_squares(a: &Components, b: &Components) -> f64 {
    let mut sums = [0.0; 6];
    for (a, b) in a.chunks_exact(6).zip(b.chunks_exact(6)) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += (a * b) * (a * b);
        }
    }
    (sums[0] + sums[3]) + (sums[1] + sums[4]) + (sums[2] + sums[5])
}

impl Integrator for Adaptive {
    fn start(&mut self, _system: &mut System, _states: &[BodyState]) {
        self.started = false;
        self.step_size = StepSize::default();
    }

    fn step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError> {
        let report = self.try_step(system, states, controls, h);
        if report.is_err() {
            self.start(system, states);
        }
        report
    }
}
