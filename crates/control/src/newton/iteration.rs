use nalgebra::SVector;

use super::conditions::{Ending, Inequalities};
use super::model::{Kind, Model, ModelError};
use super::problem::{Iterate, Problem};
use super::trial::{Direction, Merit, Path, Weights, trial};
use crate::steps::Steps;

/// The iteration at one N, with all its memory.
pub(crate) struct Newton<const X: usize, const U: usize> {
    pub(crate) model: Model<X, U>,
    direction: Direction<X, U>,
    weights: Weights<X>,
    /// Where it is.
    pub(crate) iterate: Iterate<X, U>,
    spare: Iterate<X, U>,
}

/// How an iteration goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tolerances {
    /// Of defects and terminal conditions.
    pub(crate) violation: f64,
    /// Of the stationarity, relative to the largest multiplier.
    pub(crate) stationarity: f64,
    /// Newton steps at most.
    pub(crate) iterations: u32,
}

/// Where an iteration stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Standing {
    /// Newton steps so far.
    pub(crate) iteration: u32,
    /// Trial points so far.
    pub(crate) trials: u32,
    /// Length of the last step.
    pub(crate) length: f64,
    /// Share of the second derivatives in the last model.
    pub(crate) curvature: f64,
    /// Largest norm of defects and terminal conditions.
    pub(crate) violation: f64,
    /// Largest component of the Lagrangian's gradient by commands, relative to the largest term.
    pub(crate) stationarity: f64,
    /// `J`
    pub(crate) cost: f64,
}

impl Default for Standing {
    fn default() -> Self {
        Self {
            iteration: 0,
            trials: 0,
            length: 1.0,
            curvature: 0.0,
            violation: f64::INFINITY,
            stationarity: f64::INFINITY,
            cost: 0.0,
        }
    }
}

/// How it ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Ended {
    /// Within the tolerances.
    Converged,
    /// The caller asked to stop.
    Stopped,
    /// At the cap.
    Capped,
    /// No step along the direction lowers the merit.
    Stuck,
    /// There is no model.
    Failed(ModelError),
}

/// Models, from Newton's to that of Gauss and Newton, in the order of trial.
const KINDS: [Kind; 5] = [
    Kind {
        curvature: 1.0,
        augmentation: 10.0,
    },
    Kind {
        curvature: 1.0,
        augmentation: 300.0,
    },
    Kind {
        curvature: 1.0,
        augmentation: 1e4,
    },
    Kind {
        curvature: 0.5,
        augmentation: 300.0,
    },
    Kind {
        curvature: 0.0,
        augmentation: 10.0,
    },
];
/// The shortest step tried.
const SHORTEST: f64 = 1e-4;
/// Armijo's share of the predicted decrease.
const ARMIJO: f64 = 1e-4;

impl<const X: usize, const U: usize> Newton<X, U> {
    pub(crate) fn new(intervals: usize, iterate: Iterate<X, U>) -> Self {
        Self {
            model: Model::new(intervals),
            direction: Direction::new(intervals),
            weights: Weights {
                defects: SVector::zeros(),
                miss: SVector::zeros(),
            },
            spare: iterate.clone(),
            iterate,
        }
    }

    pub(crate) fn run<S, E, Q>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        inequalities: &mut Q,
        tolerances: &Tolerances,
        first_kind: usize,
        standing: &mut Standing,
        mut observe: impl FnMut(&Standing) -> bool,
    ) -> Ended
    where
        S: Steps<X, U>,
        E: Ending<X>,
        Q: Inequalities<X, U>,
    {
        let first = standing.iteration;
        let mut choice = first_kind;
        self.weights.defects.fill(0.0);
        self.weights.miss.fill(0.0);
        loop {
            // The most of the second derivatives that leaves the model convex.
            loop {
                let kind = KINDS[choice];
                standing.curvature = kind.curvature;
                match self
                    .model
                    .solve(problem, inequalities, &self.iterate, kind)
                {
                    Ok(()) => break,
                    Err(ModelError::NotConvex { stage }) if choice + 1 < KINDS.len() => {
                        if std::env::var("LGVI_DEBUG").is_ok() { eprintln!("not convex {kind:?} at {stage}"); }
                        choice += 1
                    }
                    Err(error) => return Ended::Failed(error),
                }
            }
            let Some(nu) = self.model.start.multipliers() else {
                return Ended::Failed(ModelError::Dependent);
            };
            self.measure(problem, standing);
            if std::env::var("LGVI_DEBUG").is_ok() { eprintln!("{:?} viol {:.3e} stat {:.3e} cost {:.10} len {}", KINDS[choice], standing.violation, standing.stationarity, standing.cost, standing.length); }
            if !observe(standing) {
                return Ended::Stopped;
            }
            if standing.violation <= tolerances.violation
                && standing.stationarity <= tolerances.stationarity
            {
                return Ended::Converged;
            }
            if standing.iteration - first >= tolerances.iterations {
                return Ended::Capped;
            }
            self.direction.solve(&self.model, nu, inequalities);
            if !self.search(problem, inequalities, standing) {
                return Ended::Stuck;
            }
            standing.iteration += 1;
            choice = if choice < 3 { choice } else { 0 };
        }
    }

    fn measure<S, E>(&self, problem: &Problem<'_, S, E, X, U>, standing: &mut Standing) {
        let weight = problem.h * problem.weight;
        let mut largest = 0.0_f64;
        standing.cost = 0.0;
        standing.violation = self.model.miss.norm();
        for (k, command) in self.iterate.commands.iter().enumerate() {
            let gradient = weight * command;
            standing.cost += 0.5 * command.dot(&gradient);
            largest = largest.max(gradient.amax());
            standing.violation = standing.violation.max(self.model.defects[k].norm());
        }
        standing.stationarity = if self.model.stationarity == 0.0 {
            0.0
        } else {
            self.model.stationarity / largest.max(f64::MIN_POSITIVE)
        };
    }

    fn search<S, E, Q>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        inequalities: &mut Q,
        standing: &mut Standing,
    ) -> bool
    where
        S: Steps<X, U>,
        E: Ending<X>,
        Q: Inequalities<X, U>,
    {
        let weight = problem.h * problem.weight;
        let mut slope = inequalities.slope();
        for (command, v) in self.iterate.commands.iter().zip(&self.direction.commands) {
            slope += v.dot(&(weight * command));
        }
        self.reweigh();
        let mut now = Merit {
            cost: standing.cost,
            objective: standing.cost,
            violation: self.weights.miss.dot(&self.model.miss.abs()),
            defect: 0.0,
            miss: 0.0,
        };
        for defect in &self.model.defects {
            now.violation += self.weights.defects.dot(&defect.abs());
        }
        for k in 0..problem.intervals {
            let (barrier, violation) =
                inequalities.merit(k, &self.iterate.states[k + 1], &self.iterate.commands[k], 0.0);
            now.objective += barrier;
            now.violation += violation;
        }
        let predicted = slope - now.violation;
        let (primal, dual) = inequalities.reach();
        let mut length = primal;
        // Below this, differences of merits are rounding.
        let rounding = 1e-10 * (now.objective.abs() + now.violation);
        loop {
            for path in [Path::Flown, Path::Straight] {
                standing.trials += 1;
                let merit = trial(
                    problem,
                    inequalities,
                    &self.model,
                    &self.direction,
                    &self.weights,
                    &self.iterate,
                    path,
                    length,
                    &mut self.spare,
                );
                let Ok(merit) = merit else { continue };
                let wanted = now.total() + ARMIJO * length * predicted.min(0.0) + rounding;
                if merit.total() <= wanted {
                    std::mem::swap(&mut self.iterate, &mut self.spare);
                    inequalities.advance(length, dual);
                    standing.length = length;
                    return true;
                }
            }
            length *= 0.5;
            if length < SHORTEST {
                return false;
            }
        }
    }

    /// Weights of the merit that exceed the multipliers, so that the direction descends.
    fn reweigh(&mut self) {
        let mut largest = SVector::<f64, X>::zeros();
        for costate in &self.model.costates {
            largest = largest.sup(&costate.abs());
        }
        self.weights.defects = (0.5 * self.weights.defects).sup(&(2.0 * largest));
        let nu = self.direction.nu.abs().sup(&self.iterate.nu.abs());
        self.weights.miss = (0.5 * self.weights.miss).sup(&(2.0 * nu));
    }
}
