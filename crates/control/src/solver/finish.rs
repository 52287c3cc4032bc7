use lgvi_dynamics::BodyState;
use lgvi_lie::exp;
use nalgebra::{SMatrix, SVector};

use super::attempt::Solver;
use super::class::Class;
use super::error::PlanError;
use crate::discrete::DiscreteDynamics;
use crate::newton::{
    Ended, Ending, Inequalities, Iterate, ModelSettings, Newton, Problem, REUSED, Unconstrained,
};
use crate::{Certificate, MAX_COMMANDS, Plan, Sweep};

impl<C> Solver<'_, C> {
    /// A state of the terminal set that paths lead to. Free coordinates are those of the drift without loads.
    pub(super) fn goal(&self) -> BodyState {
        let transfer = self.transfer;
        let (body, initial) = (&transfer.body, &transfer.initial);
        let duration = transfer.h * transfer.intervals as f64;
        let mut goal = *initial;
        let spin = initial.angular_velocity(body);
        goal.position += (duration / body.mass()) * initial.linear_momentum;
        goal.attitude = initial.attitude * exp(&(duration * spin));
        let [translation, rotation] = transfer.terminal.aim(&mut goal);
        if translation == [true, false] {
            goal.linear_momentum = (goal.position - initial.position) * (body.mass() / duration);
        }
        if rotation == [true, false] {
            let turn = lgvi_lie::log(&initial.attitude.tr_mul(&goal.attitude));
            goal.angular_momentum = body.inertia().matrix() * (turn / duration);
        }
        goal
    }

    /// The complete plan, computed from its states and commands alone.
    ///
    /// If the plan is only a small step away from the point of the last model, gains, condition and convexity are taken
    /// from that model. Misses are always computed anew.
    pub(super) fn finish<Q, const X: usize, const U: usize>(
        &mut self,
        mut newton: Newton<X, U>,
        inequalities: &mut Q,
    ) -> Result<Plan, PlanError>
    where
        C: Class<X, U>,
        Q: Inequalities<X, U>,
    {
        let transfer = self.transfer;
        let steps = self.class.steps(transfer)?;
        let problem = self.problem(transfer, &steps);
        // What was followed has no defects.
        let plan = if newton.followed {
            Some(self.assembled(newton.iterate.clone()))
        } else {
            self.flown(&newton.iterate)?
        };
        let Some(mut plan) = plan else {
            return Err(self.unsolved(Ended::Stuck, &newton.iterate)?);
        };
        newton.iterate.states.clone_from(&plan.states);
        let inherited = self.inherited.take();
        let mut sufficient = Q::NONE
            && (inherited.is_some() || newton.solved_at <= REUSED)
            && (newton.followed
                || newton
                    .model
                    .follow(&problem, &newton.iterate, false)
                    .is_ok());
        let mut strayed = newton.solved_at;
        if !sufficient {
            newton.model.want_gains();
            for settings in MODELS {
                let Newton { model, iterate, .. } = &mut newton;
                let solved = model.solve(&problem, inequalities, iterate, settings);
                if solved.is_ok() {
                    sufficient = settings.curvature == 1.0;
                    newton.augmentation = settings.augmentation;
                    strayed = 0.0;
                    break;
                }
            }
        }
        let units = match inherited {
            Some(_) => problem.augmentation(&newton.iterate, newton.augmentation),
            None => newton.model.augmentation,
        };
        let independent = newton.model.start.multipliers().is_some();
        sufficient &= independent;
        match inherited {
            Some(inherited) if sufficient => {
                plan.feedback = inherited.feedback;
                plan.actuator_feedback = inherited.actuator_feedback;
                plan.sweep = inherited.sweep;
            }
            _ => {
                let gains = std::mem::take(&mut newton.model.gains);
                let gains = match transfer.chances {
                    Some(_) => self.yielding_gains(&problem, &newton, inequalities, gains),
                    None => gains,
                };
                let by_actuators =
                    transfer.actuation.is_fixed_to_body() || transfer.orbit.is_some();
                // Commands at minimum fuel do not answer.
                if by_actuators && !transfer.actuation.minimizes_fuel() {
                    // The costate is that of the inequalities, without which only this model knows nothing of it.
                    let free = self.gains_under(&problem, &newton, &mut Unconstrained, &[LINEAR]);
                    plan.actuator_feedback = self.gains_of_commands(&free.unwrap_or_default());
                }
                plan.feedback = self.widened_gains(gains);
                if Q::NONE && sufficient {
                    plan.sweep = self.kept(&problem, &mut newton, strayed);
                }
            }
        }
        let model = &newton.model;
        for (wide, own) in plan.multipliers.iter_mut().zip(&model.costates) {
            wide.fixed_rows_mut::<X>(C::FIRST).copy_from(own);
        }
        plan.paid = inequalities.paid();
        if !Q::NONE {
            let by_step_size = inequalities.by_step_size(&newton.iterate.commands);
            plan.sweep = Sweep::of_inequalities(inequalities.multipliers(), by_step_size);
        }
        let (inequality, complementarity) = inequalities.residuals();
        plan.certificate = Certificate {
            stationarity: model.stationarity / model.largest.max(f64::MIN_POSITIVE),
            defect: model.defects.iter().map(SVector::norm).fold(0.0, f64::max),
            terminal: model.terminal(&model.miss),
            inequality,
            priced: inequalities.priced(),
            complementarity,
            condition: model.start.condition(&model.augmentation, &units),
            sufficient,
            switching: self.switching(&newton),
        };
        Ok(plan)
    }

    /// Gains that do not know the inequalities on states. A plan keeps the distance from them that its deviations need, and those
    /// of neighboring extremals would hold it there, or even push it away from where they curve.
    fn yielding_gains<S, Q, const X: usize, const U: usize>(
        &self,
        problem: &Problem<'_, S, C::Ending, X, U>,
        newton: &Newton<X, U>,
        inequalities: &mut Q,
        firm: Vec<SMatrix<f64, U, X>>,
    ) -> Vec<SMatrix<f64, U, X>>
    where
        S: DiscreteDynamics<X, U>,
        C: Class<X, U>,
        Q: Inequalities<X, U>,
    {
        inequalities.give_way(true);
        let found = self.gains_under(problem, newton, inequalities, &MODELS);
        inequalities.give_way(false);
        found.unwrap_or(firm)
    }

    /// Gains under other inequalities than those of the plan, by the first of several models that has some. Those of actuators know no
    /// inequalities: what some cannot do others take over in flight, see [`Allocation`](crate::Allocation).
    fn gains_under<S, Q, const X: usize, const U: usize>(
        &self,
        problem: &Problem<'_, S, C::Ending, X, U>,
        newton: &Newton<X, U>,
        inequalities: &mut Q,
        models: &[ModelSettings],
    ) -> Option<Vec<SMatrix<f64, U, X>>>
    where
        S: DiscreteDynamics<X, U>,
        C: Class<X, U>,
        Q: Inequalities<X, U>,
    {
        let mut own = Newton::new(problem.intervals, newton.iterate.clone());
        own.model.want_gains();
        models.iter().find_map(|settings| {
            let Newton { model, iterate, .. } = &mut own;
            let solved = model.solve(problem, inequalities, iterate, *settings);
            solved.ok().map(|()| std::mem::take(&mut model.gains))
        })
    }

    /// Gains by which all commands answer to all coordinates.
    fn gains_of_commands<const X: usize, const U: usize>(
        &self,
        gains: &[SMatrix<f64, U, X>],
    ) -> Vec<SMatrix<f64, MAX_COMMANDS, 12>>
    where
        C: Class<X, U>,
    {
        let selection = self.class.selection();
        let widened = |own: &SMatrix<f64, U, X>| {
            let mut wide = SMatrix::<f64, MAX_COMMANDS, 12>::zeros();
            wide.fixed_columns_mut::<X>(C::FIRST)
                .copy_from(&(selection * own));
            wide
        };
        gains.iter().map(widened).collect()
    }

    /// Gains that answer in force and moment to all coordinates.
    fn widened_gains<const X: usize, const U: usize>(
        &self,
        gains: Vec<SMatrix<f64, U, X>>,
    ) -> Vec<SMatrix<f64, 6, 12>>
    where
        C: Class<X, U>,
    {
        let loads = self.transfer.actuation.matrix() * self.class.selection();
        let are_commands = U <= 6 && loads == SMatrix::<f64, 6, U>::identity();
        let widened = |own: SMatrix<f64, U, X>| {
            let mut wide = SMatrix::<f64, 6, 12>::zeros();
            let mut columns = wide.fixed_columns_mut::<X>(C::FIRST);
            if are_commands {
                columns.fixed_rows_mut::<U>(0).copy_from(&own);
            } else {
                columns.copy_from(&(loads * own));
            }
            wide
        };
        gains.into_iter().map(widened).collect()
    }

    /// The error of an iteration that ended without a plan, with the best iterate as flown: stopped or not converged.
    pub(super) fn unsolved<const X: usize, const U: usize>(
        &self,
        ended: Ended,
        iterate: &Iterate<X, U>,
    ) -> Result<PlanError, PlanError>
    where
        C: Class<X, U>,
    {
        let best = self.flown(iterate)?.map(|plan| {
            let feedback = vec![SMatrix::zeros(); plan.commands.len()];
            Box::new(Plan { feedback, ..plan })
        });
        Ok(match ended {
            Ended::Stopped => PlanError::Stopped { best },
            _ => PlanError::NotConverged {
                best,
                iterations: self.standing.iteration,
                violation: self.standing.violation,
                stationarity: self.standing.stationarity,
                tolerance: self.tolerances.violation,
            },
        })
    }

    /// The commands of an iterate as flown, without feedback, multipliers and certificate, or `None` if they cannot be flown.
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
        let mut flown = Iterate {
            states: Vec::with_capacity(transfer.intervals + 1),
            commands: Vec::with_capacity(transfer.intervals),
            nu: iterate.nu,
        };
        flown.states.push(state);
        for k in 0..transfer.intervals {
            let mut command = iterate.commands[k * coarse / transfer.intervals];
            if let Some(off) = steps.off().get(k) {
                off.clear(&mut command);
            }
            match steps.next(k, &state, &command) {
                Ok(next) if next.is_finite() => state = next,
                _ => return Ok(None),
            }
            flown.commands.push(command);
            flown.states.push(state);
        }
        let mut plan = self.assembled(flown);
        plan.certificate.stationarity = self.standing.stationarity;
        let problem = self.problem(transfer, &steps);
        let miss = problem.ending.residual(&state);
        let strictness = problem.strictness(&problem.ending.jacobian(&state));
        plan.certificate.terminal = strictness.component_mul(&miss).norm();
        Ok(Some(plan))
    }

    /// The plan of an iterate without defects, without feedback, multipliers and certificate.
    pub(super) fn assembled<const X: usize, const U: usize>(&self, iterate: Iterate<X, U>) -> Plan
    where
        C: Class<X, U>,
    {
        let transfer = self.transfer;
        let commands = iterate.commands.iter();
        let commands: Vec<_> = commands.map(|w| self.class.widened(w)).collect();
        let actuation = &transfer.actuation;
        Plan {
            h: transfer.h,
            states: iterate.states,
            controls: commands.iter().map(|w| actuation.load(w)).collect(),
            multipliers: vec![SVector::zeros(); transfer.intervals],
            feedback: Vec::new(),
            actuator_feedback: Vec::new(),
            cost: commands.iter().map(|w| actuation.cost(transfer.h, w)).sum(),
            paid: 0.0,
            commands,
            certificate: Certificate::default(),
            sweep: Sweep::default(),
        }
    }
}

/// Models that certify a plan: the exact Hessian with increasing augmentation, then the Gauss–Newton model. The latter
/// is always convex and gives gains for plans that are not minima.
const MODELS: [ModelSettings; 5] = [exact(10.0), exact(1e3), exact(1e5), exact(1e7), LINEAR];

/// The model of linear dynamics.
const LINEAR: ModelSettings = ModelSettings {
    curvature: 0.0,
    ..exact(10.0)
};

const fn exact(augmentation: f64) -> ModelSettings {
    ModelSettings {
        curvature: 1.0,
        augmentation,
        damping: 0.0,
        gains: Some(f64::INFINITY),
    }
}
