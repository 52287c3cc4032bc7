//! The last steps of the iteration, which reuse one model for several steps.

use super::conditions::{Ending, Inequalities};
use super::iteration::{Ended, Newton, Standing, Tolerances};
use super::problem::Problem;
use super::search::CORRECTIONS;
use super::trial::{Move, Trial};
use crate::discrete::DiscreteDynamics;

/// The largest relative error that a reused model corrects, and the factor by which each step must reduce the error.
const FOLLOWED: f64 = 0.02;
const FALL: f64 = 0.2;
/// The error after a step, in multiples of the product of the errors before it and of the model.
const USUAL: f64 = 0.01;
/// Expected error after a step of the same model, in parts of the tolerance, below which no further step is prepared.
const CERTAIN: f64 = 0.1;

impl<const X: usize, const U: usize> Newton<X, U> {
    /// Continues with the existing model and its old second derivatives (the chord method) as long as this converges
    /// fast. Returns `None` when it does not.
    pub(super) fn follow<S, E, Q>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        inequalities: &mut Q,
        tolerances: &Tolerances,
        last: u32,
        standing: &mut Standing,
        observe: &mut impl FnMut(&Standing) -> bool,
    ) -> Option<Ended>
    where
        S: DiscreteDynamics<X, U>,
        E: Ending<X>,
        Q: Inequalities<X, U>,
    {
        let mut error = FOLLOWED;
        let mut first = true;
        let own = standing.stationarity;
        loop {
            let expected = USUAL * own * standing.stationarity / tolerances.stationarity;
            // Before what is probably the last look at this iterate.
            if expected <= 1.0 {
                self.fly_home(problem, inequalities, tolerances.violation, standing);
            }
            let correct = first || expected > CERTAIN;
            let mut change = self.model.follow(problem, &self.iterate, correct).ok()?;
            self.measure(problem, standing);
            let found = standing.violation.max(standing.stationarity);
            let missed = self.model.defects.iter().any(|d| d.amax() > 0.0);
            if found.is_nan() || found > error || missed {
                return None;
            }
            if standing.stationarity <= tolerances.stationarity {
                self.followed = self.model.terminal(&self.model.miss) <= tolerances.violation;
                let miss = self.fly_home(problem, inequalities, tolerances.violation, standing);
                if miss <= tolerances.violation {
                    standing.violation = miss;
                    return Some(Ended::Converged);
                }
                return None;
            }
            if standing.iteration >= last {
                return None;
            }
            if !observe(standing) {
                return Some(Ended::Stopped);
            }
            error = FALL * found;
            first = false;
            if !correct {
                change = self.model.follow(problem, &self.iterate, true).ok()?;
            }
            standing.iteration += 1;
            standing.trials += 1;
            let trial = Trial {
                problem,
                inequalities: &*inequalities,
                model: &self.model,
                weights: &self.weights,
                length: 1.0,
            };
            let step = Move::Policies(change);
            trial.make(step, &self.iterate, &mut self.spare).ok()?;
            std::mem::swap(&mut self.iterate, &mut self.spare);
        }
    }

    /// Flies the policies until the terminal miss is at most `wanted` or no longer decreases. Returns the final miss.
    pub(super) fn fly_home<S, E, Q>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        inequalities: &Q,
        wanted: f64,
        standing: &mut Standing,
    ) -> f64
    where
        S: DiscreteDynamics<X, U>,
        E: Ending<X>,
        Q: Inequalities<X, U>,
    {
        let mut miss = problem
            .ending
            .residual(&self.iterate.states[problem.intervals]);
        for _ in 0..CORRECTIONS {
            if self.model.terminal(&miss) <= wanted {
                break;
            }
            let trial = Trial {
                problem,
                inequalities,
                model: &self.model,
                weights: &self.weights,
                length: 1.0,
            };
            let Some(nu) = self.model.start.correction(&miss) else {
                break;
            };
            standing.trials += 1;
            match trial.make(Move::Conditions(nu), &self.iterate, &mut self.spare) {
                Ok(merit) if self.model.terminal(&merit.miss) < self.model.terminal(&miss) => {
                    miss = merit.miss;
                    standing.cost = merit.cost;
                    std::mem::swap(&mut self.iterate, &mut self.spare);
                }
                _ => break,
            }
        }
        self.model.terminal(&miss)
    }
}
