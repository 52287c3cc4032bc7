use lgvi_control::{
    Actuation, Constraint, Dynamics, Motion, Terminal, Transfer, TransferError, shooting,
};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{BodyState, Load, Method};

use crate::{Scene, Scheme};

/// A controlled body that is to reach a target at the end of the run, or earlier.
#[derive(Clone, Debug, PartialEq)]
pub struct Maneuver {
    /// Which of the scene's bodies.
    pub body: usize,
    /// Where it may end.
    pub target: Terminal,
    /// What its commands do and cost.
    pub actuation: Actuation,
    /// The steps that it is planned in.
    pub dynamics: Dynamics,
    /// Whether the boundary states are those of the processed Lie–Euler method (§4.5).
    pub processed: bool,
    /// Which motions are planned.
    pub motion: Motion,
    /// What holds on the way.
    pub constraints: Vec<Constraint>,
    /// The range of durations; `None` where it is that of the run.
    pub final_time: Option<FinalTime>,
    /// How it is solved.
    pub solver: Solver,
    /// Where the best of several local minima is wanted.
    pub search: Option<Search>,
    /// Where it is planned anew in flight.
    pub replan: Option<Replan>,
    /// Whether feedback along the plan is flown.
    pub feedback: bool,
}

/// A duration that is found with the plan, as a whole number of the run's steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FinalTime {
    /// Steps of the shortest maneuver.
    pub min_steps: u64,
    /// Steps of the longest.
    pub max_steps: u64,
    /// What a unit of time costs, beside the commands.
    pub weight: f64,
}

/// How a maneuver is solved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Solver {
    /// The method.
    pub method: SolverMethod,
    /// Terminal error at which a plan is accepted; `None` for the method's own.
    pub tolerance: Option<f64>,
    /// Most iterations; `None` for the method's own.
    pub max_iterations: Option<u32>,
}

impl Solver {
    /// The settings of the shooting.
    pub fn shooting(&self) -> shooting::Settings {
        let defaults = shooting::Settings::default();
        shooting::Settings {
            tolerance: self.tolerance.unwrap_or(defaults.tolerance),
            max_iterations: self.max_iterations.unwrap_or(defaults.max_iterations),
            ..defaults
        }
    }
}

/// The methods that solve maneuvers.
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
    /// Starts of the solver.
    pub starts: u32,
    /// Of their random numbers.
    pub seed: u64,
}

/// Planning anew in flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Replan {
    /// Steps from one plan to the next.
    pub every: u64,
    /// Wall-clock time from the state that is planned from to the plan (s).
    pub deadline: f64,
}

impl Replan {
    /// The step that the plan made at `step` begins at in a flight in lockstep with its planner, whose steps last
    /// `step_size` (s): the one that real time would have reached by the deadline. `None` where no plan is made at `step`,
    /// and where fewer than [`Replan::every`] steps, or two, would be left to it before the arrival at step `arrival`.
    pub fn in_lockstep(&self, step: u64, step_size: f64, arrival: u64) -> Option<u64> {
        let due = step > 0 && step.is_multiple_of(self.every);
        let lead = (self.deadline / step_size).ceil().max(1.0) as u64;
        let first_step = step.checked_add(lead)?;
        let least = first_step.checked_add(self.every.max(2))?;
        (due && least <= arrival).then_some(first_step)
    }
}

impl Maneuver {
    /// What a control of one step `h` costs.
    pub fn interval_cost(&self, control: &Load, h: f64) -> f64 {
        self.actuation.cost_of(h, control)
    }
}

impl Scene {
    /// The optimal control problem of the scene's maneuver over the longest time it may take; `None` without one.
    pub fn transfer(&self) -> Option<Result<Transfer, TransferError>> {
        let maneuver = self.maneuver.as_ref()?;
        let steps = match maneuver.final_time {
            Some(FinalTime { max_steps, .. }) => max_steps,
            None => self.steps,
        };
        let initial = self.bodies[maneuver.body].state;
        self.transfer_from(initial, steps as usize)
    }

    /// That of the rest of a maneuver: from `initial` in `intervals` steps of the run; `None` without one.
    pub fn transfer_from(
        &self,
        initial: BodyState,
        intervals: usize,
    ) -> Option<Result<Transfer, TransferError>> {
        let maneuver = self.maneuver.as_ref()?;
        let transfer = Transfer::new(
            self.bodies[maneuver.body].body.clone(),
            self.gravity.on_body(maneuver.body, &self.bodies),
            self.h(),
            intervals,
            initial,
            maneuver.target.clone(),
            maneuver.actuation.clone(),
        );
        Some(transfer.map(|transfer| {
            transfer
                .with_dynamics(maneuver.dynamics)
                .with_motion(maneuver.motion)
                .with_constraints(&maneuver.constraints)
        }))
    }

    /// What is to be said where the maneuver is flown in other steps than it is planned in, and misses its target by what
    /// the two differ in. A processed plan is meant for other steps.
    pub fn flown_otherwise(&self, scheme: Scheme) -> Option<String> {
        let maneuver = self.maneuver.as_ref()?;
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
