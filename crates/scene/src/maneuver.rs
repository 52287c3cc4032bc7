use std::sync::Arc;

use lgvi_control::constraint::CommandLimit;
use lgvi_control::{
    Actuation, Allocation, Chances, Command, Constraint, Dynamics, Motion, Terminal, Transfer,
    TransferError, shooting,
};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::thrusters::Thrusters;
use lgvi_dynamics::{BodyState, Load, Method};

use crate::compile::Relative;
use crate::{Phase, Scene, Scheme, Stated};

/// A controlled body that has to reach a target by the end of the run.
#[derive(Clone, Debug, PartialEq)]
pub struct Maneuver {
    /// Index of the controlled body in the scene.
    pub body: usize,
    /// Set of final states in which it may end.
    pub target: Terminal,
    /// True if the target is relative to another body, whose motion is predicted.
    pub predicted: bool,
    /// Target and constraints as the file states them, if any is relative to another body.
    pub(crate) relative: Option<Arc<Relative>>,
    /// Effects and costs of its commands.
    pub actuation: Actuation,
    /// Discrete dynamics of the plan.
    pub dynamics: Dynamics,
    /// True if the boundary states belong to the processed Lie–Euler method (§4.5).
    pub processed: bool,
    /// The planned motions.
    pub motion: Motion,
    /// Constraints along the path.
    pub constraints: Vec<Constraint>,
    /// Phases that follow each other; none if the maneuver has a single leg.
    pub phases: Vec<Phase>,
    /// The probability with which constraints on states hold, or `None` if they hold for the nominal flight.
    pub chances: Option<Chances>,
    /// The limits of the body's thrusters or wheels, if these are the commands, or that of its engine.
    pub actuator_limit: Option<Constraint>,
    /// Range of durations, or `None` if the duration is fixed to that of the run.
    pub final_time: Option<FinalTime>,
    /// Settings of the solver.
    pub solver: Solver,
    /// Search for the best of several local minima, if wanted.
    pub search: Option<Search>,
    /// Replanning in flight, if wanted.
    pub replan: Option<Replan>,
    /// True if the flight applies feedback along the plan.
    pub feedback: bool,
    /// The least distance between the planned bodies, if there are several.
    pub separation: Option<f64>,
    /// The parts of other bodies that are planned together with this one; they have no companions of their own.
    pub companions: Vec<Maneuver>,
}

/// A free duration, optimized with the plan as a whole number of the run's steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FinalTime {
    /// Steps of the shortest maneuver.
    pub min_steps: u64,
    /// Steps of the longest maneuver.
    pub max_steps: u64,
    /// Cost of a unit of time, in addition to the cost of the commands.
    pub weight: f64,
    /// What is minimized.
    pub minimize: Minimize,
}

/// What a free duration minimizes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Minimize {
    /// The cost of the commands and of time.
    #[default]
    Cost,
    /// The duration.
    Time,
}

/// Solver of a maneuver.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Solver {
    /// The method.
    pub method: SolverMethod,
    /// Terminal error below which a plan is accepted, or `None` for the method's default.
    pub tolerance: Option<f64>,
    /// Maximum number of iterations, or `None` for the method's default.
    pub max_iterations: Option<u32>,
}

impl Solver {
    /// Returns the settings of the shooting method.
    pub fn shooting(&self) -> shooting::Settings {
        let defaults = shooting::Settings::default();
        shooting::Settings {
            tolerance: self.tolerance.unwrap_or(defaults.tolerance),
            max_iterations: self.max_iterations.unwrap_or(defaults.max_iterations),
            ..defaults
        }
    }
}

/// The available solvers of maneuvers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SolverMethod {
    /// Structured Newton iteration on all steps.
    #[default]
    Newton,
    /// Newton–Armijo shooting on the initial multipliers (§4.6).
    Shooting,
}

/// A search for the best of several local minima.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Search {
    /// Number of starts of the solver.
    pub starts: u32,
    /// Seed of the random starts.
    pub seed: u64,
}

/// Replanning in flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Replan {
    /// Steps from one plan to the next.
    pub every: u64,
    /// Wall-clock time from the state at which a plan starts to its delivery (s).
    pub deadline: f64,
}

impl Replan {
    /// Returns the first step of the plan made at `step` in a flight in lockstep with its planner: the step that real
    /// time would have reached by the deadline, with steps of length `step_size` (s). Returns `None` if no plan is made
    /// at `step`, or if fewer than [`Replan::every`] steps, and at least two, would remain before the arrival at step
    /// `arrival`.
    pub fn in_lockstep(&self, step: u64, step_size: f64, arrival: u64) -> Option<u64> {
        let due = step > 0 && step.is_multiple_of(self.every);
        let lead = (self.deadline / step_size).ceil().max(1.0) as u64;
        let first_step = step.checked_add(lead)?;
        let least = first_step.checked_add(self.every.max(2))?;
        (due && least <= arrival).then_some(first_step)
    }
}

/// What the commands of a maneuver are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Commands {
    /// Force and moment, or actuators that exert them.
    Loads,
    /// The forces of the body's thrusters.
    Thrusters,
    /// The torques of the body's reaction wheels.
    Wheels,
}

impl Commands {
    /// Their name in scenes, which force and moment do not have.
    pub fn name(self) -> &'static str {
        match self {
            Self::Loads => "none",
            Self::Thrusters => "thrusters",
            Self::Wheels => "wheels",
        }
    }
}

impl Maneuver {
    /// Returns true if its target or a constraint is relative to another body.
    pub fn is_relative(&self) -> bool {
        self.relative.is_some()
    }

    /// Returns the part of each planned body: this one, then its companions.
    pub fn planned(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(&self.companions)
    }

    /// Returns what the commands are.
    pub fn commands(&self) -> Commands {
        match self.actuator_limit {
            Some(_) if self.actuation.is_of_wheels() => Commands::Wheels,
            Some(_) if self.actuation.is_fixed_to_body() => Commands::Thrusters,
            _ => Commands::Loads,
        }
    }

    /// The number of thrusters or wheels that it commands; 0 if it commands force and moment.
    pub fn actuators(&self) -> usize {
        match self.commands() {
            Commands::Loads => 0,
            Commands::Thrusters | Commands::Wheels => self.actuation.commands(),
        }
    }

    /// The thrusters or wheels that it commands, with their limits; `None` if it commands force and moment.
    pub fn allocation(&self) -> Option<Allocation> {
        let limit = self.actuator_limit.as_ref()?;
        let limits = limit.downcast_ref::<CommandLimit>()?.limit();
        let least = |most: f64| match self.commands() {
            Commands::Thrusters => 0.0,
            Commands::Loads | Commands::Wheels => -most,
        };
        let limits = limits.iter().take(self.actuators());
        let limits = limits.map(|&most| [least(most), most]);
        Some(Allocation::new(&self.actuation, limits))
    }

    /// Returns true if the commands are the forces of the body's thrusters.
    pub fn by_thrusters(&self) -> bool {
        self.commands() == Commands::Thrusters
    }

    /// Returns true if the forces of the maneuver are those of the body's engine.
    pub fn by_engine(&self, scene: &Scene) -> bool {
        self.motion != Motion::Rotation && scene.bodies[self.body].has_engine()
    }

    /// Returns true if what the commands exert makes the body lighter.
    pub fn uses_propellant(&self, scene: &Scene) -> bool {
        (self.by_thrusters() || self.by_engine(scene)) && scene.bodies[self.body].has_propellant()
    }

    /// Returns the cost of a force and moment over one step `h`.
    pub fn interval_cost(&self, control: &Load, h: f64) -> f64 {
        self.actuation.cost_of(h, control)
    }

    /// Returns the cost of the forces of thrusters, or of the torques of wheels, over one step `h`.
    pub fn effort_cost(&self, efforts: impl Iterator<Item = f64>, h: f64) -> f64 {
        let mut command = Command::zeros();
        for (command, effort) in command.iter_mut().zip(efforts) {
            *command = effort;
        }
        self.actuation.cost(h, &command)
    }
}

impl Scene {
    /// Returns the optimal control problem of the scene's maneuver with the longest allowed duration, or `None` without
    /// a maneuver.
    pub fn transfer(&self) -> Option<Result<Transfer, TransferError>> {
        let maneuver = self.maneuver.as_ref()?;
        let steps = match maneuver.final_time {
            Some(FinalTime { max_steps, .. }) => max_steps,
            None => self.steps,
        };
        let initial = self.bodies[maneuver.body].state;
        self.transfer_from(initial, steps as usize)
    }

    /// Returns the optimal control problems of all planned bodies, which are planned together, or `None` without a maneuver.
    pub fn transfers(&self) -> Option<Result<Vec<Transfer>, TransferError>> {
        let maneuver = self.maneuver.as_ref()?;
        let initial = |planned: &Maneuver| self.bodies[planned.body].state;
        let initial: Vec<_> = maneuver.planned().map(initial).collect();
        Some(self.transfers_of(maneuver, &initial, self.steps as usize))
    }

    /// Returns [`Scene::transfers`] of the rest of a maneuver of the scene that may have been
    /// [predicted anew](Scene::maneuver_seen), from the states of its bodies in `intervals` steps of the run.
    pub fn transfers_of(
        &self,
        maneuver: &Maneuver,
        initial: &[BodyState],
        intervals: usize,
    ) -> Result<Vec<Transfer>, TransferError> {
        let planned = maneuver.planned().zip(initial);
        planned
            .map(|(planned, initial)| self.transfer_of(planned, *initial, intervals, &[]))
            .collect()
    }

    /// Returns the name of a planned body, which is counted as [`Maneuver::planned`] does.
    pub fn planned_name(&self, planned: usize) -> &str {
        let mut all = self.maneuver.iter().flat_map(Maneuver::planned);
        all.nth(planned)
            .map_or("", |maneuver| &self.bodies[maneuver.body].name)
    }

    /// Returns the optimal control problem of the rest of a maneuver, from `initial` in `intervals` steps of the run,
    /// or `None` without a maneuver. Phases whose lengths are to be found last for a share of their ranges.
    pub fn transfer_from(
        &self,
        initial: BodyState,
        intervals: usize,
    ) -> Option<Result<Transfer, TransferError>> {
        let maneuver = self.maneuver.as_ref()?;
        let switches = maneuver.proportional_switches(self.steps);
        Some(self.transfer_of(maneuver, initial, intervals, &switches))
    }

    /// Returns [`Scene::transfer_from`] of a maneuver of the scene that may have been [predicted anew](Scene::maneuver_seen),
    /// whose phases after the first begin at the steps `switches` of the run.
    pub fn transfer_of(
        &self,
        maneuver: &Maneuver,
        initial: BodyState,
        intervals: usize,
        switches: &[u64],
    ) -> Result<Transfer, TransferError> {
        // The rest of the run: constraints that change with time are those of then.
        let first_step = self.steps.saturating_sub(intervals as u64);
        let all = self
            .constraints_from(maneuver, first_step, switches)
            .into_iter();
        let constraints = all.map(|Stated { constraint, .. }| constraint);
        let constraints: Vec<_> = constraints.chain(maneuver.actuator_limit.clone()).collect();
        let transfer = Transfer::new(
            self.bodies[maneuver.body].body.clone(),
            self.gravity.on_body(maneuver.body, &self.bodies),
            self.h(),
            intervals,
            initial,
            maneuver.target.clone(),
            maneuver.actuation.clone(),
        );
        transfer.and_then(|transfer| {
            let transfer = transfer
                .with_dynamics(maneuver.dynamics)
                .with_motion(maneuver.motion)
                .with_constraints(&constraints);
            let transfer = match maneuver.chances {
                Some(chances) => transfer.with_chances(chances),
                None => transfer,
            };
            let mut schedule = maneuver.schedule(switches, self.steps);
            schedule.try_fold(transfer, |transfer, (phase, bounds)| {
                let [begin, end] = bounds.map(|step| step.saturating_sub(first_step) as usize);
                match phase.off.is_empty() || begin == end {
                    true => Ok(transfer),
                    false => transfer.without_commands(begin..end, &phase.off),
                }
            })
        })
    }

    /// Returns a warning if the flight uses other steps than the plan, or thrusters with pulses and delays. The
    /// maneuver then misses its target by the difference. A processed plan is meant for other steps and gives no warning.
    pub fn flown_otherwise(&self, scheme: Scheme) -> Option<String> {
        let maneuver = self.maneuver.as_ref()?;
        let pulsed = |one: &Maneuver| one.by_thrusters() && self.has_pulses(one.body);
        let pulsed = maneuver.planned().any(pulsed).then(|| {
            "the plan neglects the pulses and delays of the thrusters: it will miss its target"
                .into()
        });
        let otherwise = self.in_other_steps(maneuver, scheme);
        match (otherwise, pulsed) {
            (Some(otherwise), Some(pulsed)) => Some(format!("{otherwise}; {pulsed}")),
            (otherwise, pulsed) => otherwise.or(pulsed),
        }
    }

    /// Returns a warning if the flight uses other steps than the plan.
    fn in_other_steps(&self, maneuver: &Maneuver, scheme: Scheme) -> Option<String> {
        let planned = match (maneuver.dynamics, scheme.method) {
            _ if maneuver.processed => return None,
            (Dynamics::LieEuler, Method::LieEuler(Rotor::Discrete))
            | (Dynamics::Lgvi, Method::Lgvi(Rotor::Discrete))
                if scheme.substeps == 1 =>
            {
                return None;
            }
            (Dynamics::LieEuler, _) => "Lie–Euler",
            (Dynamics::Lgvi, _) => "LGVI",
        };
        let Scheme {
            method, substeps, ..
        } = scheme;
        Some(format!(
            "the maneuver is planned in {planned} steps and flown by {method} with {substeps} substeps: \
             it will miss its target"
        ))
    }
}

impl Scene {
    /// Returns true if thrusters of a body do not follow their commands in each step.
    fn has_pulses(&self, body: usize) -> bool {
        let thrusters = self.bodies[body].body.thrusters();
        let mut each = thrusters.into_iter().flat_map(Thrusters::thrusters);
        each.any(|one| {
            one.pulse_period >= 1.5 * self.h() || one.minimum_impulse > 0.0 || one.delay > 0.0
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn in_lockstep_a_plan_begins_where_real_time_would_be_at_its_deadline() {
        let replan = Replan {
            every: 10,
            deadline: 0.25,
        };
        let begins = |step| replan.in_lockstep(step, 0.1, 60);
        assert_eq!(begins(0), None, "the first plan is there");
        assert_eq!(begins(9), None);
        assert_eq!(begins(10), Some(13));
        assert_eq!(begins(40), Some(43));
        assert_eq!(begins(50), None, "7 steps would be left to it");
        assert_eq!(replan.in_lockstep(40, 0.025, 60), Some(50));
        assert_eq!(replan.in_lockstep(40, 0.024, 60), None);
        assert_eq!(replan.in_lockstep(10, 1e300, u64::MAX), Some(11));
        assert_eq!(replan.in_lockstep(10, 1e-300, u64::MAX), None);
    }
}
