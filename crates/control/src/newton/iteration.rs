use nalgebra::SVector;

use super::conditions::{Ending, Inequalities, Satisfied};
use super::model::{Model, ModelError, ModelSettings};
use super::problem::{Iterate, Problem};
use super::trial::{Direction, Weights};
use crate::discrete::DiscreteDynamics;

/// The Newton iteration for one N, with all its buffers.
pub(crate) struct Newton<const X: usize, const U: usize> {
    pub(crate) model: Model<X, U>,
    /// The error at the point where the model was made, if the model is exact and has gains and the conditions are
    /// independent; otherwise infinite.
    pub(crate) solved_at: f64,
    /// True if the model's first derivatives, costates and errors are those of the current iterate.
    pub(crate) followed: bool,
    /// The augmentation of the last model.
    pub(crate) augmentation: f64,
    pub(super) direction: Direction<X, U>,
    pub(super) weights: Weights<X>,
    /// The current iterate.
    pub(crate) iterate: Iterate<X, U>,
    pub(super) spare: Iterate<X, U>,
    pub(super) third: Iterate<X, U>,
}

/// Settings of an iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tolerances {
    /// Tolerance of defects and terminal conditions.
    pub(crate) violation: f64,
    /// Tolerance of the stationarity, relative to the largest multiplier.
    pub(crate) stationarity: f64,
    /// Error below which a full step from there is assumed to converge.
    pub(crate) near: f64,
    /// Maximum number of Newton steps.
    pub(crate) iterations: u32,
    /// True if the step of the last model is taken although the tolerances are met.
    pub(crate) beyond: bool,
}

/// How close an initial guess is to the solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Closeness {
    /// A path without multipliers.
    Rough,
    /// The solution of another problem or at another resolution.
    Far,
    /// So close that the gains of the first model may be those of the solution.
    Close {
        /// The augmentation to begin with.
        augmentation: f64,
    },
}

/// Current state of an iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Standing {
    /// Newton steps so far.
    pub(crate) iteration: u32,
    /// Trial points so far.
    pub(crate) trials: u32,
    /// Length of the last step.
    pub(crate) length: f64,
    /// True if the last step is shorter than the longest that was tried.
    pub(crate) cut: bool,
    /// Share of the second derivatives in the last model.
    pub(crate) curvature: f64,
    /// Largest norm of defects and terminal conditions.
    pub(crate) violation: f64,
    /// Largest component of the gradient of the Lagrangian by commands, relative to the largest term.
    pub(crate) stationarity: f64,
    /// The quadratic cost.
    pub(crate) cost: f64,
    /// The cost beside it.
    pub(crate) fuel: f64,
}

impl Default for Standing {
    fn default() -> Self {
        Self {
            iteration: 0,
            trials: 0,
            length: 1.0,
            cut: false,
            curvature: 0.0,
            violation: f64::INFINITY,
            stationarity: f64::INFINITY,
            cost: 0.0,
            fuel: 0.0,
        }
    }
}

/// The way an iteration ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Ended {
    /// The tolerances are met.
    Converged,
    /// The caller asked to stop.
    Stopped,
    /// The maximum number of Newton steps was reached.
    Capped,
    /// The inequalities cannot be satisfied.
    Infeasible,
    /// No step along the direction lowers the merit.
    Stuck,
    /// The model could not be built or solved.
    Failed(ModelError),
}

/// Augmentations in the order of trial. A slender axis is less stiff than the others by the square of the ratio of
/// inertias.
pub(crate) const AUGMENTATIONS: [f64; 5] = [10.0, 300.0, 1e4, 1e6, 1e8];
/// The least nonzero damping, and the largest.
const DAMPINGS: [f64; 2] = [1e-7, 1e8];
/// Damping of the first step from a rough guess.
const BEGIN: f64 = 10.0;
/// Factors by which the damping is raised and lowered.
const RAISE: f64 = 8.0;
const LOWER: f64 = 4.0;
/// A step between stationary iterates must reduce the violation at least by this factor.
const LEFT: f64 = 0.99;
/// Relative error below which the next step changes gains and condition by one percent at most, which is less than the
/// accuracy that feedback needs. Convexity with the margin of the pivots survives these steps.
pub(crate) const REUSED: f64 = 2e-3;
/// Stationarity of the later stages above which the whole is not expected to be below [`REUSED`].
const WORTHLESS: f64 = 2.0 * REUSED;
/// Stationarity below which a model may be reused after a full step.
const CLOSE: f64 = REUSED;

impl ModelSettings {
    /// Damps more after a step that was cut, and less after one that was not.
    pub(crate) fn damp_after(&mut self, standing: &Standing) {
        if standing.cut {
            self.damping = (self.damping * RAISE).max(DAMPINGS[0]);
        } else {
            self.damping /= LOWER;
            if self.damping < DAMPINGS[0] {
                self.damping = 0.0;
            }
        }
    }

    /// Damps more after no step was found. Returns false if that is no use.
    pub(crate) fn damp_more(&mut self) -> bool {
        let more = self.damping < DAMPINGS[1];
        if more {
            self.damping = (self.damping * RAISE * RAISE).max(DAMPINGS[0] * RAISE);
        }
        more
    }
}

impl<const X: usize, const U: usize> Newton<X, U> {
    pub(crate) fn new(intervals: usize, iterate: Iterate<X, U>) -> Self {
        Self::with_model(Model::new(intervals), iterate)
    }

    pub(super) fn with_model(model: Model<X, U>, iterate: Iterate<X, U>) -> Self {
        let intervals = model.policies.len();
        Self {
            model,
            solved_at: f64::INFINITY,
            followed: false,
            augmentation: AUGMENTATIONS[0],
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

    /// Iterates until `tolerances` are met. From a rough guess, the first step is a damped Gauss–Newton step.
    pub(crate) fn run<S, E, Q>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        inequalities: &mut Q,
        tolerances: &Tolerances,
        guess: Closeness,
        standing: &mut Standing,
        mut observe: impl FnMut(&Standing) -> bool,
    ) -> Ended
    where
        S: DiscreteDynamics<X, U>,
        E: Ending<X>,
        Q: Inequalities<X, U>,
    {
        let commands = self.iterate.commands.iter_mut();
        for (command, off) in commands.zip(problem.steps.off()) {
            off.clear(command);
        }
        let begun = standing.iteration;
        let last = begun + tolerances.iterations;
        let (augmentation, gains) = match guess {
            Closeness::Close { augmentation } => (augmentation, Some(WORTHLESS)),
            _ => (AUGMENTATIONS[0], None),
        };
        let rough = guess == Closeness::Rough;
        let mut settings = ModelSettings {
            curvature: if rough { 0.0 } else { 1.0 },
            augmentation,
            damping: if rough { BEGIN } else { 0.0 },
            gains,
        };
        self.weights.defects.fill(0.0);
        self.weights.miss.fill(0.0);
        // Violation of the last stationary iterate with the same barrier parameter.
        let mut left = f64::INFINITY;
        let mut tightened = false;
        self.followed = false;
        loop {
            if let Err(error) = self.model_convex(problem, inequalities, &mut settings) {
                return Ended::Failed(error);
            }
            let start = &mut self.model.start;
            let nu = start.multipliers();
            let independent = nu.is_some();
            let nu = nu.or_else(|| start.dependent_multipliers(tolerances.violation));
            let Some(nu) = nu else {
                return Ended::Failed(ModelError::Dependent);
            };
            self.augmentation = settings.augmentation;
            self.measure(problem, standing);
            standing.fuel = inequalities.cost();
            let exact = settings.curvature == 1.0 && settings.damping == 0.0;
            self.solved_at = if exact && independent && self.model.has_gains {
                standing.violation.max(standing.stationarity)
            } else {
                f64::INFINITY
            };
            if inequalities.tighten(standing.violation.max(standing.stationarity)) {
                tightened = true;
                // The cost of fuel is flat, and rounding errors grow with the augmentation.
                if standing.fuel > 0.0 {
                    settings.augmentation = augmentation;
                }
                continue;
            }
            if !observe(standing) {
                return Ended::Stopped;
            }
            let meets = standing.violation <= tolerances.violation;
            let stationary = standing.stationarity <= tolerances.stationarity;
            match inequalities.satisfied() {
                Satisfied::Yes if meets && stationary => {
                    if tolerances.beyond {
                        self.direction
                            .solve(&self.model, nu, &SVector::zeros(), inequalities);
                        self.search(problem, inequalities, standing);
                    }
                    return Ended::Converged;
                }
                Satisfied::ToRounding if meets => return Ended::Converged,
                Satisfied::ToRounding => {
                    let miss = self.fly_home(problem, inequalities, tolerances.violation, standing);
                    if miss <= tolerances.violation {
                        standing.violation = miss;
                        return Ended::Converged;
                    }
                    if standing.iteration >= last {
                        return Ended::Capped;
                    }
                    if miss < self.model.terminal(&self.model.miss) {
                        standing.iteration += 1;
                        continue;
                    }
                }
                Satisfied::Never => return Ended::Infeasible,
                // The commands do not change these conditions to first order.
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
                if Q::NONE && exact && close && standing.length == 1.0 {
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
                } else if self.is_near(tolerances, standing) && settings.damping == 0.0 {
                    let miss = self.fly_home(problem, inequalities, tolerances.violation, standing);
                    if miss <= tolerances.violation && inequalities.satisfied() == Satisfied::Yes {
                        standing.violation = miss;
                        return Ended::Converged;
                    }
                }
                settings.curvature = 1.0;
                settings.gains = Some(f64::INFINITY);
                settings.damp_after(standing);
            } else if !settings.damp_more() {
                return Ended::Stuck;
            }
        }
    }

    /// Returns true if the step just taken was full and started so close that it must have converged quadratically.
    /// `standing` holds the errors before that step.
    fn is_near(&self, tolerances: &Tolerances, standing: &Standing) -> bool {
        let near = tolerances.near;
        standing.length == 1.0 && standing.violation <= near && standing.stationarity <= near
    }

    /// Solves the exact model with as much augmentation as makes it convex. If that fails, solves the Gauss–Newton
    /// model, damped if necessary.
    pub(crate) fn model_convex<S, E, Q>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        inequalities: &mut Q,
        settings: &mut ModelSettings,
    ) -> Result<(), ModelError>
    where
        S: DiscreteDynamics<X, U>,
        E: Ending<X>,
        Q: Inequalities<X, U>,
    {
        loop {
            match self
                .model
                .solve(problem, inequalities, &self.iterate, *settings)
            {
                Err(ModelError::NotConvex { stage }) => {
                    let more = AUGMENTATIONS
                        .iter()
                        .find(|&&augmentation| augmentation > settings.augmentation);
                    if let Some(&augmentation) = more {
                        settings.augmentation = augmentation;
                    } else if settings.curvature > 0.0 {
                        settings.curvature = 0.0;
                    } else if settings.damping < DAMPINGS[1] {
                        settings.damping = (settings.damping * RAISE).max(DAMPINGS[0]);
                    } else {
                        return Err(ModelError::NotConvex { stage });
                    }
                }
                done => return done,
            }
        }
    }

    pub(crate) fn measure<S, E>(&self, problem: &Problem<'_, S, E, X, U>, standing: &mut Standing) {
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
