use nalgebra::SVector;

use super::conditions::{Ending, Inequalities, Satisfied};
use super::model::{Kind, Model, ModelError};
use super::problem::{Iterate, Problem};
use super::trial::{Direction, Weights};
use crate::steps::Steps;

/// The iteration at one N, with all its memory.
pub(crate) struct Newton<const X: usize, const U: usize> {
    pub(crate) model: Model<X, U>,
    /// The error where the model was made, if it is exact and has gains.
    pub(crate) solved_at: f64,
    pub(super) direction: Direction<X, U>,
    pub(super) weights: Weights<X>,
    /// Where it is.
    pub(crate) iterate: Iterate<X, U>,
    pub(super) spare: Iterate<X, U>,
    pub(super) third: Iterate<X, U>,
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

/// Augmentations in the order of trial: a slender axis is less stiff than others by the square of the inertia.
const AUGMENTATIONS: [f64; 5] = [10.0, 300.0, 1e4, 1e6, 1e8];
/// The least damping that is not zero, and the most.
const DAMPINGS: [f64; 2] = [1e-7, 1e8];
/// Damping of the first step from a rough start.
const BEGIN: f64 = 10.0;
/// Factors by which damping rises and falls.
const RAISE: f64 = 8.0;
const LOWER: f64 = 4.0;
/// What a step between stationary iterates must leave of the violation at most.
const LEFT: f64 = 0.99;
/// Stationarity from which a full step may lead to where the same model is good for more.
const CLOSE: f64 = 2e-3;

impl<const X: usize, const U: usize> Newton<X, U> {
    pub(crate) fn new(intervals: usize, iterate: Iterate<X, U>) -> Self {
        Self {
            model: Model::new(intervals),
            solved_at: f64::INFINITY,
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
        let begun = standing.iteration;
        let last = begun + tolerances.iterations;
        let mut kind = Kind {
            curvature: if rough { 0.0 } else { 1.0 },
            augmentation: AUGMENTATIONS[0],
            damping: if rough { BEGIN } else { 0.0 },
            gains: begun == 0 && !rough,
        };
        self.weights.defects.fill(0.0);
        self.weights.miss.fill(0.0);
        // Violation of the last iterate that was stationary, by the same barrier.
        let mut left = f64::INFINITY;
        let mut tightened = false;
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
            let exact = kind.curvature == 1.0 && kind.damping == 0.0;
            self.solved_at = if exact && kind.gains {
                standing.violation.max(standing.stationarity)
            } else {
                f64::INFINITY
            };
            if inequalities.tighten(standing.violation.max(standing.stationarity)) {
                tightened = true;
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
            left = if stationary && !tightened {
                standing.violation
            } else {
                f64::INFINITY
            };
            tightened = false;
            if standing.iteration >= last {
                return Ended::Capped;
            }
            let whole = SVector::zeros();
            self.direction.solve(&self.model, nu, &whole, inequalities);
            standing.iteration += 1;
            let close = standing.stationarity <= CLOSE;
            if self.search(problem, inequalities, standing) {
                if self.is_near(tolerances, standing) && kind.damping == 0.0 {
                    let miss = self.fly_home(problem, inequalities, tolerances.violation, standing);
                    if miss <= tolerances.violation && inequalities.satisfied() == Satisfied::Yes {
                        standing.violation = miss;
                        return Ended::Converged;
                    }
                } else if Q::NONE && exact && close && standing.length == 1.0 {
                    let followed = self.follow(
                        problem,
                        inequalities,
                        tolerances,
                        last,
                        standing,
                        &mut observe,
                    );
                    if let Some(ended) = followed {
                        return ended;
                    }
                }
                kind.curvature = 1.0;
                // Those of a level's first model, made far from where it leads, are of no use.
                kind.gains = true;
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

    /// The model with as much augmentation as makes it convex, or that of Gauss and Newton, damped if it must be.
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
                .solve(problem, inequalities, &self.iterate, *kind)
            {
                Err(ModelError::NotConvex { stage }) => {
                    let more = AUGMENTATIONS
                        .iter()
                        .find(|&&augmentation| augmentation > kind.augmentation);
                    if let Some(&augmentation) = more {
                        kind.augmentation = augmentation;
                    } else if kind.curvature > 0.0 {
                        kind.curvature = 0.0;
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

    pub(super) fn measure<S, E>(&self, problem: &Problem<'_, S, E, X, U>, standing: &mut Standing) {
        let weight = problem.h * problem.weight;
        standing.cost = 0.0;
        standing.violation = self.model.terminal(&self.model.miss);
        for (k, command) in self.iterate.commands.iter().enumerate() {
            let gradient = weight * command;
            standing.cost += 0.5 * command.dot(&gradient);
            standing.violation = standing.violation.max(self.model.defects[k].norm());
        }
        standing.stationarity = self.model.stationarity / self.model.largest.max(f64::MIN_POSITIVE);
    }
}
