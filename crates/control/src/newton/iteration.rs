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
/// The shortest step tried.
const SHORTEST: f64 = 0.2;
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
            third: iterate.clone(),
            iterate,
        }
    }

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
        let first = standing.iteration;
        let env = |name: &str, default: f64| std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default);
        let blend = env("BLEND", 0.0) > 0.0;
        let raise = env("RAISE", 8.0);
        let lower = env("LOWER", 4.0);
        let mut augmentation = 0;
        let mut damping = if rough { env("DAMP0", 0.0) } else { 0.0 };
        let mut newton = !rough || env("GN0", 1.0) == 0.0;
        self.weights.defects.fill(0.0);
        self.weights.miss.fill(0.0);
        let mut sweeps = 0;
        loop {
            let kind = loop {
                let kind = Kind {
                    curvature: if newton { 1.0 } else { 0.0 },
                    augmentation: AUGMENTATIONS[augmentation],
                    damping,
                };
                sweeps += 1;
                match self.model.solve(problem, inequalities, &self.iterate, kind) {
                    Ok(()) => break kind,
                    Err(ModelError::NotConvex { stage }) => {
                        if std::env::var("LGVI_DEBUG").is_ok() { eprintln!("not convex {kind:?} at {stage}"); }
                        if augmentation + 1 < AUGMENTATIONS.len() { augmentation += 1; }
                        else if blend && newton { newton = false; augmentation = 0; }
                        else if damping < DAMPINGS[1] { damping = (damping * raise).max(DAMPINGS[0]); }
                        else { return Ended::Failed(ModelError::NotConvex { stage }); }
                    }
                    Err(error) => return Ended::Failed(error),
                }
            };
            standing.curvature = kind.curvature;
            let Some(nu) = self.model.start.multipliers() else {
                return Ended::Failed(ModelError::Dependent);
            };
            self.measure(problem, standing);
            if inequalities.tighten(standing.violation.max(standing.stationarity)) {
                continue;
            }
            if std::env::var("LGVI_DEBUG").is_ok() { eprintln!("{:?} sweeps {sweeps} viol {:.3e} stat {:.3e} cost {:.10} len {}", kind, standing.violation, standing.stationarity, standing.cost, standing.length); }
            if !observe(standing) {
                return Ended::Stopped;
            }
            if standing.violation <= tolerances.violation
                && standing.stationarity <= tolerances.stationarity
            {
                match inequalities.satisfied() {
                    Satisfied::Yes => return Ended::Converged,
                    Satisfied::Never => return Ended::Infeasible,
                    Satisfied::NotYet => (),
                }
            }
            if standing.iteration - first >= tolerances.iterations {
                return Ended::Capped;
            }
            self.direction.solve(&self.model, nu, inequalities);
            standing.iteration += 1;
            if self.search(problem, inequalities, standing) {
                if standing.length < 1.0 { damping = (damping * raise).max(DAMPINGS[0]); }
                else { damping /= lower; if damping < DAMPINGS[0] { damping = 0.0; } }
                newton = true;
            } else if damping < DAMPINGS[1] {
                damping = (damping * raise * raise).max(DAMPINGS[0] * raise);
            } else {
                return Ended::Stuck;
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
        standing.stationarity = if self.model.stationarity == 0.0 {
            0.0
        } else {
            self.model.stationarity / self.model.largest.max(f64::MIN_POSITIVE)
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
        let corrections = std::env::var("SOC").ok().and_then(|v| v.parse().ok()).unwrap_or(2);
        loop {
            let trial = Trial {
                problem,
                inequalities: &*inequalities,
                model: &self.model,
                weights: &self.weights,
                length,
            };
            let wanted = now.total() + ARMIJO * length * predicted.min(0.0) + rounding;
            let mut accepted = false;
            standing.trials += 1;
            let flown = trial.make(Move::Flown(&self.direction, length), &self.iterate, &mut self.spare);
            if let Ok(mut merit) = flown {
                accepted = merit.total() <= wanted;
                for _ in 0..corrections {
                    if accepted { break; }
                    let Some(nu) = self.model.start.correction(&(merit.miss - (1.0 - length) * now.miss)) else { break };
                    standing.trials += 1;
                    let Ok(better) = trial.make(Move::Conditions(nu), &self.spare, &mut self.third) else { break };
                    if better.total() >= merit.total() { break; }
                    merit = better;
                    std::mem::swap(&mut self.spare, &mut self.third);
                    accepted = merit.total() <= wanted;
                }
            }
            if !accepted {
                standing.trials += 1;
                let straight = trial.make(Move::Straight(&self.direction, length), &self.iterate, &mut self.spare);
                accepted = straight.is_ok_and(|merit| merit.total() <= wanted);
            }
            if accepted {
                std::mem::swap(&mut self.iterate, &mut self.spare);
                inequalities.advance(length, dual);
                standing.length = length;
                return true;
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
