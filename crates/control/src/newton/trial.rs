use lgvi_dynamics::rotation::Unsolvable;
use nalgebra::SVector;

use super::conditions::{Ending, Inequalities};
use super::model::Model;
use super::problem::{Iterate, Problem};
use crate::steps::Steps;

/// The solution of a model: variations of states, commands and terminal multipliers.
pub(crate) struct Direction<const X: usize, const U: usize> {
    /// `z_0 … z_N`
    pub(crate) states: Vec<SVector<f64, X>>,
    /// `v_1 … v_N`
    pub(crate) commands: Vec<SVector<f64, U>>,
    /// The multipliers that the model calls for.
    pub(crate) nu: SVector<f64, X>,
}

/// Weights of the ℓ₁ merit `J + Σ w |d| + Σ w_N |c|`.
pub(crate) struct Weights<const X: usize> {
    /// By coordinate of the defects.
    pub(crate) defects: SVector<f64, X>,
    /// By terminal condition.
    pub(crate) miss: SVector<f64, X>,
}

/// What counts of a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Merit {
    /// `J`
    pub(crate) cost: f64,
    /// `J`, barrier included.
    pub(crate) objective: f64,
    /// Weighted violation.
    pub(crate) violation: f64,
    /// Largest norm of a defect.
    pub(crate) defect: f64,
    /// Norm of the terminal conditions.
    pub(crate) miss: f64,
}

impl Merit {
    pub(crate) fn total(&self) -> f64 {
        self.objective + self.violation
    }
}

impl<const X: usize, const U: usize> Direction<X, U> {
    pub(crate) fn new(intervals: usize) -> Self {
        Self {
            states: vec![SVector::zeros(); intervals + 1],
            commands: vec![SVector::zeros(); intervals],
            nu: SVector::zeros(),
        }
    }

    /// Forwards through the model with multipliers `nu`.
    pub(crate) fn solve(
        &mut self,
        model: &Model<X, U>,
        nu: SVector<f64, X>,
        inequalities: &mut impl Inequalities<X, U>,
    ) {
        self.nu = nu;
        let mut z = SVector::zeros();
        for (k, policy) in model.policies.iter().enumerate() {
            let v = policy.command(&z, &nu);
            let dynamics = &model.dynamics[k];
            z = dynamics.a * z + dynamics.b * v + model.defects[k];
            self.commands[k] = v;
            self.states[k + 1] = z;
            inequalities.direct(k, &z, &v);
        }
    }
}

/// How a trial point is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Path {
    /// States and commands move by themselves: steps may miss.
    Straight,
    /// The policies are flown: the misses that were there shrink, no new ones arise.
    Flown,
}

/// Moves `from` along `direction` by `length` to `to`, and weighs where that is.
#[allow(clippy::too_many_arguments)]
pub(crate) fn trial<S, E, Q, const X: usize, const U: usize>(
    problem: &Problem<'_, S, E, X, U>,
    inequalities: &Q,
    model: &Model<X, U>,
    direction: &Direction<X, U>,
    weights: &Weights<X>,
    from: &Iterate<X, U>,
    path: Path,
    length: f64,
    to: &mut Iterate<X, U>,
) -> Result<Merit, Unsolvable>
where
    S: Steps<X, U>,
    E: Ending<X>,
    Q: Inequalities<X, U>,
{
    let steps = problem.steps;
    let weight = problem.h * problem.weight;
    let mut merit = Merit {
        cost: 0.0,
        objective: 0.0,
        violation: 0.0,
        defect: 0.0,
        miss: 0.0,
    };
    to.nu = from.nu + length * (direction.nu - from.nu);
    for k in 0..problem.intervals {
        let state = to.states[k];
        let mut v = length * direction.commands[k];
        if path == Path::Flown {
            let off = steps.difference(&from.states[k], &state) - length * direction.states[k];
            v -= model.policies[k].state * off;
        }
        let command = from.commands[k] + v;
        let next = steps.next(k, &state, &command)?;
        let (end, defect) = match path {
            Path::Straight => {
                let end = steps.moved(&from.states[k + 1], &(length * direction.states[k + 1]));
                let defect = steps.difference(&end, &next);
                (end, defect)
            }
            Path::Flown => {
                let defect = (1.0 - length) * model.defects[k];
                let end = if length < 1.0 {
                    steps.moved(&next, &-defect)
                } else {
                    next
                };
                (end, defect)
            }
        };
        let (barrier, violation) = inequalities.merit(k, &end, &command, length);
        merit.cost += 0.5 * command.dot(&(weight * command));
        merit.objective += barrier;
        merit.violation += violation + weights.defects.dot(&defect.abs());
        merit.defect = merit.defect.max(defect.norm());
        to.commands[k] = command;
        to.states[k + 1] = end;
    }
    let miss = problem.ending.residual(&to.states[problem.intervals]);
    merit.miss = miss.norm();
    merit.violation += weights.miss.dot(&miss.abs());
    merit.objective += merit.cost;
    Ok(merit)
}
