//! Plans by thrusters that use propellant.
//!
//! With the momenta in proportion to the mass, `γ̃ = γ M/m` and `Π̃ = Π M/m`, and the commands `w = F M/m`, where M is the mass
//! with all propellant and m of the commands that in the middle of a step, a step of the body that loses mass is one of the
//! constant mass M, because inertia and gravity are in proportion to the mass. The mass remains in the limits, `F ≤ F_max`, in
//! the cost of the mass that is used, which loosens later limits, and in the Coriolis force and the jet damping of gas that
//! leaves a body that turns. These are taken from a plan and the transfer is solved again, until they are those of its own plan.

mod ejection;
mod flight;
mod masses;
mod settle;

use std::sync::Arc;

use lgvi_dynamics::{BodyState, Load};
use nalgebra::{DVector, SVector};

use crate::multistart::{count, rank, search_stated};
use crate::problem::{ByStep, block};
use crate::solver::{NewtonSettings, PlanError, Progress, Start, command_forces, solve_stated};
use crate::units::Units;
use crate::{
    Certificate, Command, Dynamics, Minimum, Motion, Plan, SearchSettings, Sweep, Transfer,
    TransferError, miss,
};
use flight::fly;
use masses::{Masses, open};
use settle::Settling;

/// Relative change of the limits, and of the costs relative to the largest force of a condition, up to which they have settled.
const SETTLED: [f64; 2] = [1e-9, 1e-7];
/// Distance of the ends of a plan and of its flight, relative to the size of each quantity, up to which they are the same.
const SAME: f64 = 1e-8;
/// Largest number of times that the transfer is solved.
const MOST: usize = 60;

/// [`crate::solve`] for a transfer by thrusters that use propellant.
pub(crate) fn solve(
    transfer: &Transfer,
    start: Start<'_>,
    settings: &NewtonSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Plan, PlanError> {
    let scaled = Scaled::new(transfer)?;
    let mut made = [0; 2];
    let mut plan = match start {
        Start::Cold => None,
        Start::Warm(plan) => Some(scaled.entered(plan)),
    };
    let mut along = match &plan {
        Some(plan) if plan.commands.len() == transfer.intervals => scaled.along(plan)?,
        _ => scaled.untouched(),
    };
    let mut settling = Settling::default();
    for _ in 0..MOST {
        let before = made;
        let mut watch = |now: &Progress| {
            made = [before[0] + now.iteration, before[1] + now.trials];
            observe(&Progress {
                iteration: made[0],
                trials: made[1],
                ..*now
            })
        };
        let stated = scaled.stated(&along);
        let start = plan.as_ref().map_or(Start::Cold, Start::Warm);
        let found = solve_stated(&stated, start, settings, &mut watch)
            .map_err(|error| scaled.left_error(error))?;
        let next = scaled.along(&found)?;
        let changes = along.changes(&next);
        eprintln!("{made:?} changes {changes:?} cost {} a {:?}", found.cost, next.costs[0]/next.size);
        if changes[0] <= SETTLED[0] && changes[1] <= SETTLED[1] {
            scaled.check_propellant(&found)?;
            let states = fly(transfer, &scaled.forces(&found.commands))?;
            let apart = scaled.distance(&stated, &found, &states);
            eprintln!("apart {apart:e}");
            if apart <= SAME.max(2.0 * found.certificate.terminal) {
                return Ok(scaled.left(found, states, apart));
            }
        }
        let [x, result] = [along.vector(next.size), next.vector(next.size)];
        let x = settling.next(&x, &result);
        along = next.at(&x);
        plan = Some(found);
    }
    Err(PlanError::NotConverged {
        best: None,
        iterations: made[0],
        violation: f64::INFINITY,
        stationarity: f64::INFINITY,
        tolerance: settings.violation,
    })
}

/// What a plan makes of the transfer that is solved.
struct Along {
    /// `ln(m/M)` in the middle of each step.
    masses: Vec<f64>,
    /// The cost of mass flows in each step.
    costs: Vec<f64>,
    loads: Vec<[Load; 2]>,
    /// The largest cost that prices and inequalities hold against a mass flow.
    size: f64,
}

impl Along {
    /// The changes of the masses, and of the costs relative to their size.
    fn changes(&self, to: &Self) -> [f64; 2] {
        let most = |[a, b]: [&[f64]; 2]| {
            let each = a.iter().zip(b);
            each.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        [
            most([&self.masses, &to.masses]),
            most([&self.costs, &to.costs]) / to.size,
        ]
    }

    /// The masses and the costs in units of `size`.
    fn vector(&self, size: f64) -> DVector<f64> {
        let costs = self.costs.iter().map(|cost| cost / size);
        DVector::from_iterator(2 * self.masses.len(), self.masses.iter().copied().chain(costs))
    }

    /// The same with other masses and costs.
    fn at(self, vector: &DVector<f64>) -> Self {
        let (masses, costs) = vector.as_slice().split_at(self.masses.len());
        Self {
            masses: masses.to_vec(),
            costs: costs.iter().map(|cost| cost * self.size).collect(),
            ..self
        }
    }
}

/// A transfer as one of its scaled motion.
struct Scaled<'t> {
    transfer: &'t Transfer,
    /// The transfer with all propellant.
    full: Transfer,
}

impl<'t> Scaled<'t> {
    fn new(transfer: &'t Transfer) -> Result<Self, PlanError> {
        let (dynamics, motion) = (transfer.dynamics, transfer.motion);
        if dynamics != Dynamics::Lgvi || motion != Motion::Full {
            return Err(PlanError::PropellantDoes { dynamics, motion });
        }
        let mut full = transfer.clone();
        if let Some(thrusters) = transfer.body.thrusters() {
            full.body.set_propellant(thrusters.propellant().mass);
        }
        let factor = full.body.mass() / transfer.body.mass();
        full.initial = resized(&transfer.initial, factor);
        Ok(Self { transfer, full })
    }

    /// `M`
    fn mass(&self) -> f64 {
        self.full.body.mass()
    }

    fn stated(&self, along: &Along) -> Transfer {
        let flows = masses::flows(self.transfer) / self.mass();
        let by_step = ByStep {
            limits: along.masses.iter().map(|mass| (-mass).exp()).collect(),
            costs: along.costs.iter().map(|cost| *cost * flows).collect(),
            loads: along.loads.clone(),
        };
        Transfer {
            by_step: Some(Arc::new(by_step)),
            ..self.full.clone()
        }
    }

    /// What a plan makes of the transfer if no mass flows out.
    fn untouched(&self) -> Along {
        let steps = self.transfer.intervals;
        Along {
            masses: vec![(self.transfer.body.mass() / self.mass()).ln(); steps],
            costs: vec![0.0; steps],
            loads: vec![[Load::default(); 2]; steps],
            size: 1.0,
        }
    }

    /// What a plan of the scaled motion makes of the transfer.
    fn along(&self, plan: &Plan) -> Result<Along, PlanError> {
        let (transfer, mass) = (self.transfer, self.mass());
        let masses = Masses::new(transfer, mass, &plan.commands);
        let thrusts = self.forces(&plan.commands);
        let mut along = Along {
            masses: masses.middles.iter().map(|middle| (middle / mass).ln()).collect(),
            loads: ejection::loads(transfer, mass, &masses, &plan.states, &thrusts),
            ..self.untouched()
        };
        let forces = command_forces(&self.stated(&along), plan)?;
        let (actuation, h) = (&transfer.actuation, transfer.h);
        let flows = masses::flows(transfer) / mass;
        let each = plan.commands.iter().zip(&forces);
        let held = each.map(|(w, force)| (force.dot(w) - h * actuation.rate(w)).max(0.0));
        along.costs = masses.costs(&held.collect::<Vec<_>>());
        let sizes = forces.iter().map(|force| {
            let each = force.iter().zip(&flows).filter(|(_, flow)| **flow > 0.0);
            each.map(|(force, flow)| (force / (h * flow)).abs()).fold(0.0, f64::max)
        });
        along.size = sizes.fold(f64::MIN_POSITIVE, f64::max);
        Ok(along)
    }

    /// The forces of the thrusters.
    fn forces(&self, commands: &[Command]) -> Vec<Command> {
        let masses = Masses::new(self.transfer, self.mass(), commands);
        let each = commands.iter().zip(&masses.middles);
        each.map(|(w, middle)| open(w) * (middle / self.mass()))
            .collect()
    }

    fn check_propellant(&self, plan: &Plan) -> Result<(), PlanError> {
        let needed = Masses::new(self.transfer, self.mass(), &plan.commands).used();
        let thrusters = self.transfer.body.thrusters();
        let available = thrusters.map_or(0.0, |thrusters| thrusters.propellant_left());
        if needed > available {
            return Err(PlanError::Propellant { needed, available });
        }
        Ok(())
    }

    /// The difference of the ends of a plan of the scaled motion and of a flight, relative to the size of each quantity.
    fn distance(&self, stated: &Transfer, plan: &Plan, flown: &[BodyState]) -> f64 {
        let masses = Masses::new(self.transfer, self.mass(), &plan.commands);
        let ends = plan.states.last().zip(flown.last()).zip(masses.ends.last());
        ends.map_or(0.0, |((planned, flown), mass)| {
            let flown = resized(flown, self.mass() / mass);
            let apart = miss(planned, &flown).component_div(&Units::of(stated).variations());
            (0..4).map(|which| block(&apart, which).norm()).fold(0.0, f64::max)
        })
    }

    /// A plan of the transfer as one of the scaled motion.
    fn entered(&self, plan: &Plan) -> Plan {
        let masses = Masses::under(self.transfer, &plan.commands);
        self.with_factors(plan.clone(), &masses, |mass| self.mass() / mass)
    }

    /// A plan of the scaled motion as one of the transfer, with the states of its flight, whose end is so far from its own.
    fn left(&self, plan: Plan, states: Vec<BodyState>, apart: f64) -> Plan {
        let masses = Masses::new(self.transfer, self.mass(), &plan.commands);
        let certificate = Certificate {
            terminal: plan.certificate.terminal.max(apart),
            ..plan.certificate
        };
        let left = self.with_factors(plan, &masses, |mass| mass / self.mass());
        Plan {
            states,
            certificate,
            ..left
        }
    }

    fn left_error(&self, error: PlanError) -> PlanError {
        error.with_plan(|plan| {
            let states = fly(self.transfer, &self.forces(&plan.commands)).ok()?;
            Some(self.left(plan, states, 0.0))
        })
    }

    /// A plan whose states and commands are multiplied by a factor of the mass, and whose multipliers are divided by it.
    fn with_factors(&self, plan: Plan, masses: &Masses, factor: impl Fn(f64) -> f64) -> Plan {
        let actuation = &self.transfer.actuation;
        let (h, ends) = (plan.h, &masses.ends);
        let end = |k: usize| factor(ends[k.min(ends.len() - 1)]);
        let each = plan.commands.iter().zip(&masses.middles);
        let commands: Vec<Command> = each
            .map(|(w, middle)| open(w) * factor(*middle))
            .collect();
        let states = plan.states.iter().enumerate();
        let multipliers = plan.multipliers.iter().enumerate();
        Plan {
            states: states.map(|(k, state)| resized(state, end(k))).collect(),
            controls: commands.iter().map(|w| actuation.load(w)).collect(),
            multipliers: multipliers
                .map(|(k, multiplier)| {
                    let factor = end(k + 1);
                    SVector::from_fn(|row, _| match row / 3 {
                        1 | 3 => multiplier[row] / factor,
                        _ => multiplier[row],
                    })
                })
                .collect(),
            cost: commands.iter().map(|w| actuation.cost(h, w)).sum(),
            commands,
            feedback: Vec::new(),
            sweep: Sweep::default(),
            ..plan
        }
    }
}

/// A state with its momenta multiplied by a factor.
fn resized(state: &BodyState, factor: f64) -> BodyState {
    BodyState {
        linear_momentum: factor * state.linear_momentum,
        angular_momentum: factor * state.angular_momentum,
        ..*state
    }
}

/// [`crate::search`] for a transfer by thrusters that use propellant, among the minima of a body that does not lose mass.
pub(crate) fn search(
    transfer: &Transfer,
    settings: &SearchSettings,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Vec<Minimum>, PlanError> {
    let scaled = Scaled::new(transfer)?;
    let stated = scaled.stated(&scaled.untouched());
    let minima = search_stated(&stated, settings, &mut *observe)
        .map_err(|error| scaled.left_error(error))?;
    let mut found = Vec::new();
    let mut failure = None;
    for Minimum { plan, starts, .. } in minima {
        let states = plan.states.clone();
        let guess = scaled.left(plan, states, 0.0);
        match solve(transfer, Start::Warm(&guess), &settings.newton, observe) {
            Ok(plan) => count(&mut found, plan, starts),
            Err(error) => {
                let stopped = matches!(error, PlanError::Stopped { .. });
                failure = failure.or(Some(error));
                if stopped {
                    break;
                }
            }
        }
    }
    rank(&mut found);
    match failure {
        Some(error) if found.is_empty() => Err(error),
        _ => Ok(found),
    }
}

impl Transfer {
    /// Whether the commands use propellant.
    pub(crate) fn uses_propellant(&self) -> bool {
        let thrusters = self.body.thrusters().into_iter();
        let mut all = thrusters.flat_map(|thrusters| thrusters.thrusters());
        self.actuation.is_fixed_to_body() && all.any(|one| one.exhaust_velocity.is_finite())
    }

    /// The transfer of a body that has so much propellant left at its start. The momenta of the target remain those of the body
    /// with all its propellant.
    ///
    /// # Errors
    /// Returns an error if there is more than the body can have, or if it is not a number ≥ 0.
    pub fn with_propellant(mut self, left: f64) -> Result<Self, TransferError> {
        let thrusters = self.body.thrusters();
        let most = thrusters.map_or(0.0, |thrusters| thrusters.propellant().mass);
        if !(0.0..=most).contains(&left) {
            return Err(TransferError::Propellant { left, most });
        }
        self.body.set_propellant(left);
        Ok(self)
    }
}

impl Plan {
    /// The masses of the body of `transfer`, by which it was planned, at `0 … N`.
    pub fn masses(&self, transfer: &Transfer) -> Vec<f64> {
        if transfer.uses_propellant() {
            Masses::under(transfer, &self.commands).ends
        } else {
            vec![transfer.body.mass(); self.states.len()]
        }
    }
}
