//! Warm starts from the plan of the same transfer from a nearby state.

use nalgebra::{SMatrix, SVector};

use super::attempt::Solver;
use super::class::Class;
use super::error::PlanError;
use super::progress::Phase;
use crate::discrete::DiscreteDynamics;
use crate::newton::{Ended, Iterate, Newton, Policies, Problem};
use crate::problem::TerminalSet;
use crate::riccati::Scale;
use crate::sweep::Known;
use crate::units::Units;
use crate::{MAX_COMMANDS, Plan, Sweep};

/// Distance from the plan that the policies were computed for, relative to the size of each quantity, up to which its
/// gains, condition and convexity hold: gains change by about as much.
const NEIGHBORING: f64 = 1e-2;

/// The part of that plan up to which its gains hold: they are softer near the end of a longer flight.
const FLOWN: f64 = 0.25;

/// What a plan takes over from the plan before.
pub(super) struct Inherited {
    pub(super) feedback: Vec<SMatrix<f64, 6, 12>>,
    pub(super) actuator_feedback: Vec<SMatrix<f64, MAX_COMMANDS, 12>>,
    pub(super) sweep: Sweep,
}

/// Where the policies of a plan lead.
pub(super) enum Neighbor<const X: usize, const U: usize> {
    /// To a plan.
    Plan(Box<Newton<X, U>>),
    /// To a guess.
    Guess(Box<Newton<X, U>>),
}

impl<C> Solver<'_, C> {
    /// Plans from `plan` by its own policies, which lead to the neighboring extremal to first order. Returns `None` if
    /// they are not known or cannot be flown.
    pub(super) fn neighboring<const X: usize, const U: usize>(
        &mut self,
        plan: &Plan,
    ) -> Result<Option<Neighbor<X, U>>, PlanError>
    where
        C: Class<X, U>,
    {
        let transfer = self.transfer;
        let intervals = transfer.intervals;
        let lengths = [plan.commands.len(), plan.feedback.len()];
        if lengths != [intervals; 2] || plan.states.len() != intervals + 1 {
            return Ok(None);
        }
        let Some(Known {
            mut policies,
            units,
            nu,
            strayed,
            flown,
        }) = plan.sweep.of::<X, U>(transfer)
        else {
            return Ok(None);
        };
        let own = self.scale(transfer.terminal.units());
        if units != *transfer.terminal.units() {
            policies.convert(&self.scale(&units).over(&own));
        }
        let commands = plan.commands.iter().map(|w| self.class.narrowed(w));
        let planned = Iterate {
            states: plan.states.clone(),
            commands: commands.collect(),
            nu: nu.component_div(&own.multipliers()),
        };
        let steps = self.class.steps(transfer)?;
        let problem = self.problem(transfer, &steps);
        let mut newton = Newton::neighboring(&problem, policies, planned);
        if newton.fly_by(&problem, &mut self.standing).is_none() {
            return Ok(None);
        }
        let apart = self.apart(&problem, plan, &newton.iterate);
        let strayed = strayed + apart;
        // The negated comparison also rejects NaN.
        if !(strayed <= NEIGHBORING && flown <= FLOWN) {
            return Ok(Some(Neighbor::Guess(Box::new(newton))));
        }
        // The error of the policies.
        self.standing.stationarity = strayed;
        let observe = &mut *self.observe;
        let ended = newton.settle(&problem, &self.tolerances, &mut self.standing, |now| {
            observe(&now.progress(Phase::Fine))
        });
        match ended {
            Some(Ended::Converged) => (),
            Some(Ended::Stopped) => return Err(self.unsolved(Ended::Stopped, &newton.iterate)?),
            _ => return Ok(Some(Neighbor::Guess(Box::new(newton)))),
        }
        self.inherited = Some(Inherited {
            feedback: plan.feedback.clone(),
            actuator_feedback: plan.actuator_feedback.clone(),
            sweep: plan
                .sweep
                .moved(apart, &newton.iterate.nu.component_mul(&own.multipliers())),
        });
        Ok(Some(Neighbor::Plan(Box::new(newton))))
    }

    /// The units of the class.
    fn scale<const X: usize, const U: usize>(&self, units: &Units) -> Scale<X, U>
    where
        C: Class<X, U>,
    {
        let own = |all: SVector<f64, 12>| all.fixed_rows::<X>(C::FIRST).into_owned();
        let commands = self.class.narrowed(units.commands());
        Scale {
            variations: own(units.variations()),
            // Commands that are not used have no unit.
            commands: commands.map(|unit| if unit > 0.0 { unit } else { 1.0 }),
            conditions: own(TerminalSet::new(&self.transfer.target, units).rows()),
            cost: units.cost(),
        }
    }

    /// The largest difference of an iterate's states from those of a plan, or of its commands relative to the largest
    /// command.
    fn apart<S, const X: usize, const U: usize>(
        &self,
        problem: &Problem<'_, S, C::Ending, X, U>,
        plan: &Plan,
        iterate: &Iterate<X, U>,
    ) -> f64
    where
        S: DiscreteDynamics<X, U>,
        C: Class<X, U>,
    {
        let states = plan.states.iter().zip(&iterate.states);
        let states = states.map(|(from, to)| problem.steps.difference(from, to).norm());
        let size = |w: SVector<f64, U>| w.component_div(&problem.command_units).amax();
        let largest = iterate
            .commands
            .iter()
            .map(|w| size(*w))
            .fold(0.0, f64::max);
        let commands = plan.commands.iter().zip(&iterate.commands);
        let commands = commands.map(|(from, to)| size(to - self.class.narrowed(from)));
        let commands = commands.fold(0.0, f64::max);
        let commands = if commands > 0.0 {
            commands / largest
        } else {
            0.0
        };
        states.fold(commands, f64::max)
    }

    /// The policies of an iteration that ended at a plan, for the next plan.
    pub(super) fn kept<S, const X: usize, const U: usize>(
        &self,
        problem: &Problem<'_, S, C::Ending, X, U>,
        newton: &mut Newton<X, U>,
        strayed: f64,
    ) -> Sweep
    where
        C: Class<X, U>,
    {
        let units = self.scale(self.transfer.terminal.units());
        let nu = newton.iterate.nu.component_mul(&units.multipliers());
        match Policies::with_margin(problem, newton) {
            Some(policies) => Sweep::new(self.transfer, policies, &nu, strayed),
            None => Sweep::default(),
        }
    }
}
