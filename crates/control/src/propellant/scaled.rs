//! The scaled motion of a transfer, to which its plans are entered and which they leave.

use std::sync::Arc;

use lgvi_dynamics::{BodyState, Load};
use nalgebra::SVector;

use super::along::Along;
use super::ejection;
use super::flight::fly;
use super::flows::Flows;
use super::masses::Masses;
use crate::discrete::{DecouplingError, KickDriftKick};
use crate::problem::{ByStep, block};
use crate::solver::{PlanError, command_forces};
use crate::units::Units;
use crate::{Certificate, Command, Dynamics, MAX_COMMANDS, Motion, Plan, Sweep, Transfer, miss};

/// The part of the largest flow up to which a command is too small for its direction to count.
const SMALL: f64 = 1e-6;

/// A transfer as one of its scaled motion.
pub(super) struct Scaled<'t> {
    transfer: &'t Transfer,
    /// The transfer with all propellant.
    full: Transfer,
    flows: Flows,
}

impl<'t> Scaled<'t> {
    pub(super) fn new(transfer: &'t Transfer) -> Result<Self, PlanError> {
        let (dynamics, motion) = (transfer.dynamics, transfer.motion);
        let halved = motion != Motion::Full && transfer.actuation.is_fixed_to_body();
        if dynamics != Dynamics::Lgvi || halved {
            return Err(PlanError::PropellantDoes { dynamics, motion });
        }
        let mut full = transfer.clone();
        if let Some(thrusters) = transfer.body.thrusters() {
            full.body.set_propellant(thrusters.propellant().mass);
        }
        let factor = full.body.mass() / transfer.body.mass();
        full.initial = resized(&transfer.initial, factor);
        Ok(Self {
            transfer,
            full,
            flows: Flows::of(transfer),
        })
    }

    /// `M`
    fn mass(&self) -> f64 {
        self.full.body.mass()
    }

    pub(super) fn stated(&self, along: &Along) -> Transfer {
        let costs = along.costs.iter().zip(&along.flows);
        let by_step = ByStep {
            limits: along.masses.iter().map(|mass| libm::exp(-mass)).collect(),
            costs: costs.map(|(cost, flows)| *cost * flows).collect(),
            loads: along.loads.clone(),
        };
        Transfer {
            by_step: Some(Arc::new(by_step)),
            ..self.full.clone()
        }
    }

    /// What a plan makes of the transfer in which this part of the propellant flows out evenly, at no cost.
    pub(super) fn with_even_use(&self, part: f64) -> Along {
        let steps = self.transfer.intervals;
        let (mass, left) = (self.transfer.body.mass(), self.available());
        let middle = |step: usize| mass - part * left * (step as f64 + 0.5) / steps as f64;
        Along {
            masses: (0..steps)
                .map(|step| libm::log(middle(step) / self.mass()))
                .collect(),
            costs: vec![0.0; steps],
            flows: vec![Command::zeros(); steps],
            loads: vec![[Load::default(); 2]; steps],
            size: 1.0,
        }
    }

    /// The propellant at the start.
    fn available(&self) -> f64 {
        let thrusters = self.transfer.body.thrusters();
        thrusters.map_or(0.0, |thrusters| thrusters.propellant_left())
    }

    /// What a plan of the scaled motion makes of the transfer.
    ///
    /// # Errors
    /// Returns an error if the plan uses more than the whole body, or if one of its steps cannot be made.
    pub(super) fn along(&self, plan: &Plan) -> Result<Along, PlanError> {
        let (transfer, mass) = (self.transfer, self.mass());
        let masses = Masses::new(transfer, mass, &plan.commands);
        if !masses.are_positive() {
            let (needed, available) = (masses.used(), self.available());
            return Err(PlanError::Propellant { needed, available });
        }
        let thrusts = self.forces(&plan.commands);
        let mut along = Along {
            masses: masses
                .middles
                .iter()
                .map(|middle| libm::log(middle / mass))
                .collect(),
            loads: ejection::loads(transfer, mass, &masses, &plan.states, &thrusts),
            ..self.with_even_use(0.0)
        };
        let forces = if plan.multipliers.is_empty() {
            vec![Command::zeros(); plan.commands.len()]
        } else {
            command_forces(&self.stated(&along), plan)?
        };
        let (actuation, h) = (&transfer.actuation, transfer.h);
        let each = plan.commands.iter().zip(&forces);
        let held = each.map(|(w, force)| force.dot(w) - h * actuation.rate(w));
        let held: Vec<_> = held.collect();
        along.costs = masses.costs(&held, &self.drag_costs(plan, &along)?);
        let largest = plan.commands.iter().map(|w| self.flows.rate(w));
        let small = SMALL * largest.fold(0.0, f64::max);
        // The direction of the command, or that of `−Bᵀ λ`, along which one would act.
        let direction = |(w, force): (&Command, &Command)| {
            if self.flows.rate(w) > small {
                *w
            } else if actuation.minimizes_fuel() {
                *force
            } else {
                force + h * (actuation.weight() * w)
            }
        };
        let directions = plan.commands.iter().zip(&forces).map(direction);
        along.flows = directions
            .map(|direction| self.flows.gradient(&direction) / mass)
            .collect();
        let sizes = forces
            .iter()
            .map(|force| self.flows.largest(force) * mass / h);
        along.size = sizes.fold(f64::MIN_POSITIVE, f64::max);
        Ok(along)
    }

    /// The derivatives of the Lagrangian by the logarithm of the mass in each step through the drag alone.
    fn drag_costs(&self, plan: &Plan, along: &Along) -> Result<Vec<f64>, PlanError> {
        let stated = self.stated(along);
        if stated.body.drag().is_none() || plan.multipliers.is_empty() {
            return Ok(vec![0.0; plan.commands.len()]);
        }
        let steps = KickDriftKick::<_, 2, MAX_COMMANDS>::full(&stated);
        let each = plan.states.iter().zip(&plan.commands);
        let each = each.zip(&plan.multipliers).enumerate();
        let cost = |(step, ((state, command), lambda))| {
            let by_density = steps.by_density(step, state, command, lambda);
            let by_density =
                by_density.map_err(|source| DecouplingError::Unsolvable { step, source })?;
            Ok(-by_density)
        };
        each.map(cost).collect()
    }

    /// The commands of the transfer for those of the scaled motion.
    pub(super) fn forces(&self, commands: &[Command]) -> Vec<Command> {
        let masses = Masses::new(self.transfer, self.mass(), commands);
        let each = commands.iter().zip(&masses.middles);
        each.map(|(w, middle)| self.flows.open(w) * (middle / self.mass()))
            .collect()
    }

    pub(super) fn check_propellant(&self, plan: &Plan) -> Result<(), PlanError> {
        let needed = Masses::new(self.transfer, self.mass(), &plan.commands).used();
        let available = self.available();
        if needed > available {
            return Err(PlanError::Propellant { needed, available });
        }
        Ok(())
    }

    /// The difference of the ends of a plan of the scaled motion and of a flight, relative to the size of each quantity.
    pub(super) fn distance(&self, stated: &Transfer, plan: &Plan, flown: &[BodyState]) -> f64 {
        let masses = Masses::new(self.transfer, self.mass(), &plan.commands);
        let ends = plan.states.last().zip(flown.last()).zip(masses.ends.last());
        ends.map_or(0.0, |((planned, flown), mass)| {
            let flown = resized(flown, self.mass() / mass);
            let apart = miss(planned, &flown).component_div(&Units::of(stated).variations());
            let blocks = match self.transfer.motion {
                Motion::Translation => 0..2,
                _ => 0..4,
            };
            blocks
                .map(|which| block(&apart, which).norm())
                .fold(0.0, f64::max)
        })
    }

    /// A plan of the transfer as one of the scaled motion; `None` if it uses more than the whole body.
    pub(super) fn entered(&self, plan: &Plan) -> Option<Plan> {
        let masses = Masses::under(self.transfer, &plan.commands);
        let entered = || self.with_factors(plan.clone(), &masses, |mass| self.mass() / mass);
        masses.are_positive().then(entered)
    }

    /// A plan of the scaled motion as one of the transfer, with the states of its flight, whose end is so far from its own.
    pub(super) fn left(&self, plan: Plan, states: Option<Vec<BodyState>>, apart: f64) -> Plan {
        let masses = Masses::new(self.transfer, self.mass(), &plan.commands);
        let certificate = Certificate {
            terminal: plan.certificate.terminal.max(apart),
            ..plan.certificate
        };
        let left = self.with_factors(plan, &masses, |mass| mass / self.mass());
        Plan {
            states: states.unwrap_or(left.states),
            certificate,
            ..left
        }
    }

    pub(super) fn left_error(&self, error: PlanError) -> PlanError {
        error.with_plan(|plan| {
            let states = fly(self.transfer, &self.forces(&plan.commands)).ok()?;
            Some(self.left(plan, Some(states), 0.0))
        })
    }

    /// A plan whose states and commands are multiplied by a factor of the mass, and whose multipliers are divided by it.
    fn with_factors(&self, plan: Plan, masses: &Masses, factor: impl Fn(f64) -> f64) -> Plan {
        let actuation = &self.transfer.actuation;
        let (h, ends) = (plan.h, &masses.ends);
        let end = |k: usize| factor(ends[k.min(ends.len() - 1)]);
        let each = plan.commands.iter().zip(&masses.middles);
        let commands: Vec<Command> = each
            .map(|(w, middle)| self.flows.open(w) * factor(*middle))
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
            actuator_feedback: Vec::new(),
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
