use lgvi_dynamics::BodyState;
use lgvi_dynamics::gravity::Field;
use lgvi_lie::exp;
use nalgebra::{SMatrix, SVector, Vector3};

use super::attempt::Solver;
use super::class::Class;
use super::error::PlanError;
use crate::newton::{Ending, Inequalities, Iterate};
use crate::problem::{RotationTarget, TranslationTarget};
use crate::steps::Steps;
use crate::{Certificate, Plan};

impl<F: Field, C> Solver<'_, F, C> {
    /// A state of the terminal set to draw paths to.
    pub(super) fn goal(&self) -> BodyState {
        let transfer = self.transfer;
        let (body, initial) = (&transfer.body, &transfer.initial);
        let duration = transfer.h * transfer.intervals as f64;
        let mut goal = *initial;
        let spin = initial.angular_velocity(body);
        let drifted = initial.attitude * exp(&(duration * spin));
        match transfer.target.translation {
            TranslationTarget::State {
                position,
                linear_momentum,
            }
            | TranslationTarget::Orbit {
                position,
                linear_momentum,
                ..
            } => {
                goal.position = position;
                goal.linear_momentum = linear_momentum;
            }
            TranslationTarget::Position { position } => {
                goal.position = position;
                goal.linear_momentum = (position - initial.position) * (body.mass() / duration);
            }
            TranslationTarget::Free => {
                goal.position += (duration / body.mass()) * initial.linear_momentum;
            }
        }
        match transfer.target.rotation {
            RotationTarget::State {
                attitude,
                angular_momentum,
            } => {
                goal.attitude = attitude;
                goal.angular_momentum = angular_momentum;
            }
            RotationTarget::Attitude { attitude } => {
                let turn = lgvi_lie::log(&initial.attitude.tr_mul(&attitude));
                goal.attitude = attitude;
                goal.angular_momentum = body.inertia().matrix() * (turn / duration);
            }
            RotationTarget::SpinAxis {
                axis,
                direction,
                angular_momentum,
            } => {
                goal.attitude = exp(&between(&(drifted * axis), &direction)) * drifted;
                goal.angular_momentum = angular_momentum;
            }
            RotationTarget::Free => goal.attitude = drifted,
        }
        goal
    }

    /// The plan with all that it carries.
    pub(super) fn finish<Q, const X: usize, const U: usize>(
        &self,
        iterate: &Iterate<X, U>,
        inequalities: &mut Q,
    ) -> Result<Plan, PlanError>
    where
        C: Class<X, U>,
        Q: Inequalities<X, U>,
    {
        let _ = inequalities;
        match self.flown(iterate)? {
            Some(plan) => Ok(plan),
            None => Err(PlanError::Stopped { best: None }),
        }
    }

    /// What the solver has where it has not converged.
    pub(super) fn not_converged<const X: usize, const U: usize>(
        &self,
        iterate: &Iterate<X, U>,
    ) -> Result<PlanError, PlanError>
    where
        C: Class<X, U>,
    {
        match self.flown(iterate)? {
            Some(plan) => Ok(PlanError::NotConverged {
                best: Box::new(plan),
                iterations: self.standing.iteration,
                violation: self.standing.violation,
                stationarity: self.standing.stationarity,
            }),
            None => Err(PlanError::Stopped { best: None }),
        }
    }

    /// The commands of an iterate as flown, without feedback or certificate; `None` where they cannot be flown.
    pub(super) fn flown<const X: usize, const U: usize>(
        &self,
        iterate: &Iterate<X, U>,
    ) -> Result<Option<Plan>, PlanError>
    where
        C: Class<X, U>,
    {
        let transfer = self.transfer;
        let steps = self.class.steps(transfer)?;
        let coarse = iterate.commands.len();
        let mut state = transfer.initial;
        let mut plan = Plan {
            h: transfer.h,
            states: vec![state],
            commands: Vec::with_capacity(transfer.intervals),
            controls: Vec::with_capacity(transfer.intervals),
            multipliers: vec![SVector::zeros(); transfer.intervals],
            feedback: vec![SMatrix::zeros(); transfer.intervals],
            cost: 0.0,
            certificate: Certificate::default(),
        };
        for k in 0..transfer.intervals {
            let command = iterate.commands[k * coarse / transfer.intervals];
            match steps.next(k, &state, &command) {
                Ok(next) if next.is_finite() => state = next,
                _ => return Ok(None),
            }
            let command = self.class.widened(&command);
            plan.cost += transfer.actuation.cost(transfer.h, &command);
            plan.controls.push(transfer.actuation.load(&command));
            plan.commands.push(command);
            plan.states.push(state);
        }
        plan.certificate.stationarity = self.standing.stationarity;
        plan.certificate.terminal = self.class.ending(transfer).residual(&state).norm();
        Ok(Some(plan))
    }
}

/// The rotation vector of the shortest way from one direction to another.
fn between(from: &Vector3<f64>, to: &Vector3<f64>) -> Vector3<f64> {
    let cross = from.cross(to);
    let (sine, cosine) = (cross.norm(), from.dot(to));
    if sine > 0.0 {
        return cross * (libm::atan2(sine, cosine) / sine);
    }
    if cosine > 0.0 {
        return Vector3::zeros();
    }
    // Half a turn about any axis across.
    let least = Vector3::ith(from.iamin(), 1.0);
    from.cross(&least).normalize() * std::f64::consts::PI
}
