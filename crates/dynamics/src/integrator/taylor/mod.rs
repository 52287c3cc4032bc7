//! Taylor series of the equations of motion, with error control.

mod body;
mod compile;
mod jet;
mod lever;
mod multipoles;
mod oblate;
mod places;
mod points;
mod rotation;
mod series;
mod weight;

use fearless_simd::Level;

use self::compile::{compile, size};
use self::series::Series;
use super::adaptive::{Solution, Work};
use super::{MethodError, StepError};
use crate::rotation::FreeRotation;
use crate::system::Selection;
use crate::{BodyState, Load, Mobility, System};

/// Greatest ratio of the step to the unit of time of coefficients, either way.
const NEAR: f64 = 65_536.0;

/// Units of time that are tried: from the first guess to the least number.
const UNITS: u32 = 64;

/// Name of the method in errors.
pub(super) const NAME: &str = "Taylor series";

/// The order for a tolerance: that of Jorba and Zou (2005), `1 − ½ ln tolerance`, and four more, because most of the work
/// of an order does not grow with it here.
pub(super) fn order(tolerance: f64) -> u32 {
    let order = 5.0 - 0.5 * libm::log(tolerance);
    libm::ceil(order) as u32
}

/// The size of the expansion of a system, which determines its cost.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ExpansionSize {
    /// For each body whether its rotation is expanded.
    pub(crate) turning: Vec<bool>,
    /// Groups of forces that are computed side by side.
    pub(crate) forces: f64,
    /// Products whose coefficients are summed.
    pub(crate) terms: f64,
}

impl ExpansionSize {
    /// The size for `system`, or `None` if it cannot be expanded.
    pub(crate) fn of(system: &System) -> Option<Self> {
        size(system).ok()
    }
}

/// A solution by Taylor series: in each step, the coefficients of positions, quaternions and velocities follow from
/// recurrences up to an order that fits the tolerance. The step is as long as the last two terms allow. Quaternions are
/// normalized between steps, and the rotation of bodies without moments is known in closed form.
pub(super) struct Taylor {
    tolerance: f64,
    series: Series,
    /// What the series contain.
    selection: Selection,
    level: Level,
    free: Vec<FreeRotation>,
    controls: Vec<Load>,
    /// The states at the start.
    start: Vec<BodyState>,
    begin: f64,
    until: f64,
    /// The last step, or an estimate of the first one.
    time: f64,
    /// True before the first step.
    fresh: bool,
    /// True if the last expansion is the motion up to its unit of time at least.
    endless: bool,
    work: Work,
}

impl Taylor {
    /// Creates the solution for a valid `tolerance`.
    pub(super) fn new(tolerance: f64, system: &System) -> Result<Self, MethodError> {
        let bodies = system.bodies();
        let free = bodies.iter().map(|body| FreeRotation::new(body.inertia()));
        Ok(Self {
            tolerance,
            series: compile(system, order(tolerance) as usize)?,
            selection: system.selection().clone(),
            level: Level::new(),
            free: free.collect(),
            controls: vec![Load::default(); bodies.len()],
            start: Vec::with_capacity(bodies.len()),
            begin: 0.0,
            until: 0.0,
            time: f64::INFINITY,
            fresh: true,
            endless: false,
            work: Work::default(),
        })
    }

    /// Makes the end of the last step the beginning of the next one.
    fn move_on(&mut self, system: &System) {
        if !self.fresh {
            self.series.begin_at(self.level, self.until - self.begin);
            let bodies = system.bodies().iter().zip(&mut self.series.bodies);
            for ((own, body), start) in bodies.zip(&self.start) {
                match own.mobility() {
                    Mobility::Free | Mobility::Pivoted => {}
                    Mobility::Driven(drive) => {
                        body.begin(own, &drive.advance(own, start, self.until));
                    }
                    Mobility::Fixed => body.begin(own, start),
                }
            }
        }
        self.fresh = false;
        self.begin = self.until;
    }

    /// Expands the motion, in a unit of time so close to the step that coefficients neither overflow nor underflow.
    /// Returns the step, or infinity if the polynomial is the motion up to `span` at least.
    fn expand(&mut self, span: f64) -> Result<f64, StepError> {
        if self.time < f64::INFINITY {
            self.series.set_unit(self.time);
        } else {
            self.series.guess_unit(self.level);
        }
        for _ in 0..UNITS {
            self.series.expand(self.level);
            self.work.evaluations += self.series.order as u64;
            let unit = self.series.unit;
            let known = if self.time < f64::INFINITY {
                self.time
            } else {
                self.series.step(self.tolerance, self.time)
            };
            let step = self.series.step(self.tolerance, known);
            if step == f64::INFINITY {
                if span <= unit {
                    return Ok(step);
                }
                self.series.set_unit(2.0 * span);
            } else if step > 0.0 {
                if (unit / NEAR..unit * NEAR).contains(&step) {
                    self.time = step;
                    return Ok(step);
                }
                self.series.set_unit(step);
            } else {
                // An overflow.
                self.series.set_unit(unit / (NEAR * NEAR));
            }
        }
        let body = self.series.not_finite().unwrap_or_default();
        Err(StepError::NotFinite { body })
    }

    /// Sets `states` to those at `target`.
    fn states_at(&self, system: &System, target: f64, states: &mut Vec<BodyState>) {
        let t = target - self.begin;
        states.clone_from(&self.start);
        self.series.show(self.level, t, states);
        for (index, (body, state)) in self.series.bodies.iter().zip(states).enumerate() {
            let own = &system.bodies()[index];
            match own.mobility() {
                Mobility::Driven(drive) => *state = drive.advance(own, &self.start[index], target),
                Mobility::Fixed => *state = self.start[index],
                Mobility::Free | Mobility::Pivoted => {
                    if !body.turns() {
                        let BodyState {
                            attitude,
                            angular_momentum,
                            ..
                        } = self.start[index];
                        let end = (&mut state.attitude, &mut state.angular_momentum);
                        self.free[index].carry(&attitude, &angular_momentum, target, end);
                    }
                }
            }
        }
    }
}

impl Solution for Taylor {
    fn work(&self) -> Work {
        self.work
    }

    fn evaluations_a_step(&self) -> u64 {
        self.series.order as u64
    }

    fn controls(&self) -> &[Load] {
        &self.controls
    }

    fn until(&self) -> f64 {
        self.until
    }

    fn end(&mut self, system: &System, states: &mut Vec<BodyState>) {
        self.states_at(system, self.until, states);
    }

    fn prepare(&mut self, system: &System) {
        if self.selection == *system.selection() {
            return;
        }
        // What is kept has a series if all interactions have one, which `new` has checked.
        if let Ok(series) = compile(system, self.series.order) {
            self.series = series;
            self.selection = system.selection().clone();
        }
    }

    fn start(
        &mut self,
        system: &mut System,
        states: &[BodyState],
        controls: &[Load],
    ) -> Result<(), StepError> {
        states.clone_into(&mut self.start);
        self.controls.copy_from_slice(controls);
        let bodies = self.series.bodies.iter_mut().zip(system.bodies());
        for ((series, body), (state, control)) in bodies.zip(states.iter().zip(controls)) {
            series.set_control(control);
            series.begin(body, state);
        }
        self.begin = 0.0;
        self.until = 0.0;
        self.time = f64::INFINITY;
        self.fresh = true;
        self.endless = false;
        Ok(())
    }

    fn advance(&mut self, system: &mut System, target: f64) -> Result<u32, StepError> {
        if !self.endless {
            self.move_on(system);
        }
        let span = target - self.begin;
        if !(self.endless && span.abs() <= self.series.unit) {
            let step = self.expand(span.abs())?;
            let least = 4.0 * f64::EPSILON * self.begin.abs().max(target.abs());
            if step < least {
                return Err(StepError::StepSizeUnderflow { step, least });
            }
            self.endless = step == f64::INFINITY;
            self.until = self.begin + step.copysign(span);
            self.work.accepted += 1;
        }
        if self.endless {
            self.until = target;
        }
        Ok(1)
    }

    fn show(&mut self, system: &mut System, target: f64, states: &mut Vec<BodyState>) {
        self.states_at(system, target, states);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};

    use super::*;
    use crate::gravity::{Central, Multipole, Mutual};
    use crate::{Inertia, PointMass, RigidBody};

    /// The expansion rounds in the same way whatever instructions the machine has.
    #[test]
    fn instructions_do_not_change_the_result() {
        let inertia = || {
            let turn = lgvi_lie::exp(&Vector3::new(0.3, -0.2, 0.9));
            let moments = Matrix3::from_diagonal(&Vector3::new(0.3, 0.4, 0.5));
            Inertia::new(turn * moments * turn.transpose()).expect("an inertia")
        };
        let points = [Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y()];
        let points = points.map(|arm| PointMass {
            mass: 0.25,
            position: 0.2 * arm,
        });
        let solid = RigidBody::new(1.0, inertia(), points.to_vec()).expect("a body");
        let multipole = Multipole::of_inertia(1.0, &inertia());
        let multipole = RigidBody::with_multipole(inertia(), multipole).expect("a body");
        for body in [solid, multipole] {
            let bodies = vec![body.clone(), body];
            let states = [0.0, 1.5].map(|x| {
                BodyState::from_velocities(
                    &bodies[0],
                    Vector3::new(x, 3.0, 0.1 * x),
                    Vector3::new(0.2 - x, 0.5, x),
                    lgvi_lie::exp(&Vector3::new(x, 0.2, 0.1)),
                    Vector3::new(0.4, x, -0.3),
                )
            });
            let fly = |level| {
                let oblate = Multipole::oblate(2.0, 0.1, 1.0);
                let mut system = System::new(
                    bodies.clone(),
                    vec![
                        Box::new(Mutual::new(1.0)),
                        Box::new(Central { gm: 1.0 }),
                        Box::new(oblate),
                    ],
                );
                let mut taylor = Taylor::new(1e-11, &system).expect("a solution");
                taylor.level = level;
                let none = [Load::default(); 2];
                taylor.start(&mut system, &states, &none).expect("a start");
                while taylor.until() < 1.0 {
                    taylor.advance(&mut system, 1.0).expect("a step");
                }
                let mut end = Vec::new();
                taylor.show(&mut system, 1.0, &mut end);
                end
            };
            let newest = fly(Level::new());
            assert_ne!(newest, states);
            assert_eq!(newest, fly(Level::baseline()));
        }
    }
}
