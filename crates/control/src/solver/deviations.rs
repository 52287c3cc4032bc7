//! How far a flight deviates from its plan for a deviation of one standard deviation of each source, to first order.
//!
//! The deviations are those of the closed loop, `S_{k+1} = (A_k − B_k K_k) S_k + B_k diag(w_k) E`.

use lgvi_dynamics::BodyState;
use lgvi_dynamics::gravity::LoadGradient;
use nalgebra::{Dyn, OMatrix, SMatrix, SVector, U3, U6};

use super::error::PlanError;
use crate::discrete::{DiscreteDynamics, Inputs, KickDriftKick, Linearization};
use crate::problem::{Deviations, OF_STATE, Uncertainty, Vector12, stacked};
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
            return by_wheels(transfer, plan, &answers, initial);
        }
        let flown = Transfer {
            off: None,
            ..transfer.clone()
        };
        let steps = KickDriftKick::<_, 2, MAX_COMMANDS>::full(&flown);
        return along(&steps, &plan.states, &answers, initial);
    }
    let identity = SMatrix::identity();
    let flown = Transfer {
        actuation: Actuation::full(&identity, &identity).map_err(crate::TransferError::from)?,
        off: None,
        ..transfer.clone()
    };
    let steps = KickDriftKick::<_, 2, 6>::full(&flown);
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
    along(&steps, &plan.states, &answers, uncertainty.initial(body, 6))
}

/// The deviations of a plan by wheels: of the attitude as those of a gyrostat, of the position beside it.
fn by_wheels(
    transfer: &Transfer,
    plan: &Plan,
    answers: &Answers<'_, MAX_COMMANDS>,
    initial: Deviations,
) -> Result<Vec<Deviations>, PlanError> {
    let Transfer { body, field, h, .. } = transfer;
    let (stated, entered) = wheels::along(transfer, plan);
    let steps = KickDriftKick::<_, 2, MAX_COMMANDS>::gyrostat(&stated)?;
    let mut closed = Closed::new(&steps, answers);
    let gradient = |state: &BodyState| field.gradient(body, &state.position, &state.attitude);
    let (tau, glide) = (0.5 * h, h / body.mass());
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
        let moved = glide * orbit.fixed_rows::<3>(3);
        let mut position = orbit.fixed_rows_mut::<3>(0);
        position += moved;
        closed.step(k, &entered.states[k], Some(&impulse), &mut turn)?;
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
    steps: &impl DiscreteDynamics<12, U>,
    states: &[BodyState],
    answers: &Answers<'_, U>,
    initial: Deviations,
) -> Result<Vec<Deviations>, PlanError> {
    let mut closed = Closed::new(steps, answers);
    let mut now = initial;
    let mut all = vec![now.clone()];
    for (k, state) in states.iter().enumerate().take(answers.commands.len()) {
        closed.step(k, state, None, &mut now)?;
        all.push(now.clone());
    }
    Ok(all)
}

/// The linearized closed loop.
struct Closed<'a, S, const U: usize> {
    steps: &'a S,
    answers: &'a Answers<'a, U>,
    inputs: Inputs<U>,
    dynamics: Linearization,
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
        for (source, mut column) in deviations.column_iter_mut().enumerate() {
            let mut z: Vector12 = column.clone_owned();
            let mut change = SVector::<f64, U>::zeros();
            if let Some(gain) = answers.gains.get(k) {
                change -= gain * z;
            }
            if let Some(actuator) = source.checked_sub(OF_STATE) {
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
}

#[cfg(test)]
mod tests;
