//! Line search along a direction.

use nalgebra::SVector;

use super::conditions::{Ending, Inequalities};
use super::iteration::{Newton, Standing};
use super::problem::Problem;
use super::trial::{Merit, Move, Trial};
use crate::discrete::DiscreteDynamics;

/// The shortest step tried before the damping is raised.
const SHORTEST: f64 = 0.2;
/// Armijo's fraction of the predicted decrease.
const ARMIJO: f64 = 1e-4;
/// Maximum number of corrections of a trial's terminal miss.
pub(super) const CORRECTIONS: u32 = 3;

impl<const X: usize, const U: usize> Newton<X, U> {
    pub(super) fn search<S, E, Q>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        inequalities: &mut Q,
        standing: &mut Standing,
    ) -> bool
    where
        S: DiscreteDynamics<X, U>,
        E: Ending<X>,
        Q: Inequalities<X, U>,
    {
        let step = |newton: &mut Self,
                    inequalities: &mut Q,
                    standing: &mut Standing,
                    [length, wanted]: [f64; 2]| {
            newton.step(problem, inequalities, length, wanted, standing)
        };
        self.search_by(problem, inequalities, standing, [0.0; 2], step)
    }

    /// Tries shorter and shorter steps until `step` succeeds, which takes a length and the merit that is wanted. The merit contains
    /// something `beside` the cost of the commands and the inequalities: its value and its slope.
    pub(crate) fn search_by<S, E, Q>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        inequalities: &mut Q,
        standing: &mut Standing,
        [beside, slope_beside]: [f64; 2],
        mut step: impl FnMut(&mut Self, &mut Q, &mut Standing, [f64; 2]) -> bool,
    ) -> bool
    where
        S: DiscreteDynamics<X, U>,
        E: Ending<X>,
        Q: Inequalities<X, U>,
    {
        let weight = problem.h * problem.weight;
        let mut slope = inequalities.slope() + slope_beside;
        for (command, v) in self.iterate.commands.iter().zip(&self.direction.commands) {
            slope += v.dot(&(weight * command));
        }
        self.reweigh(problem);
        let mut now = Merit {
            cost: standing.cost,
            objective: standing.cost + beside,
            violation: self.weights.miss.dot(&self.model.miss.abs()),
            miss: self.model.miss,
        };
        for defect in &self.model.defects {
            now.violation += self.weights.defects.dot(&defect.abs());
        }
        for k in 0..problem.intervals {
            let ends = [k, k + 1].map(|end| &self.iterate.states[end]);
            now.objective += inequalities.merit(k, ends, &self.iterate.commands[k]);
        }
        let predicted = slope - now.violation;
        let reach = inequalities.reach();
        let room = inequalities.room();
        let mut length = room;
        // Differences of merits below this are rounding.
        let rounding = 1e-10 * (now.objective.abs() + now.violation);
        while length >= SHORTEST * room {
            let wanted = now.total() + ARMIJO * length * predicted.min(0.0) + rounding;
            if step(self, inequalities, standing, [length, wanted]) {
                std::mem::swap(&mut self.iterate, &mut self.spare);
                inequalities.advance(reach);
                standing.length = length;
                standing.cut = length < room;
                return true;
            }
            length *= 0.5;
        }
        false
    }

    /// Tries a step of this length, flown first, then with its terminal miss corrected, then straight. Returns true if
    /// the merit falls to `wanted`.
    pub(crate) fn step<S, E, Q>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        inequalities: &Q,
        length: f64,
        wanted: f64,
        standing: &mut Standing,
    ) -> bool
    where
        S: DiscreteDynamics<X, U>,
        E: Ending<X>,
        Q: Inequalities<X, U>,
    {
        let trial = Trial {
            problem,
            inequalities,
            model: &self.model,
            weights: &self.weights,
            length,
        };
        standing.trials += 1;
        let flown = Move::Flown(&self.direction, length);
        if let Ok(mut merit) = trial.make(flown, &self.iterate, &mut self.spare) {
            for _ in 0..CORRECTIONS {
                if merit.total() <= wanted {
                    return true;
                }
                let excess = merit.miss - (1.0 - length) * self.model.miss;
                let Some(nu) = self.model.start.correction(&excess) else {
                    break;
                };
                standing.trials += 1;
                match trial.make(Move::Conditions(nu), &self.spare, &mut self.third) {
                    Ok(corrected) if corrected.total() < merit.total() => merit = corrected,
                    _ => break,
                }
                std::mem::swap(&mut self.spare, &mut self.third);
            }
            if merit.total() <= wanted {
                return true;
            }
        }
        standing.trials += 1;
        let straight = Move::Straight(&self.direction, length);
        trial
            .make(straight, &self.iterate, &mut self.spare)
            .is_ok_and(|merit| merit.total() <= wanted)
    }

    /// Sets weights of the merit that exceed the current multipliers and those of the direction, so that the direction
    /// is a descent direction.
    fn reweigh<S, E: Ending<X>>(&mut self, problem: &Problem<'_, S, E, X, U>) {
        let end = &self.iterate.states[problem.intervals];
        let mut costate = problem.ending.jacobian(end).tr_mul(&self.direction.nu);
        let mut largest = SVector::<f64, X>::zeros();
        for k in (0..problem.intervals).rev() {
            largest = largest.sup(&self.model.costates[k].abs().sup(&costate.abs()));
            (costate, _) = self.model.dynamics[k].backward(&self.model.inputs, &costate);
        }
        self.weights.defects = (0.5 * self.weights.defects).sup(&(2.0 * largest));
        let nu = self.direction.nu.abs().sup(&self.iterate.nu.abs());
        self.weights.miss = (0.5 * self.weights.miss).sup(&(2.0 * nu));
    }
}
