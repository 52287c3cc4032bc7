//! Runge–Kutta pairs with error control and dense output.

mod dense;
mod norm;
mod solution;
mod step_size;

use super::tableau::{self, Pair};
use super::{Integrator, MethodError, StepError, StepReport, accept};
use crate::{BodyState, Load, RigidBody, System};
use solution::Solution;

/// Internal steps that one output may take.
const LIMIT: u32 = 10_000_000;

/// Tolerances that can be met in double precision and mean something.
const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-17..=0.1;

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
/// The error over long times is the sum of many local ones, not the tolerance. What is shown within a step is less
/// accurate than its ends: for two dumbbells (`tests/truth`, a1) the largest error of position, attitude (Frobenius norm) and
/// momenta was up to 3 tolerances with Fehlberg's pair and up to 50 with that of Dormand and Prince. R leaves SO(3) by that error; neither
/// symplectic nor time-reversible. After an error, the internal solution starts anew from the states shown. Close
/// approaches are looked for where states are shown and where internal steps end.
pub struct Adaptive {
    solution: Solution,
    /// Time of the solution, from its start, from which on the outputs are `h` apart; and how many there were.
    origin: f64,
    shown: u64,
    h: f64,
    started: bool,
    /// Where an internal step begins, and where it ends.
    begun: Vec<BodyState>,
    next: Vec<BodyState>,
    /// Attempts that one output may take.
    most: u32,
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
                expected: "1e-17 to 0.1",
            });
        }
        Ok(Self::of(pair, tolerance, bodies))
    }

    fn of(pair: &'static Pair, tolerance: f64, bodies: &[RigidBody]) -> Self {
        Self {
            solution: Solution::new(pair, tolerance, bodies),
            origin: 0.0,
            shown: 0,
            h: 0.0,
            started: false,
            begun: Vec::with_capacity(bodies.len()),
            next: Vec::with_capacity(bodies.len()),
            most: LIMIT,
        }
    }

    /// [`Self::dormand_prince853`] to a tolerance that is known to be one.
    pub(crate) fn to(tolerance: f64, bodies: &[RigidBody]) -> Self {
        Self::of(&tableau::DORMAND_PRINCE, tolerance, bodies)
    }

    /// Fehlberg's 7(8) pair, advanced with the formula of eighth order: 13 evaluations of gravity a step, and 4 where a state
    /// is shown within it. The tolerance is 1e-17 to 0.1.
    ///
    /// Its error estimate compares stages at the same two times only, and so does not see how loads depend on time alone: where
    /// driven bodies attract others that hardly move themselves, the other pair is to be preferred.
    pub fn fehlberg78(tolerance: f64, bodies: &[RigidBody]) -> Result<Self, MethodError> {
        Self::new(
            "Runge–Kutta–Fehlberg 7(8)",
            &tableau::FEHLBERG,
            tolerance,
            bodies,
        )
    }

    /// The 8(5,3) formulas of Dormand and Prince: 12 evaluations of gravity a step, and 3 where a state is shown within it.
    /// The tolerance is 1e-17 to 0.1.
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
        self.solution.work()
    }

    /// Has the next outputs fail that would take more than about so many evaluations of gravity each.
    pub(crate) fn limit(&mut self, evaluations: u64) {
        let stages = self.solution.evaluations_a_step();
        self.most = u32::try_from(evaluations / stages).map_or(LIMIT, |most| most.min(LIMIT));
    }

    /// Begins a solution at `states`, without controls.
    pub(crate) fn begin(
        &mut self,
        system: &mut System,
        states: &[BodyState],
    ) -> Result<(), StepError> {
        self.start(system, states);
        let controls = vec![Load::default(); states.len()];
        self.solution.start(system, states, &controls)
    }

    /// Sets `states` to those at a time since the solution began, the same as a step would show. After each internal step
    /// `goes_on` is told the attempts so far.
    pub(crate) fn show_at(
        &mut self,
        system: &mut System,
        time: f64,
        states: &mut [BodyState],
        goes_on: impl FnMut(u32) -> bool,
    ) -> Result<(), StepError> {
        self.reach(system, time, goes_on)?;
        self.solution.show(system, time, &mut self.next);
        accept(system, &self.next, states)
    }

    /// Runs the solution up to `target`, as long as it may go on after so many attempts.
    fn reach(
        &mut self,
        system: &mut System,
        target: f64,
        mut goes_on: impl FnMut(u32) -> bool,
    ) -> Result<u32, StepError> {
        let mut attempts = 0;
        while self.solution.until().abs() < target.abs() {
            let begin = self.solution.until();
            if system.switches_levels() {
                self.solution.end(&mut self.begun);
            }
            attempts += self.solution.advance(system, target)?;
            let until = self.solution.until();
            if system.switches_levels() {
                self.solution.end(&mut self.next);
                system.check_step(&self.begun, &self.next, until - begin);
            }
            if until.abs() <= target.abs() {
                self.solution.end(&mut self.next);
                system.check_clearance(&self.next)?;
            }
            if !goes_on(attempts) {
                return Err(StepError::TooManySteps { limit: attempts });
            }
        }
        Ok(attempts)
    }

    fn try_step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError> {
        let turns = (h > 0.0) != (self.h > 0.0);
        if !self.started || turns || controls != self.solution.controls() {
            self.solution.start(system, states, controls)?;
            self.started = true;
            (self.origin, self.shown, self.h) = (0.0, 0, h);
        }
        if h != self.h {
            self.origin += self.shown as f64 * self.h;
            (self.shown, self.h) = (0, h);
        }
        let target = self.origin + (self.shown + 1) as f64 * h;
        let most = self.most;
        let cuts = self.reach(system, target, |attempts| attempts <= most)?;
        self.solution.show(system, target, &mut self.next);
        accept(system, &self.next, states)?;
        self.shown += 1;
        Ok(StepReport {
            iterations: 0,
            cuts,
        })
    }
}

impl Integrator for Adaptive {
    fn cuts_steps(&self) -> bool {
        true
    }

    fn start(&mut self, _system: &mut System, _states: &[BodyState]) {
        self.started = false;
        self.solution.forget_step_size();
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
