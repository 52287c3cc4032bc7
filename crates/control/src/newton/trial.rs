use lgvi_dynamics::rotation::Unsolvable;
use nalgebra::SVector;

use super::conditions::{Ending, Inequalities};
use super::model::Model;
use super::problem::{Iterate, Problem};
use crate::discrete::DiscreteDynamics;

/// The solution of a model: variations of states, commands and terminal multipliers.
pub(crate) struct Direction<const X: usize, const U: usize> {
    /// `z_0 … z_N`
    pub(crate) states: Vec<SVector<f64, X>>,
    /// `v_1 … v_N`
    pub(crate) commands: Vec<SVector<f64, U>>,
    /// The multipliers `ν` after a full step.
    pub(crate) nu: SVector<f64, X>,
}

/// Weights of the ℓ₁ merit `J + Σ w |d| + Σ w_N |c|`.
pub(crate) struct Weights<const X: usize> {
    /// By coordinate of the defects.
    pub(crate) defects: SVector<f64, X>,
    /// By terminal condition.
    pub(crate) miss: SVector<f64, X>,
}

/// The merit of a point, by parts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Merit<const X: usize> {
    /// `J`
    pub(crate) cost: f64,
    /// `J` plus penalties.
    pub(crate) objective: f64,
    /// The weighted violation.
    pub(crate) violation: f64,
    /// `c`
    pub(crate) miss: SVector<f64, X>,
}

impl<const X: usize> Merit<X> {
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

    /// Solves forward through the model. `nu` is the change of the multipliers beyond `before`, to which the constants
    /// of the policies refer.
    pub(crate) fn solve(
        &mut self,
        model: &Model<X, U>,
        nu: SVector<f64, X>,
        before: &SVector<f64, X>,
        inequalities: &mut impl Inequalities<X, U>,
    ) {
        self.nu = before + nu;
        let mut z = SVector::zeros();
        for (k, policy) in model.policies.iter().enumerate() {
            let v = policy.command(&z, &nu);
            let start = z;
            z = model.dynamics[k].forward(&model.inputs, &z, &v) + model.defects[k];
            self.commands[k] = v;
            self.states[k + 1] = z;
            inequalities.direct(k, &start, &z, &v);
        }
    }

    /// [`Direction::solve`] for the change `eta` of the step size and multipliers `nu`, from an iterate with steps of the size `h`.
    pub(crate) fn solve_with_step_size(
        &mut self,
        model: &Model<X, U>,
        (eta, h): (f64, f64),
        nu: SVector<f64, X>,
        from: &Iterate<X, U>,
        inequalities: &mut impl Inequalities<X, U>,
    ) {
        self.nu = nu;
        let mut z = SVector::zeros();
        for (k, policy) in model.policies.iter().enumerate() {
            let (defect, answer) = model.step_size.answer(k);
            let v = policy.command(&z, &nu) + eta * answer;
            let start = z + eta * model.step_size.along(k);
            z = model.dynamics[k].forward(&model.inputs, &z, &v);
            z += model.defects[k] + eta * defect;
            self.commands[k] = v;
            self.states[k + 1] = z;
            let end = z + eta * model.step_size.along(k + 1);
            let whole = v - (2.0 * eta / h) * from.commands[k];
            inequalities.direct(k, &start, &end, &whole);
        }
    }
}

/// The way in which a trial point is made.
#[derive(Clone, Copy)]
pub(crate) enum Move<'d, const X: usize, const U: usize> {
    /// States and commands move along a direction independently, which may cause defects.
    Straight(&'d Direction<X, U>, f64),
    /// Commands move along a direction and are corrected by the policies. Existing defects shrink; no new ones arise.
    Flown(&'d Direction<X, U>, f64),
    /// The policies respond to a change of ν. No defect changes.
    Conditions(SVector<f64, X>),
    /// A full step of the model, flown, with a change of ν. There are no defects.
    Policies(SVector<f64, X>),
}

/// The data that trial points are made and judged with.
pub(crate) struct Trial<'t, 'p, S, E, Q, const X: usize, const U: usize> {
    pub(crate) problem: &'t Problem<'p, S, E, X, U>,
    pub(crate) inequalities: &'t Q,
    pub(crate) model: &'t Model<X, U>,
    pub(crate) weights: &'t Weights<X>,
    /// Length of the step, by which defects shrink.
    pub(crate) length: f64,
}

impl<S, E, Q, const X: usize, const U: usize> Trial<'_, '_, S, E, Q, X, U>
where
    S: DiscreteDynamics<X, U>,
    E: Ending<X>,
    Q: Inequalities<X, U>,
{
    /// Moves `from` to `to` and returns the merit there.
    pub(crate) fn make(
        &self,
        how: Move<'_, X, U>,
        from: &Iterate<X, U>,
        to: &mut Iterate<X, U>,
    ) -> Result<Merit<X>, Unsolvable> {
        let Self { problem, model, .. } = self;
        let steps = problem.steps;
        let weight = problem.h * problem.weight;
        let mut merit = Merit {
            cost: 0.0,
            objective: 0.0,
            violation: 0.0,
            miss: SVector::zeros(),
        };
        to.nu = match how {
            Move::Straight(direction, length) | Move::Flown(direction, length) => {
                from.nu + length * (direction.nu - from.nu)
            }
            Move::Conditions(_) => from.nu,
            Move::Policies(change) => from.nu + change,
        };
        for k in 0..problem.intervals {
            let state = to.states[k];
            let policy = &model.policies[k];
            let mut off = steps.difference(&from.states[k], &state);
            let turned = problem.body_frame.map(|body_frame| {
                let momenta = [&from.states[k], &state].map(|state| &state.angular_momentum);
                (
                    body_frame,
                    body_frame.difference(momenta[0], momenta[1], &mut off),
                )
            });
            let v = match how {
                Move::Straight(direction, length) => length * direction.commands[k],
                Move::Flown(direction, length) => {
                    length * direction.commands[k]
                        + policy.state.tr_mul(&(off - length * direction.states[k]))
                }
                Move::Conditions(nu) => policy.state.tr_mul(&off) + policy.conditions.tr_mul(&nu),
                Move::Policies(nu) => policy.command(&off, &nu),
            };
            let mut command = from.commands[k] + v;
            if let Some((body_frame, zeta)) = turned {
                body_frame.command(&zeta, &from.commands[k], &mut command);
            }
            let next = steps.next(k, &state, &command)?;
            let (end, defect) = match how {
                Move::Straight(direction, length) => {
                    let end = steps.moved(&from.states[k + 1], &(length * direction.states[k + 1]));
                    (end, steps.difference(&end, &next))
                }
                _ if self.length == 1.0 => (next, SVector::zeros()),
                _ => {
                    let defect = (1.0 - self.length) * model.defects[k];
                    (steps.moved(&next, &-defect), defect)
                }
            };
            let penalty = self.inequalities.merit(k, [&state, &end], &command);
            merit.cost += 0.5 * command.dot(&(weight * command));
            merit.objective += penalty;
            merit.violation += self.weights.defects.dot(&defect.abs());
            to.commands[k] = command;
            to.states[k + 1] = end;
        }
        merit.miss = problem.ending.residual(&to.states[problem.intervals]);
        merit.violation += self.weights.miss.dot(&merit.miss.abs());
        merit.objective += merit.cost;
        Ok(merit)
    }
}
