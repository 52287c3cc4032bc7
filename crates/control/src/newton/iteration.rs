use nalgebra::SVector;

use super::conditions::{Ending, Inequalities, Satisfied};
use super::model::{Kind, Model, ModelError};
use super::problem::{Iterate, Problem};
use super::trial::{Direction, Merit, Move, Trial, Weights};
use crate::steps::Steps;

/// The iteration at one N, with all its memory.
pub(crate) struct Newton<const X: usize, const U: usize> {
    pub(crate) model: Model<X, U>,
    direction: Direction<X, U>,
    weights: Weights<X>,
    /// Where it is.
    pub(crate) iterate: Iterate<X, U>,
    spare: Iterate<X, U>,
    third: Iterate<X, U>,
}

/// How an iteration goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tolerances {
    /// Of defects and terminal conditions.
    pub(crate) violation: f64,
    /// Of the stationarity, relative to the largest multiplier.
    pub(crate) stationarity: f64,
    /// Of both, where a full step is taken to have converged.
    pub(crate) near: f64,
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
    /// The inequalities cannot be satisfied.
    Infeasible,
    /// No step along the direction lowers the merit.
    Stuck,
    /// There is no model.
    Failed(ModelError),
}

/// Augmentations in the order of trial.
const AUGMENTATIONS: [f64; 3] = [10.0, 300.0, 1e4];
/// The least damping that is not zero, and the most.
const DAMPINGS: [f64; 2] = [1e-4, 1e8];
/// Damping of the first step from a rough start.
const BEGIN: f64 = 10.0;
/// Factors by which damping rises and falls.
const RAISE: f64 = 8.0;
const LOWER: f64 = 4.0;
/// The shortest step tried before damping rises.
const SHORTEST: f64 = 0.2;
/// Armijo's share of the predicted decrease.
const ARMIJO: f64 = 1e-4;
/// What a step between stationary iterates must leave of the violation at most.
const LEFT: f64 = 0.99;
/// Corrections of a trial's terminal miss.
const CORRECTIONS: u32 = 3;

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
            third: iterate.clone(),
            iterate,
        }
    }

    /// Iterates until within `tolerances`; a `rough` start takes its first step by Gauss and Newton, for want of
    /// multipliers, and damped.
    pub(crate) fn run<S, E, Q>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        inequalities: &mut Q,
        tolerances: &Tolerances,
        rough: bool,
        standing: &mut Standing,
        mut observe: impl FnMut(&Standing) -> bool,
    ) -> Ended
    where
        S: Steps<X, U>,
        E: Ending<X>,
        Q: Inequalities<X, U>,
    {
        let last = standing.iteration + tolerances.iterations;
        let mut kind = Kind {
            curvature: if rough { 0.0 } else { 1.0 },
            augmentation: AUGMENTATIONS[0],
            damping: if rough { BEGIN } else { 0.0 },
        };
        self.weights.defects.fill(0.0);
        self.weights.miss.fill(0.0);
        // Violation of the last iterate that was stationary.
        let mut left = f64::INFINITY;
        loop {
            if let Err(error) = self.model_convex(problem, inequalities, &mut kind) {
                return Ended::Failed(error);
            }
            let start = &mut self.model.start;
            let nu = start
                .multipliers()
                .or_else(|| start.dependent_multipliers(tolerances.violation));
            let Some(nu) = nu else {
                return Ended::Failed(ModelError::Dependent);
            };
            self.measure(problem, standing);
            if inequalities.tighten(standing.violation.max(standing.stationarity)) {
                continue;
            }
            if !observe(standing) {
                return Ended::Stopped;
            }
            let meets = standing.violation <= tolerances.violation;
            let stationary = standing.stationarity <= tolerances.stationarity;
            match inequalities.satisfied() {
                Satisfied::Yes if meets && stationary => return Ended::Converged,
                Satisfied::ToRounding if meets => return Ended::Converged,
                Satisfied::Never => return Ended::Infeasible,
                // Conditions that no command moves, to first order.
                Satisfied::Yes if stationary && standing.violation > LEFT * left => {
                    return Ended::Stuck;
                }
                _ => (),
            }
            left = if stationary {
                standing.violation
            } else {
                f64::INFINITY
            };
            if standing.iteration >= last {
                return Ended::Capped;
            }
            self.direction.solve(&self.model, nu, inequalities);
            standing.iteration += 1;
            if self.search(problem, inequalities, standing) {
                if self.is_near(tolerances, standing) && kind.damping == 0.0 {
                    let miss = self.fly_home(problem, inequalities, tolerances.violation, standing);
                    if miss <= tolerances.violation && inequalities.satisfied() == Satisfied::Yes {
                        standing.violation = miss;
                        return Ended::Converged;
                    }
                }
                kind.curvature = 1.0;
                if standing.length < 1.0 {
                    kind.damping = (kind.damping * RAISE).max(DAMPINGS[0]);
                } else {
                    kind.damping /= LOWER;
                    if kind.damping < DAMPINGS[0] {
                        kind.damping = 0.0;
                    }
                }
            } else if kind.damping < DAMPINGS[1] {
                kind.damping = (kind.damping * RAISE * RAISE).max(DAMPINGS[0] * RAISE);
            } else {
                return Ended::Stuck;
            }
        }
    }

    /// Whether the step just taken from where `standing` was must have converged, quadratically.
    fn is_near(&self, tolerances: &Tolerances, standing: &Standing) -> bool {
        let near = tolerances.near;
        standing.length == 1.0 && standing.violation <= near && standing.stationarity <= near
    }

    /// Flies the policies until the terminal miss is `wanted` or stays, and gives what it is then.
    fn fly_home<S, E, Q>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        inequalities: &Q,
        wanted: f64,
        standing: &mut Standing,
    ) -> f64
    where
        S: Steps<X, U>,
        E: Ending<X>,
        Q: Inequalities<X, U>,
    {
        let mut miss = problem
            .ending
            .residual(&self.iterate.states[problem.intervals]);
        for _ in 0..CORRECTIONS {
            if miss.norm() <= wanted {
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
                Ok(merit) if merit.miss.norm() < miss.norm() => {
                    miss = merit.miss;
                    standing.cost = merit.cost;
                    std::mem::swap(&mut self.iterate, &mut self.spare);
                }
                _ => break,
            }
        }
        miss.norm()
    }

    /// The model with as much augmentation and damping as make it convex.
    fn model_convex<S, E, Q>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        inequalities: &mut Q,
        kind: &mut Kind,
    ) -> Result<(), ModelError>
    where
        S: Steps<X, U>,
        E: Ending<X>,
        Q: Inequalities<X, U>,
    {
        loop {
            match self
                .model
                .solve(problem, inequalities, &self.iterate, *kind, |_, _, _| ())
            {
                Err(ModelError::NotConvex { stage }) => {
                    let more = AUGMENTATIONS
                        .iter()
                        .find(|&&augmentation| augmentation > kind.augmentation);
                    if let Some(&augmentation) = more {
                        kind.augmentation = augmentation;
                    } else if kind.damping < DAMPINGS[1] {
                        kind.damping = (kind.damping * RAISE).max(DAMPINGS[0]);
                    } else {
                        return Err(ModelError::NotConvex { stage });
                    }
                }
                done => return done,
            }
        }
    }

    fn measure<S, E>(&self, problem: &Problem<'_, S, E, X, U>, standing: &mut Standing) {
        let weight = problem.h * problem.weight;
        standing.cost = 0.0;
        standing.violation = self.model.miss.norm();
        for (k, command) in self.iterate.commands.iter().enumerate() {
            let gradient = weight * command;
            standing.cost += 0.5 * command.dot(&gradient);
            standing.violation = standing.violation.max(self.model.defects[k].norm());
        }
        standing.stationarity = self.model.stationarity / self.model.largest.max(f64::MIN_POSITIVE);
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
        self.reweigh(problem);
        let mut now = Merit {
            cost: standing.cost,
            objective: standing.cost,
            violation: self.weights.miss.dot(&self.model.miss.abs()),
            miss: self.model.miss,
        };
        for defect in &self.model.defects {
            now.violation += self.weights.defects.dot(&defect.abs());
        }
        for k in 0..problem.intervals {
            let (barrier, violation) = inequalities.merit(
                k,
                &self.iterate.states[k + 1],
                &self.iterate.commands[k],
                0.0,
            );
            now.objective += barrier;
            now.violation += violation;
        }
        let predicted = slope - now.violation;
        let (primal, dual) = inequalities.reach();
        let mut length = primal;
        // Below this, differences of merits are rounding.
        let rounding = 1e-10 * (now.objective.abs() + now.violation);
        while length >= SHORTEST * primal {
            let wanted = now.total() + ARMIJO * length * predicted.min(0.0) + rounding;
            if self.step(problem, inequalities, length, wanted, standing) {
                std::mem::swap(&mut self.iterate, &mut self.spare);
                inequalities.advance(length, dual);
                standing.length = length;
                return true;
            }
            length *= 0.5;
        }
        false
    }

    /// Whether a step of this length gets the merit down to `wanted`: flown, its terminal miss corrected, or straight.
    fn step<S, E, Q>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        inequalities: &Q,
        length: f64,
        wanted: f64,
        standing: &mut Standing,
    ) -> bool
    where
        S: Steps<X, U>,
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

    /// Weights of the merit that exceed the multipliers, those there are and those the direction calls for, so that it
    /// descends.
    fn reweigh<S, E: Ending<X>>(&mut self, problem: &Problem<'_, S, E, X, U>) {
        let end = &self.iterate.states[problem.intervals];
        let mut costate = problem.ending.jacobian(end).tr_mul(&self.direction.nu);
        let mut largest = SVector::<f64, X>::zeros();
        for k in (0..problem.intervals).rev() {
            largest = largest.sup(&self.model.costates[k].abs().sup(&costate.abs()));
            costate = self.model.dynamics[k].a.tr_mul(&costate);
        }
        self.weights.defects = (0.5 * self.weights.defects).sup(&(2.0 * largest));
        let nu = self.direction.nu.abs().sup(&self.iterate.nu.abs());
        self.weights.miss = (0.5 * self.weights.miss).sup(&(2.0 * nu));
    }
}
