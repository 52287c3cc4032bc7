use lgvi_dynamics::rotation::Unsolvable;
use nalgebra::{SMatrix, SVector};

use super::conditions::{Ending, Inequalities};
use super::problem::{Iterate, Problem};
use super::step_size::{Interval, StepSize};
use crate::discrete::{Curvature, DiscreteDynamics, Inputs, Linearization};
use crate::riccati::{CostToGo, EndModel, NotConvex, Policy, Stage, StageModel};

/// Settings of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ModelSettings {
    /// Factor of the second derivatives of dynamics and terminal conditions: 1 for Newton's method, 0 for Gauss–Newton.
    pub(crate) curvature: f64,
    /// Weight of the augmentation of the terminal conditions, in multiples of the stiffness at the end.
    pub(crate) augmentation: f64,
    /// Damping of the variations, in multiples of the problem's metric.
    pub(crate) damping: f64,
    /// The stationarity up to which gains are of use, if they are computed. There must be room for them.
    pub(crate) gains: Option<f64>,
}

/// The linear-quadratic model of all stages about an iterate, and its solution.
pub(crate) struct Model<const X: usize, const U: usize> {
    /// `A_k`
    pub(crate) dynamics: Vec<Linearization>,
    /// The effects of the commands.
    pub(crate) inputs: Inputs<U>,
    /// `d_k`: the difference between `s_{k+1}` and the result of the step from `s_k`.
    pub(crate) defects: Vec<SVector<f64, X>>,
    /// `λ_k` for the iterate's ν: the multiplier equation (4.26), solved backward.
    pub(crate) costates: Vec<SVector<f64, X>>,
    /// Policies of the commands.
    pub(crate) policies: Vec<Policy<X, U>>,
    /// `c`
    pub(crate) miss: SVector<f64, X>,
    /// [`Problem::strictness`] of the conditions.
    pub(crate) strictness: SVector<f64, X>,
    /// `ρ`, the weights of the augmentation of the terminal conditions; zero for rows without a condition.
    pub(crate) augmentation: SVector<f64, X>,
    /// Gains of the neighboring extremals (see [`CostToGo::gain`]); empty if they are not wanted.
    pub(crate) gains: Vec<SMatrix<f64, U, X>>,
    /// True if the gains are those of the last model.
    pub(crate) has_gains: bool,
    /// The cost to go from the start.
    pub(crate) start: CostToGo<X>,
    /// How the model depends on the step size, if that is to be found.
    pub(crate) step_size: StepSize<X, U>,
    /// Largest component of `h W w + Bᵀ λ + Σ y ∂g/∂w`, in [`Problem::command_units`].
    pub(crate) stationarity: f64,
    /// Largest component of any of its terms, in the same units.
    pub(crate) largest: f64,
    /// Scratch space.
    stage: StageModel<X, U>,
}

/// The reason why no model with a solution exists.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ModelError {
    /// A step of the iterate cannot be made.
    Step { step: usize, source: Unsolvable },
    /// The model is not convex at this stage of the backward sweep.
    NotConvex { stage: usize },
    /// The terminal conditions are dependent: the commands cannot meet them independently.
    Dependent,
}

impl<const X: usize, const U: usize> Model<X, U> {
    pub(crate) fn new(intervals: usize) -> Self {
        Self::with_policies(vec![Policy::zeros(); intervals])
    }

    pub(super) fn with_policies(policies: Vec<Policy<X, U>>) -> Self {
        let intervals = policies.len();
        Self {
            dynamics: vec![Linearization::default(); intervals],
            inputs: Inputs::none(),
            defects: vec![SVector::zeros(); intervals],
            costates: vec![SVector::zeros(); intervals],
            policies,
            gains: Vec::new(),
            has_gains: false,
            miss: SVector::zeros(),
            strictness: SVector::repeat(1.0),
            augmentation: SVector::zeros(),
            start: CostToGo::end(&EndModel {
                hessian: SMatrix::zeros(),
                gradient: SVector::zeros(),
                jacobian: SMatrix::zeros(),
                residual: SVector::zeros(),
            }),
            step_size: StepSize::new(),
            stationarity: f64::INFINITY,
            largest: 0.0,
            stage: StageModel::zeros(),
        }
    }

    /// Allocates room for gains.
    pub(crate) fn want_gains(&mut self) {
        self.gains = vec![SMatrix::zeros(); self.policies.len()];
    }

    /// Builds the model about `iterate` and solves it backward.
    pub(crate) fn solve<S, E, Q>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        inequalities: &mut Q,
        iterate: &Iterate<X, U>,
        settings: ModelSettings,
    ) -> Result<(), ModelError>
    where
        S: DiscreteDynamics<X, U>,
        E: Ending<X>,
        Q: Inequalities<X, U>,
    {
        let steps = problem.steps;
        self.inputs = steps.inputs();
        let curvature = settings.curvature;
        let last = problem.intervals;
        let end = &iterate.states[last];
        let (mut costate, end_model) = end_model(
            problem,
            inequalities,
            iterate,
            settings,
            &mut self.augmentation,
        );
        self.miss = end_model.residual;
        self.strictness = problem.strictness(&end_model.jacobian);
        let softness = softness(problem, &end_model.jacobian);
        let mut cost = CostToGo::end(&end_model);
        costate += inequalities.state_force(last - 1, end);

        self.has_gains = settings.gains.is_some() && !self.gains.is_empty();
        self.stationarity = 0.0;
        self.largest = inequalities.price(&problem.command_units);
        let weight = problem.h * problem.weight;
        if let Some(beside) = &problem.beside {
            self.step_size.begin(last, beside);
        }
        let stage = &mut self.stage;
        for k in (0..last).rev() {
            let (state, command) = (&iterate.states[k], &iterate.commands[k]);
            let dynamics = &mut self.dynamics[k];
            let next = if curvature > 0.0 {
                steps.expand(k, state, command, &costate, dynamics, &mut stage.curvature)
            } else {
                stage.curvature = Curvature::default();
                steps.linearize(k, state, command, dynamics)
            }
            .map_err(|source| ModelError::Step { step: k, source })?;
            stage.defect = steps.difference(&iterate.states[k + 1], &next);
            self.costates[k] = costate;
            stage.command_gradient = weight * command;
            stage.command = weight;
            stage.state = SMatrix::zeros();
            stage.mixed = SMatrix::zeros();
            stage.state_gradient = SVector::zeros();

            let by_command;
            (costate, by_command) = dynamics.backward(&self.inputs, &costate);
            let mut terms = [
                stage.command_gradient,
                by_command,
                inequalities.command_force(k, command),
            ];
            if let Some((by_state, by_command)) = inequalities.joint_force(k, state, command) {
                costate += by_state;
                terms[2] += by_command;
            }
            let off = dynamics.off();
            if !off.is_none() {
                terms.iter_mut().for_each(|term| off.clear(term));
            }
            let residual = terms[0] + terms[1] + terms[2];
            let size = |term: &SVector<f64, U>| problem.command_units.component_mul(term).amax();
            self.stationarity = self.stationarity.max(size(&residual));
            self.largest = terms
                .iter()
                .fold(self.largest, |most, term| most.max(size(term)));

            if curvature > 0.0
                && let Some(body_frame) = problem.body_frame
            {
                body_frame.curve(&residual, command, &mut stage.state, &mut stage.mixed);
            }
            if settings.damping > 0.0 {
                stage.command += settings.damping * (problem.h * problem.command_metric);
                for (i, metric) in problem.metric.iter().enumerate() {
                    stage.state[(i, i)] += settings.damping * problem.h * metric;
                }
            }
            inequalities.add_command(k, command, &mut stage.command, &mut stage.command_gradient);
            if !off.is_none() {
                stage.shut(off, &weight);
            }
            inequalities.add_joint(k, state, command, stage);
            if k > 0 {
                inequalities.add_state(
                    k - 1,
                    state,
                    curvature,
                    &mut stage.state,
                    &mut stage.state_gradient,
                );
                costate += inequalities.state_force(k - 1, state);
            }
            let by_step_size = match &problem.beside {
                None => None,
                Some(beside) => {
                    let interval = Interval {
                        k,
                        iterate,
                        costate: curvature * self.costates[k],
                        model: stage,
                        dynamics,
                        inputs: &self.inputs,
                    };
                    let step_size = &mut self.step_size;
                    let entered = step_size.enter(problem, beside, inequalities, &interval, &cost);
                    Some(entered.map_err(|source| ModelError::Step { step: k, source })?)
                }
            };
            let whole = Stage {
                model: stage,
                step: dynamics,
                inputs: &self.inputs,
            };
            cost.sweep(whole, &mut self.policies[k])
                .map_err(|NotConvex| ModelError::NotConvex { stage: k })?;
            if let Some(slope) = by_step_size {
                self.step_size.leave(k, &self.policies[k], &slope);
            }
            if settings
                .gains
                .is_some_and(|bound| self.stationarity > bound * self.largest)
            {
                self.has_gains = false;
            }
            if let (true, Some(gain)) = (self.has_gains, self.gains.get_mut(k)) {
                cost.gain(&self.policies[k], &softness, gain);
            }
            self.defects[k] = stage.defect;
        }
        self.start = cost;
        Ok(())
    }

    /// Moves the model to an iterate without defects near the one about which it was solved. The problem must have no
    /// inequalities. The first derivatives are those of the new iterate; second derivatives and policies stay. Returns
    /// the change of ν that the model then requires; the constants `κ` of the policies are relative to the current ν.
    ///
    /// With the costate of the new iterate, the gradient of the Lagrangian by states vanishes. Only its gradient by
    /// commands, the terminal conditions and their augmentation are left to correct.
    ///
    /// With `correct` false, only the errors and the first derivatives are computed, and the change is of no use.
    pub(crate) fn follow<S, E>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        iterate: &Iterate<X, U>,
        correct: bool,
    ) -> Result<SVector<f64, X>, ModelError>
    where
        S: DiscreteDynamics<X, U>,
        E: Ending<X>,
    {
        let steps = problem.steps;
        let end = &iterate.states[problem.intervals];
        let jacobian = problem.ending.jacobian(end);
        self.miss = problem.ending.residual(end);
        self.strictness = problem.strictness(&jacobian);
        let mut costate = jacobian.tr_mul(&iterate.nu);
        let mut gradient = jacobian.tr_mul(&self.augmentation.component_mul(&self.miss));
        let mut offset = self.miss;
        self.stationarity = 0.0;
        self.largest = 0.0;
        let weight = problem.h * problem.weight;
        for k in (0..problem.intervals).rev() {
            let (state, command) = (&iterate.states[k], &iterate.commands[k]);
            let dynamics = &mut self.dynamics[k];
            let next = steps
                .linearize(k, state, command, dynamics)
                .map_err(|source| ModelError::Step { step: k, source })?;
            self.defects[k] = steps.difference(&iterate.states[k + 1], &next);
            self.costates[k] = costate;
            let (before, by_command) = dynamics.backward(&self.inputs, &costate);
            let mut own = weight * command;
            dynamics.off().clear(&mut own);
            let residual = own + by_command;
            let size = |term: &SVector<f64, U>| problem.command_units.component_mul(term).amax();
            self.stationarity = self.stationarity.max(size(&residual));
            self.largest = self.largest.max(size(&own)).max(size(&by_command));
            costate = before;
            if correct {
                self.policies[k].follow(
                    &residual,
                    dynamics,
                    &self.inputs,
                    &mut gradient,
                    &mut offset,
                );
            }
        }
        self.start.correction(&offset).ok_or(ModelError::Dependent)
    }
}

impl<const X: usize, const U: usize> Model<X, U> {
    /// What defects and misses are worth, with multipliers `nu` of the terminal conditions.
    pub(crate) fn violated(&self, nu: &SVector<f64, X>) -> f64 {
        let defects = self.costates.iter().zip(&self.defects);
        let each = defects.map(|(costate, defect)| costate.abs().dot(&defect.abs()));
        each.sum::<f64>() + nu.abs().dot(&self.miss.abs())
    }

    /// [`StepSize::reduced`]
    pub(crate) fn reduced(&self) -> Option<([f64; 2], [SVector<f64, X>; 2])> {
        self.step_size.reduced(&self.start)
    }

    /// The norm of a terminal miss, as it is compared with the tolerance.
    pub(crate) fn terminal(&self, miss: &SVector<f64, X>) -> f64 {
        self.strictness.component_mul(miss).norm()
    }
}

/// Returns the contribution of the terminal multipliers to the last costate, and the model of the end with augmented
/// conditions.
fn end_model<S, E, Q, const X: usize, const U: usize>(
    problem: &Problem<'_, S, E, X, U>,
    inequalities: &mut Q,
    iterate: &Iterate<X, U>,
    settings: ModelSettings,
    augmentation: &mut SVector<f64, X>,
) -> (SVector<f64, X>, EndModel<X>)
where
    E: Ending<X>,
    Q: Inequalities<X, U>,
{
    let end = &iterate.states[problem.intervals];
    let jacobian = problem.ending.jacobian(end);
    let residual = problem.ending.residual(end);
    *augmentation = problem.weights(&jacobian, settings.augmentation);
    let mut augmented = jacobian;
    for (weight, mut row) in augmentation.iter().zip(augmented.row_iter_mut()) {
        row *= *weight;
    }
    let mut hessian = jacobian.tr_mul(&augmented);
    let mut gradient = augmented.tr_mul(&residual);
    if settings.curvature > 0.0 {
        hessian += settings.curvature * problem.ending.curvature(end, &iterate.nu);
    }
    inequalities.add_state(
        problem.intervals - 1,
        end,
        settings.curvature,
        &mut hessian,
        &mut gradient,
    );
    let model = EndModel {
        hessian,
        gradient,
        jacobian,
        residual,
    };
    (jacobian.tr_mul(&iterate.nu), model)
}

/// Part of the duration, and the least number of intervals, over which feedback keeps the terminal conditions soft.
const SOFT: f64 = 0.02;
const SOFT_INTERVALS: f64 = 3.0;

/// The compliance of each terminal condition: how far it gives way per unit of its multiplier, as if it were met within
/// the soft part of the duration.
fn softness<S, E, const X: usize, const U: usize>(
    problem: &Problem<'_, S, E, X, U>,
    jacobian: &SMatrix<f64, X, X>,
) -> SVector<f64, X> {
    let part = SOFT.max(SOFT_INTERVALS / problem.intervals as f64).min(1.0);
    SVector::from_fn(|row, _| {
        let compliance = |column: usize| {
            // The columns are poses and momenta in turn, three each.
            let power = if (column / 3).is_multiple_of(2) { 3 } else { 1 };
            let share = (0..power).fold(1.0, |share, _| share * part);
            jacobian[(row, column)] * jacobian[(row, column)] * share / problem.stiffness[column]
        };
        (0..X).map(compliance).sum()
    })
}
