//! Methods with error control and dense output.

mod dense;
mod embedded;
mod norm;
mod solution;
mod step_size;

use super::tableau::{self, Pair};
use super::taylor::{self, Taylor};
use super::{Integrator, MethodError, StepError, StepReport, accept};
use crate::{BodyState, Load, RigidBody, System};
use embedded::Embedded;
pub(super) use solution::Solution;

/// Limit of internal steps per output.
const LIMIT: u32 = 10_000_000;

/// Accepted tolerances: those that are meaningful and can be met in double precision.
const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-17..=0.1;

/// A method with error control: an explicit Runge–Kutta pair of eighth order, applied to x, γ, the nine entries of R,
/// and Π, or Taylor series.
///
/// The method chooses its own steps such that the estimated error of each is at most the tolerance. The error is the
/// root mean square over all moving components, absolute for attitudes and relative for the rest. Positions are
/// relative to the distance from the origin plus the radius of gyration. Momenta are relative to their magnitude plus
/// the momentum that moves the body by a tenth of that radius, or rotates it by a tenth of a radian, in the longest
/// step so far. Taylor series take the greatest of the last two terms instead. This internal solution runs ahead of the
/// output states, which come from a continuous extension of seventh order, or from the series. The output interval does
/// not affect the internal solution and hardly affects the cost.
///
/// When the controls change or a new trajectory starts, the internal solution restarts from the output states.
///
/// # Assumptions and limitations
/// Over long times the error is the sum of many local errors and exceeds the tolerance. Output within a step is less
/// accurate than its ends with the pairs: for two dumbbells (`tests/truth`, a1), the largest error of position, attitude (Frobenius
/// norm) and momenta was up to 3 tolerances with Fehlberg's pair and up to 50 with the Dormand–Prince pair, and R leaves
/// SO(3) by that error. The method is neither symplectic nor time-reversible. After an error, the internal solution
/// restarts from the output states. Close approaches are detected only at output times and at the ends of internal
/// steps.
pub struct Adaptive {
    solution: Box<dyn Solution>,
    /// Reference time of the current output grid, relative to the start of the solution, and the number of outputs
    /// since then. Outputs are `h` apart.
    origin: f64,
    shown: u64,
    h: f64,
    started: bool,
    /// States at the beginning and at the end of an internal step.
    begun: Vec<BodyState>,
    next: Vec<BodyState>,
    /// Limit of attempts per output.
    most: u32,
}

fn check_tolerance(method: &'static str, tolerance: f64) -> Result<(), MethodError> {
    if TOLERANCES.contains(&tolerance) {
        return Ok(());
    }
    Err(MethodError::Parameter {
        method,
        parameter: "tolerance",
        value: tolerance,
        expected: "1e-17 to 0.1",
    })
}

/// Work done by an [`Adaptive`] method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Accepted internal steps.
    pub accepted: u64,
    /// Internal steps rejected because of their error.
    pub rejected: u64,
    /// Gravity evaluations.
    pub evaluations: u64,
}

impl Adaptive {
    fn new(
        method: &'static str,
        pair: &'static Pair,
        tolerance: f64,
        bodies: &[RigidBody],
    ) -> Result<Self, MethodError> {
        check_tolerance(method, tolerance)?;
        Ok(Self::of(
            Box::new(Embedded::new(pair, tolerance, bodies)),
            bodies.len(),
        ))
    }

    fn of(solution: Box<dyn Solution>, bodies: usize) -> Self {
        Self {
            solution,
            origin: 0.0,
            shown: 0,
            h: 0.0,
            started: false,
            begun: Vec::with_capacity(bodies),
            next: Vec::with_capacity(bodies),
            most: LIMIT,
        }
    }

    /// Like [`Self::dormand_prince853`], for a tolerance that is already validated.
    pub(crate) fn to(tolerance: f64, bodies: &[RigidBody]) -> Self {
        let solution = Embedded::new(&tableau::DORMAND_PRINCE, tolerance, bodies);
        Self::of(Box::new(solution), bodies.len())
    }

    /// Fehlberg's 7(8) pair, advanced with the formula of eighth order: 13 gravity evaluations per step, and 4 more if
    /// a state is output within it. The tolerance must be between 1e-17 and 0.1.
    ///
    /// Its error estimate compares only stages at the same two times, so it does not detect loads that depend on time
    /// alone. If driven bodies attract others that hardly move themselves, prefer the other pair.
    pub fn fehlberg78(tolerance: f64, bodies: &[RigidBody]) -> Result<Self, MethodError> {
        Self::new(
            "Runge–Kutta–Fehlberg 7(8)",
            &tableau::FEHLBERG,
            tolerance,
            bodies,
        )
    }

    /// The 8(5,3) formulas of Dormand and Prince: 12 gravity evaluations per step, and 3 more if a state is output
    /// within it. The tolerance must be between 1e-17 and 0.1.
    pub fn dormand_prince853(tolerance: f64, bodies: &[RigidBody]) -> Result<Self, MethodError> {
        Self::new(
            "Dormand–Prince 8(5,3)",
            &tableau::DORMAND_PRINCE,
            tolerance,
            bodies,
        )
    }

    /// Taylor series of an order that fits the tolerance, which must be between 1e-17 and 0.1, in each step; see `docs/taylor.md`.
    ///
    /// # Errors
    /// Returns an error for another tolerance, and for gravity whose series is not implemented.
    pub fn taylor(tolerance: f64, system: &System) -> Result<Self, MethodError> {
        check_tolerance(taylor::NAME, tolerance)?;
        let solution = Taylor::new(tolerance, system)?;
        Ok(Self::of(Box::new(solution), system.bodies().len()))
    }

    /// The work since the method was created.
    pub fn work(&self) -> Work {
        self.solution.work()
    }

    /// Limits the gravity evaluations per output to approximately this number. Outputs that need more fail.
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

    /// Sets `states` to the states at a time since the solution began, equal to those that steps would output.
    /// `goes_on` is called after each internal step with the number of attempts so far. The solution stops with an
    /// error if it returns false.
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

    /// Advances the solution to `target`. `goes_on` is called with the number of attempts so far, and stops it by
    /// returning false.
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
                self.solution.end(system, &mut self.begun);
            }
            attempts += self.solution.advance(system, target)?;
            let until = self.solution.until();
            if system.switches_levels() {
                self.solution.end(system, &mut self.next);
                system.check_step(&self.begun, &self.next, until - begin);
            }
            if until.abs() <= target.abs() && system.has_extents() {
                self.solution.end(system, &mut self.next);
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

    fn start(&mut self, system: &mut System, _states: &[BodyState]) {
        self.started = false;
        self.solution.prepare(system);
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
