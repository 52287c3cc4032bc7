//! Initial guesses for actuators that are fixed to the body, by a plan for a force that does not turn with it.
//!
//! A smooth path far from a free flight needs great forces. If these turn with the body, Newton's method turns the body to
//! be rid of them, and strays. A plan with forces in the inertial frame is an ordinary one, and near the plan that is wanted.

use nalgebra::{Matrix3, SMatrix};

use super::attempt::Solver;
use super::class::{Both, Class};
use super::error::PlanError;
use super::progress::{Consecutive, NewtonSettings, Start, Warmth};
use crate::problem::{InequalitySet, Weight};
use crate::{Actuation, Motion, Plan, Sweep, Transfer};

impl<C> Solver<'_, C> {
    /// The plan for a force of any direction, with the commands that come nearest to it: under the inequalities on states if some hold in
    /// phases, which a plan without them may be far from, or else without inequalities. Returns `None` if the actuators are not fixed to the body, if they exert no force or lack a moment, or if there is no such plan.
    pub(super) fn inertial_guess<const X: usize, const U: usize>(
        &mut self,
    ) -> Result<Option<Plan>, PlanError>
    where
        C: Class<X, U>,
    {
        let Some(free) = free(self.transfer) else {
            return Ok(None);
        };
        let settings = NewtonSettings {
            violation: self.tolerances.violation,
            stationarity: self.tolerances.stationarity,
            iterations: self.tolerances.iterations,
            coarse: self.coarse,
            falls_back: false,
        };
        if let Some(plan) = &self.inertial {
            return Ok(Some(plan.clone()));
        }
        let made = [self.standing.iteration, self.standing.trials];
        let mut progress = Consecutive::after(made, &mut *self.observe);
        let mut solved = |problem: &Transfer| {
            Solver::new(Both::<6>, problem, &settings, &mut progress.next())
                .solve(Start::Cold, Warmth::ONCE)
        };
        let found = match self.transfer.inequalities.on_states_in_phases() {
            Some(inequalities) => {
                let kept = Transfer {
                    inequalities,
                    ..free.clone()
                };
                match solved(&kept) {
                    Ok(plan) => Ok(plan),
                    Err(stopped @ PlanError::Stopped { .. }) => Err(stopped),
                    Err(_) => solved(&free),
                }
            }
            None => solved(&free),
        };
        [self.standing.iteration, self.standing.trials] = progress.made();
        match found {
            Ok(plan) => {
                self.inertial = Some(turned(self.transfer, plan));
                Ok(self.inertial.clone())
            }
            Err(stopped @ PlanError::Stopped { .. }) => Err(stopped),
            Err(_) => Ok(None),
        }
    }
}

/// The transfer without inequalities, with force and moment as commands, whose weights are about those of the actuators.
fn free(transfer: &Transfer) -> Option<Transfer> {
    let actuation = &transfer.actuation;
    if !actuation.is_fixed_to_body() || transfer.motion != Motion::Full {
        return None;
    }
    let inverse = Weight::from_diagonal(&actuation.weight().diagonal().map(f64::recip));
    let compliance = actuation.matrix() * inverse * actuation.matrix().transpose();
    // On the average over attitudes.
    let force = compliance.fixed_view::<3, 3>(0, 0).trace() / 3.0;
    if force <= 0.0 {
        return None;
    }
    let moment = compliance.fixed_view::<3, 3>(3, 3).into_owned();
    let moment = moment.cholesky()?.inverse();
    let symmetric = 0.5 * (moment + moment.transpose());
    let force = Matrix3::from_diagonal_element(force.recip());
    let actuation = Actuation::full(&force, &symmetric).ok()?;
    Some(Transfer {
        actuation,
        inequalities: InequalitySet::default(),
        off: None,
        by_step: None,
        ..transfer.clone()
    })
}

/// A plan with commands of actuators that are fixed to the body, in the mean of the attitudes at both ends of each step.
fn turned(transfer: &Transfer, plan: Plan) -> Plan {
    let one_sided = transfer.inequalities.one_sided();
    let each = plan.controls.iter().zip(plan.states.windows(2));
    let commands = each.map(|(load, ends)| {
        let mean: SMatrix<f64, 3, 3> = 0.5 * (ends[0].attitude + ends[1].attitude);
        let load = transfer.actuation.in_own_axes(load, &mean);
        transfer.actuation.allocated(&load, &one_sided)
    });
    Plan {
        commands: commands.collect(),
        feedback: Vec::new(),
        actuator_feedback: Vec::new(),
        sweep: Sweep::default(),
        ..plan
    }
}
