//! The whole strategy of the structured solver behind one call.

use lgvi_dynamics::gravity::{Field, Intrusion, LoadCurvature, LoadGradient};
use lgvi_dynamics::rotation::Unsolvable;
use lgvi_dynamics::{BodyState, Load, RigidBody};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use thiserror::Error;

use crate::newton::{
    Ended, Iterate, ModelError, Newton, Point, Problem, Standing, Tolerances, Unconstrained, guess,
};
use crate::steps::{KickDriftKick, Steps};
use crate::{Certificate, Motion, Plan, Transfer};

/// How the solver goes about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewtonSettings {
    /// Largest norm of the terminal miss at which a plan is accepted.
    pub violation: f64,
    /// Stationarity, relative, at which a plan is accepted.
    pub stationarity: f64,
    /// Newton steps at most, for each resolution and guess.
    pub iterations: u32,
    /// Intervals of the first resolution.
    pub coarse: usize,
}

impl Default for NewtonSettings {
    fn default() -> Self {
        Self {
            violation: 1e-12,
            stationarity: 1e-8,
            iterations: 100,
            coarse: 50,
        }
    }
}

/// Where a solution starts from.
#[derive(Clone, Copy, Debug)]
pub enum Start<'p> {
    /// From nothing.
    Cold,
    /// From a plan of a similar transfer.
    Warm(&'p Plan),
}

/// What the solver is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// At fewer intervals than asked for.
    Coarse,
    /// At all intervals.
    Fine,
}

/// Where the iteration stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Newton steps so far.
    pub iteration: u32,
    /// Trial points so far.
    pub trials: u32,
    /// Length of the last step; 1 before the first.
    pub step_length: f64,
    /// Largest norm of a defect or the terminal miss.
    pub violation: f64,
    /// Largest component of the Lagrangian's gradient by commands, relative to the largest term.
    pub stationarity: f64,
    /// The objective.
    pub cost: f64,
    /// What the solver is at.
    pub phase: Phase,
}

/// Why there is no plan.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum PlanError {
    /// The conditions cannot be met.
    #[error("the transfer is infeasible: smallest violation found {violation:.3e}")]
    Infeasible {
        /// The smallest violation found.
        violation: f64,
    },
    /// No guess led to a solution.
    #[error("not converged after {iterations} iterations: violation {violation:.3e}, stationarity {stationarity:.3e}")]
    NotConverged {
        /// The best iterate, as flown.
        best: Box<Plan>,
        /// Newton steps made.
        iterations: u32,
        /// Of the best iterate.
        violation: f64,
        /// Of the best iterate.
        stationarity: f64,
    },
    /// The caller asked to stop.
    #[error("stopped")]
    Stopped {
        /// The best iterate, where there is one that can be flown.
        best: Option<Box<Plan>>,
    },
    /// The solver does not treat this class of transfers.
    #[error("not supported: {0}")]
    Unsupported(&'static str),
    /// The body turns too far in a step on every path that was tried.
    #[error("step {step}: {source}")]
    Dynamics {
        /// The step, from 0.
        step: usize,
        /// By how much.
        source: Unsolvable,
    },
}

/// A field that is someone else's.
struct Shared<'f, F>(&'f F);

impl<F: Field> Field for Shared<'_, F> {
    fn load(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> Load {
        self.0.load(body, x, r)
    }

    fn potential(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> f64 {
        self.0.potential(body, x, r)
    }

    fn gradient(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> LoadGradient {
        self.0.gradient(body, x, r)
    }

    fn curvature(
        &self,
        body: &RigidBody,
        x: &Vector3<f64>,
        r: &Matrix3<f64>,
        weights: &Load,
    ) -> LoadCurvature {
        self.0.curvature(body, x, r, weights)
    }

    fn check_clearance(&self, body: &RigidBody, x: &Vector3<f64>) -> Result<(), Intrusion> {
        self.0.check_clearance(body, x)
    }
}

/// The same transfer in fewer or more steps.
fn resolved<'t, F: Field>(transfer: &'t Transfer<F>, intervals: usize) -> Transfer<Shared<'t, F>> {
    Transfer {
        body: transfer.body.clone(),
        field: Shared(&transfer.field),
        h: transfer.h * transfer.intervals as f64 / intervals as f64,
        intervals,
        initial: transfer.initial,
        target: transfer.target,
        actuation: transfer.actuation.clone(),
        dynamics: transfer.dynamics,
        motion: transfer.motion,
        constraints: transfer.constraints.clone(),
    }
}

/// What a unit of each coordinate costs at the end, from the rest-to-rest motion of a free body in the time given.
fn stiffness<F>(transfer: &Transfer<F>) -> SVector<f64, 12> {
    let duration = transfer.h * transfer.intervals as f64;
    let actuation = &transfer.actuation;
    let inverse = actuation
        .weight()
        .try_inverse()
        .unwrap_or_else(SMatrix::identity);
    let compliance = (actuation.matrix() * inverse * actuation.matrix().transpose()).diagonal();
    let mean = compliance.mean();
    SVector::from_fn(|i, _| {
        let (which, axis) = (i / 3, i % 3);
        let inertia = if which < 2 {
            transfer.body.mass()
        } else {
            transfer.body.inertia().matrix()[(axis, axis)]
        };
        let weight = compliance[3 * (which / 2) + axis].max(1e-6 * mean).recip();
        if which % 2 == 0 {
            12.0 * weight * inertia * inertia / (duration * duration * duration)
        } else {
            4.0 * weight / duration
        }
    })
}

fn metric<F>(transfer: &Transfer<F>) -> SVector<f64, 12> {
    let duration = transfer.h * transfer.intervals as f64;
    let stiffness = stiffness(transfer);
    let [translation, rotation] = [0, 6].map(|first| stiffness.fixed_rows::<3>(first).max());
    SVector::from_fn(|i, _| {
        let axis = i % 3;
        let metric = match i / 3 {
            0 => translation,
            1 => translation * (duration / transfer.body.mass()).powi(2),
            2 => rotation,
            _ => rotation * (duration / transfer.body.inertia().matrix()[(axis, axis)]).powi(2),
        };
        metric / duration
    })
}

fn problem<'p, F: Field, S>(
    transfer: &Transfer<F>,
    steps: &'p S,
    ending: &'p Point,
) -> Problem<'p, S, Point, 12, 6> {
    Problem {
        steps,
        ending,
        initial: transfer.initial,
        h: transfer.h,
        intervals: transfer.intervals,
        weight: *transfer.actuation.weight(),
        stiffness: stiffness(transfer),
        metric: metric(transfer),
    }
}

/// Solves `transfer`.
pub fn solve<F: Field>(
    transfer: &Transfer<F>,
    start: Start<'_>,
    settings: &NewtonSettings,
    mut observe: impl FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    if transfer.motion != Motion::Full {
        return Err(PlanError::Unsupported("other than the full motion"));
    }
    if !transfer.constraints.is_empty() {
        return Err(PlanError::Unsupported("inequalities"));
    }
    let Some(target) = transfer.target.state() else {
        return Err(PlanError::Unsupported("terminal sets other than a state"));
    };
    let ending = Point(target);
    let mut levels = Vec::new();
    if settings.coarse < transfer.intervals && matches!(start, Start::Cold) {
        levels.push(settings.coarse);
    }
    levels.push(transfer.intervals);
    let tolerances = Tolerances {
        violation: settings.violation,
        stationarity: settings.stationarity,
        iterations: settings.iterations,
    };
    let mut standing = Standing::default();
    let mut iterate: Option<Iterate<12, 6>> = match start {
        Start::Cold => None,
        Start::Warm(plan) => Some(Iterate {
            states: plan.states.clone(),
            commands: plan.commands.clone(),
            nu: plan.multipliers[plan.multipliers.len() - 1],
        }),
    };
    let mut newton = None;
    for &intervals in &levels {
        let view = resolved(transfer, intervals);
        let steps = KickDriftKick::full(&view);
        let problem = problem(&view, &steps, &ending);
        let (from, first) = match iterate.take() {
            Some(coarse) => (guess::resampled(&problem, &coarse), 0),
            None => {
                let path = guess::hermite(
                    &view.body,
                    view.h * intervals as f64,
                    intervals,
                    &view.initial,
                    &target,
                    0.0,
                );
                match guess::along(&problem, &view.body, &path, &target) {
                    Ok(iterate) => (iterate, 4),
                    Err(source) => return Err(PlanError::Dynamics { step: 0, source }),
                }
            }
        };
        let phase = if intervals < transfer.intervals {
            Phase::Coarse
        } else {
            Phase::Fine
        };
        let mut at = Newton::new(intervals, from);
        let first = first > 0;
        let ended = at.run(
            &problem,
            &mut Unconstrained,
            &tolerances,
            first,
            &mut standing,
            |now| observe(&now.progress(phase)),
        );
        match ended {
            Ended::Converged => (),
            Ended::Stopped => return Err(PlanError::Stopped { best: None }),
            Ended::Failed(ModelError::Step { step, source }) => {
                return Err(PlanError::Dynamics { step, source });
            }
            other => {
                if std::env::var("LGVI_DEBUG").is_ok() {
                    eprintln!("{other:?} {standing:?}");
                }
                return Err(PlanError::Infeasible {
                    violation: standing.violation,
                });
            }
        }
        iterate = Some(at.iterate.clone());
        newton = Some(at);
    }
    let Some(newton) = newton else {
        return Err(PlanError::Unsupported("no intervals"));
    };
    Ok(finish(transfer, newton, &standing))
}

fn finish<F: Field>(
    transfer: &Transfer<F>,
    newton: Newton<12, 6>,
    standing: &Standing,
) -> Plan {
    let controls = newton
        .iterate
        .commands
        .iter()
        .map(|command| transfer.actuation.load(command))
        .collect();
    Plan {
        h: transfer.h,
        states: newton.iterate.states,
        commands: newton.iterate.commands,
        controls,
        multipliers: newton.model.costates,
        feedback: newton.model.policies.iter().map(|policy| policy.state).collect(),
        cost: standing.cost,
        certificate: Certificate {
            stationarity: standing.stationarity,
            terminal: standing.violation,
            ..Certificate::default()
        },
    }
}

impl Standing {
    fn progress(&self, phase: Phase) -> Progress {
        Progress {
            iteration: self.iteration,
            trials: self.trials,
            step_length: self.length,
            violation: self.violation,
            stationarity: self.stationarity,
            cost: self.cost,
            phase,
        }
    }
}
