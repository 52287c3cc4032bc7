//! How far a flight deviates from its plan for a deviation of one standard deviation of each source, to first order.
//!
//! The deviations are those of the closed loop, `S_{k+1} = (A_k − B_k K_k) S_k + B_k diag(w_k) E + D_k`. `D_k` is what other masses and
//! moments of the body change in a step, in the momenta that the nominal body would have, by central differences.

use lgvi_dynamics::gravity::LoadGradient;
use lgvi_dynamics::{BodyState, RigidBody};
use nalgebra::{Dyn, Matrix6, OMatrix, SMatrix, SVector, U3, U6};

use super::error::PlanError;
use crate::discrete::{
    DecouplingError, DiscreteDynamics, Inputs, KickDriftKick, Linearization, glide_gradient,
};
use crate::problem::{Deviations, OF_BODY, OF_STATE, Uncertainty, Vector12, stacked};
use crate::{Actuation, Command, MAX_COMMANDS, Plan, Transfer, wheels};

/// What acts along a plan.
struct Answers<'p, const U: usize> {
    commands: Vec<SVector<f64, U>>,
    /// Gains, or nothing in open loop.
    gains: &'p [SMatrix<f64, U, 12>],
    /// Standard deviation of the relative error of each command.
    errors: SVector<f64, U>,
}

/// `S_k` at the states `0 … N` of a plan, in all coordinates, as it is flown.
pub(super) fn deviations(
    transfer: &Transfer,
    uncertainty: &Uncertainty,
    plan: &Plan,
) -> Result<Vec<Deviations>, PlanError> {
    let Transfer {
        body, actuation, ..
    } = transfer;
    if actuation.is_of_wheels() || actuation.is_fixed_to_body() {
        let answers = Answers {
            commands: plan.commands.clone(),
            gains: if uncertainty.feedback {
                &plan.actuator_feedback
            } else {
                &[]
            },
            errors: Command::repeat(uncertainty.actuator_error),
        };
        let initial = uncertainty.initial(body, actuation.commands());
        if actuation.is_of_wheels() {
            return by_wheels(transfer, uncertainty, plan, &answers, initial);
        }
        let flown = Transfer {
            off: None,
            ..transfer.clone()
        };
        return along(&flown, uncertainty, &plan.states, &answers, initial);
    }
    let identity = SMatrix::identity();
    let flown = Transfer {
        actuation: Actuation::full(&identity, &identity).map_err(crate::TransferError::from)?,
        off: None,
        ..transfer.clone()
    };
    let [force, moment] = [uncertainty.force_error, uncertainty.moment_error];
    let answers = Answers {
        commands: plan.controls.iter().map(stacked).collect(),
        gains: if uncertainty.feedback {
            &plan.feedback
        } else {
            &[]
        },
        errors: SVector::from([force, force, force, moment, moment, moment]),
    };
    let initial = uncertainty.initial(body, 6);
    along(&flown, uncertainty, &plan.states, &answers, initial)
}

/// The deviations of a plan by wheels: of the attitude as those of a gyrostat, of the position beside it.
fn by_wheels(
    transfer: &Transfer,
    uncertainty: &Uncertainty,
    plan: &Plan,
    answers: &Answers<'_, MAX_COMMANDS>,
    initial: Deviations,
) -> Result<Vec<Deviations>, PlanError> {
    let Transfer { body, field, h, .. } = transfer;
    let (stated, entered) = wheels::along(transfer, plan);
    let steps = KickDriftKick::<_, 2, MAX_COMMANDS>::gyrostat(&stated)?;
    let mut closed = Closed {
        stores: true,
        ..Closed::new(&steps, answers)
    };
    let others = others(&stated, uncertainty)?;
    let others: Vec<_> = others
        .iter()
        .map(|(source, other)| Ok((*source, KickDriftKick::gyrostat(other)?, &other.body)))
        .collect::<Result<_, PlanError>>()?;
    let gradient = |state: &BodyState| field.gradient(body, &state.position, &state.attitude);
    let tau = 0.5 * h;
    let mut all = vec![initial.clone()];
    let mut orbit = initial.fixed_rows::<6>(0).into_owned();
    // In their place are the momenta that wheels exchange and store, which are known at the start.
    let mut turn = initial;
    turn.fixed_rows_mut::<6>(0).fill(0.0);
    for (k, ends) in plan.states.windows(2).enumerate() {
        let [begin, end] = [&ends[0], &ends[1]].map(gradient);
        // By the position and the attitude. Returns the impulse on the body; that by the attitude belongs to the gyrostat.
        let kick = |orbit: &mut OMatrix<f64, U6, Dyn>, turn: &Deviations, by: &LoadGradient| {
            let (position, attitude) = (orbit.fixed_rows::<3>(0), turn.fixed_rows::<3>(6));
            let force = by.force_by_position * position + by.force_by_attitude * attitude;
            let impulse = tau * (by.moment_by_position * position);
            let mut momentum = orbit.fixed_rows_mut::<3>(3);
            momentum += tau * force;
            impulse
        };
        let impulse = kick(&mut orbit, &turn, &begin);
        let mut begun = ends[0];
        begun.linear_momentum += tau * field.load(body, &begun.position, &begun.attitude).force;
        let by = glide_gradient(body, *h, &begun);
        let by = Matrix6::from_fn(|row, column| by[row / 3][column / 3][(row % 3, column % 3)]);
        orbit = by * orbit;
        closed.step(k, &entered.states[k], Some(&impulse), &mut turn)?;
        closed.deviate(k, &entered.states[k], body, &others, &mut turn)?;
        let impulse = kick(&mut orbit, &turn, &end);
        let mut momentum = turn.fixed_rows_mut::<3>(9);
        momentum += impulse;
        let mut deviations = turn.clone();
        deviations.fixed_rows_mut::<6>(0).copy_from(&orbit);
        all.push(deviations);
    }
    Ok(all)
}

fn along<const U: usize>(
    transfer: &Transfer,
    uncertainty: &Uncertainty,
    states: &[BodyState],
    answers: &Answers<'_, U>,
    initial: Deviations,
) -> Result<Vec<Deviations>, PlanError> {
    let steps = KickDriftKick::<_, 2, U>::full(transfer);
    let mut closed = Closed::new(&steps, answers);
    let others = others(transfer, uncertainty)?;
    let others: Vec<_> = others
        .iter()
        .map(|(source, other)| (*source, KickDriftKick::full(other), &other.body))
        .collect();
    let mut now = initial;
    let mut all = vec![now.clone()];
    for (k, state) in states.iter().enumerate().take(answers.commands.len()) {
        closed.step(k, state, None, &mut now)?;
        closed.deviate(k, state, &transfer.body, &others, &mut now)?;
        all.push(now.clone());
    }
    Ok(all)
}

/// The size of a difference (standard deviations of 1).
const STEP: f64 = 1e-4;

/// A source of the body, counted from 0, with its standard deviation, and the sign of the difference.
type Source = (usize, f64, f64);

/// The transfers of bodies that deviate to both sides, where they do.
fn others(
    transfer: &Transfer,
    uncertainty: &Uncertainty,
) -> Result<Vec<(Source, Transfer)>, PlanError> {
    let unit = Uncertainty {
        mass: 1.0,
        inertia: 1.0,
        ..*uncertainty
    };
    let sources = (0..OF_BODY).map(|source| (source, uncertainty.of_body(source)));
    let both = sources
        .filter(|(_, deviation)| *deviation > 0.0)
        .flat_map(|(source, deviation)| [1.0, -1.0].map(|sign| (source, deviation, sign)));
    both.map(|(source, deviation, sign)| {
        let body = unit.deviated(&transfer.body, source, sign * STEP);
        let body = body.map_err(|_| DecouplingError::NotFinite { step: 0 })?;
        let other = Transfer {
            body,
            ..transfer.clone()
        };
        Ok(((source, deviation, sign), other))
    })
    .collect()
}

/// The linearized closed loop.
struct Closed<'a, S, const U: usize> {
    steps: &'a S,
    answers: &'a Answers<'a, U>,
    inputs: Inputs<U>,
    dynamics: Linearization,
    /// True if momenta that wheels store are in the place of linear momenta.
    stores: bool,
}

impl<'a, S, const U: usize> Closed<'a, S, U>
where
    S: DiscreteDynamics<12, U>,
{
    fn new(steps: &'a S, answers: &'a Answers<'a, U>) -> Self {
        Self {
            inputs: steps.inputs(),
            dynamics: Linearization::default(),
            steps,
            answers,
            stores: false,
        }
    }

    /// Leads deviations at the beginning of a step, from this state of the plan, to those at its end. Impulses on the body at the
    /// beginning act after the answer to the deviations.
    fn step(
        &mut self,
        k: usize,
        state: &BodyState,
        impulses: Option<&OMatrix<f64, U3, Dyn>>,
        deviations: &mut Deviations,
    ) -> Result<(), PlanError> {
        let answers = self.answers;
        let command = &answers.commands[k];
        let linearized = self.steps.linearize(k, state, command, &mut self.dynamics);
        linearized.map_err(|source| PlanError::Dynamics { step: k, source })?;
        let of_body = deviations.ncols() - OF_BODY;
        for (source, mut column) in deviations.column_iter_mut().enumerate() {
            let mut z: Vector12 = column.clone_owned();
            let mut change = SVector::<f64, U>::zeros();
            if let Some(gain) = answers.gains.get(k) {
                change -= gain * z;
            }
            let actuator = source.checked_sub(OF_STATE);
            if let Some(actuator) = actuator.filter(|_| source < of_body) {
                change[actuator] += answers.errors[actuator] * command[actuator];
            }
            if let Some(impulses) = impulses {
                let mut momentum = z.fixed_rows_mut::<3>(9);
                momentum += impulses.column(source);
            }
            column.copy_from(&self.dynamics.forward(&self.inputs, &z, &change));
        }
        Ok(())
    }

    /// The state of another body with the same velocities.
    fn as_of(&self, state: &BodyState, bodies: [&RigidBody; 2]) -> BodyState {
        let other = state.of_other(bodies);
        BodyState {
            linear_momentum: match self.stores {
                true => state.linear_momentum,
                false => other.linear_momentum,
            },
            ..other
        }
    }

    /// Adds to deviations at the end of a step what it leads other bodies to.
    fn deviate(
        &self,
        k: usize,
        state: &BodyState,
        body: &RigidBody,
        others: &[(Source, S, &RigidBody)],
        deviations: &mut Deviations,
    ) -> Result<(), PlanError> {
        let command = &self.answers.commands[k];
        let step = |steps: &S, state: &BodyState| {
            let next = steps.next(k, state, command);
            next.map_err(|source| PlanError::Dynamics { step: k, source })
        };
        if others.is_empty() {
            return Ok(());
        }
        let nominal = step(self.steps, state)?;
        let first = deviations.ncols() - OF_BODY;
        for ((source, deviation, sign), steps, other) in others {
            let next = step(steps, &self.as_of(state, [body, other]))?;
            let next = self.as_of(&next, [other, body]);
            let apart = self.steps.difference(&nominal, &next);
            let mut column = deviations.column_mut(first + source);
            column += (0.5 * sign * deviation / STEP) * apart;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
