use lgvi_dynamics::BodyState;
use lgvi_dynamics::gravity::Field;
use lgvi_lie::exp;
use nalgebra::{SMatrix, SVector, Vector3};

use super::attempt::Solver;
use super::class::Class;
use super::error::PlanError;
use crate::newton::{Ending, Inequalities, Iterate, Kind, Model, Problem};
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

    /// The plan with all that it carries, computed from its states and commands alone.
    pub(super) fn finish<Q, const X: usize, const U: usize>(
        &self,
        iterate: &Iterate<X, U>,
        inequalities: &mut Q,
    ) -> Result<Plan, PlanError>
    where
        C: Class<X, U>,
        Q: Inequalities<X, U>,
    {
        let Some(mut plan) = self.flown(iterate)? else {
            return Err(PlanError::Stopped { best: None });
        };
        let iterate = Iterate {
            states: plan.states.clone(),
            commands: iterate.commands.clone(),
            nu: iterate.nu,
        };
        let steps = self.class.steps(self.transfer)?;
        let problem = self.problem(self.transfer, &steps);
        let softness = softness(&problem, &iterate);
        let mut model = Model::new(problem.intervals);
        let mut sufficient = false;
        for kind in KINDS {
            let solved = model.solve(
                &problem,
                inequalities,
                &iterate,
                kind,
                |k, policy, cost| {
                    plan.feedback[k] = self.widened_gain(&cost.gain(policy, &softness));
                },
            );
            if solved.is_ok() {
                sufficient = kind.curvature == 1.0;
                break;
            }
        }
        for (wide, own) in plan.multipliers.iter_mut().zip(&model.costates) {
            wide.fixed_rows_mut::<X>(C::FIRST).copy_from(own);
        }
        let (inequality, complementarity) = inequalities.residuals();
        plan.certificate = Certificate {
            stationarity: model.stationarity / model.largest.max(f64::MIN_POSITIVE),
            defect: model.defects.iter().map(SVector::norm).fold(0.0, f64::max),
            terminal: model.miss.norm(),
            inequality,
            complementarity,
            condition: model.start.condition(&model.augmentation),
            sufficient: sufficient && model.start.multipliers().is_some(),
        };
        Ok(plan)
    }

    fn widened_gain<const X: usize, const U: usize>(
        &self,
        gain: &SMatrix<f64, U, X>,
    ) -> SMatrix<f64, 6, 12>
    where
        C: Class<X, U>,
    {
        let mut wide = SMatrix::<f64, 6, 12>::zeros();
        for (i, column) in gain.column_iter().enumerate() {
            let command = self.class.widened(&column.into_owned());
            wide.set_column(C::FIRST + i, &(self.transfer.actuation.matrix() * command));
        }
        wide
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

/// Models to certify a plan by: the exact Hessian, augmented more and more, and that of Gauss and Newton, which is always
/// convex, for gains where the plan is no minimum.
const KINDS: [Kind; 5] = [
    exact(10.0),
    exact(1e3),
    exact(1e5),
    exact(1e7),
    Kind {
        curvature: 0.0,
        ..exact(10.0)
    },
];

const fn exact(augmentation: f64) -> Kind {
    Kind {
        curvature: 1.0,
        augmentation,
        damping: 0.0,
    }
}

/// Part of the duration, and intervals at least, for which feedback keeps the terminal conditions soft.
const SOFT: f64 = 0.02;
const SOFT_INTERVALS: f64 = 3.0;

/// What a terminal condition gives way by, a unit of its multiplier: as if it were met in the time that is soft.
fn softness<S, E: Ending<X>, const X: usize, const U: usize>(
    problem: &Problem<'_, S, E, X, U>,
    iterate: &Iterate<X, U>,
) -> SVector<f64, X> {
    let part = SOFT.max(SOFT_INTERVALS / problem.intervals as f64).min(1.0);
    let jacobian = problem.ending.jacobian(&iterate.states[problem.intervals]);
    SVector::from_fn(|row, _| {
        let compliance = |column: usize| {
            // Poses, then momenta, by threes.
            let power = if (column / 3) % 2 == 0 { 3 } else { 1 };
            let share = (0..power).fold(1.0, |share, _| share * part);
            jacobian[(row, column)] * jacobian[(row, column)] * share / problem.stiffness[column]
        };
        (0..X).map(compliance).sum()
    })
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
