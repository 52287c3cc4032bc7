//! What the worker does: a task in, a plan out, by the method that the scene asks for.

mod duration;
mod formation;
mod phases;
mod shooting;
mod shortest;
#[cfg(test)]
mod tests;
mod violated;

use std::borrow::Cow;
use std::fmt::Display;
use std::sync::Arc;

use lgvi_control::processing::{ProcessingError, flown, processed};
use lgvi_control::{
    Certificate, Minimum, NewtonSettings, Phase, Plan, PlanError, Progress, SearchSettings, Start,
    Transfer, Winding,
};
use lgvi_dynamics::thrusters::Thrusters;
use lgvi_dynamics::wheels::Wheels;
use lgvi_dynamics::{BodyState, RigidBody};
use lgvi_scene::{Commands, FinalTime, Maneuver, Minimize, Scene, Search, Solver, SolverMethod};
use tracing::info;

use self::violated::Violated;
#[cfg(feature = "node")]
use crate::prediction::Forecast;

const NO_MANEUVER: &str = "the scene has no maneuver";
const LATER: &str =
    "a plan for wheels can begin only at step 0 here: their momenta later are not known";
const LIGHTER: &str = "a plan that uses propellant can begin only at step 0 here: how much is left later is not known";
const LATER_PHASES: &str = "the lengths of the phases are found for the whole maneuver only: a later plan keeps those of an earlier one";

/// What is said of a plan whose certificate is not sufficient.
pub(crate) const NOT_MINIMUM: &str = "the plan is stationary, but not known to be a local minimum: a cheaper one may be \
                                      near, and `maneuver.search` may find it";

/// The same of plans that are made in flight.
pub(crate) const NOT_MINIMUM_IN_FLIGHT: &str =
    "a plan made in flight is stationary, but not known to be a local minimum";

/// What is to be planned.
#[derive(Clone, Debug)]
pub(crate) struct Task {
    /// The step that the plan begins at.
    pub(crate) first_step: u64,
    /// The body's state there.
    pub(crate) initial: Initial,
    /// When it is to arrive.
    pub(crate) end: End,
    /// What to start from.
    pub(crate) guess: Option<Guess>,
    /// The steps at which the phases after the first begin; where it is `None`, they are found.
    pub(crate) switches: Option<Vec<u64>>,
}

impl Task {
    /// Whether the lengths of phases are to be found.
    fn finds_phases(&self, maneuver: &Maneuver) -> bool {
        self.switches.is_none() && maneuver.has_free_phases()
    }

    /// The whole maneuver, from the scene's state.
    pub(crate) fn whole(scene: &Scene, maneuver: &Maneuver) -> Self {
        Self {
            first_step: 0,
            initial: Initial::State(scene.bodies[maneuver.body].state),
            end: match maneuver.final_time {
                Some(range) => End::Free(range),
                None => End::After(scene.steps as usize),
            },
            guess: None,
            switches: None,
        }
    }
}

/// The state that a plan begins in.
#[derive(Clone, Debug)]
pub(crate) enum Initial {
    /// This one.
    State(BodyState),
    /// That in which the flight will be.
    #[cfg(feature = "node")]
    Forecast(Box<Forecast>),
}

/// The state of a body at the start of a plan, with what its actuators are in.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Predicted {
    /// The state of the body.
    pub(crate) state: BodyState,
    /// The propellant that it has left, if it has any.
    pub(crate) propellant: Option<f64>,
    /// The axial momenta of its wheels.
    pub(crate) wheel_momenta: Vec<f64>,
}

impl Predicted {
    /// Of a body with these actuators in this state.
    pub(crate) fn of(body: &RigidBody, state: BodyState) -> Self {
        let wheels = body.wheels().into_iter().flat_map(Wheels::states);
        Self {
            state,
            propellant: body.thrusters().map(Thrusters::propellant_left),
            wheel_momenta: wheels.map(|wheel| wheel.momentum).collect(),
        }
    }
}

/// An earlier plan, of which a part will have been flown.
#[derive(Clone, Debug)]
pub(crate) struct Guess {
    /// The plan.
    pub(crate) plan: Arc<Plan>,
    /// Its intervals before the new one begins.
    pub(crate) flown: usize,
}

/// When a plan is to arrive.
#[derive(Clone, Copy, Debug)]
pub(crate) enum End {
    /// After so many steps.
    After(usize),
    /// When it is best.
    Free(FinalTime),
}

/// Where the solver is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// Newton iterations so far.
    pub iteration: u32,
    /// Trial points or trajectories so far.
    pub trials: u32,
    /// Accepted part of the last step.
    pub step_length: f64,
    /// Norm of what the conditions are missed by, relative to the size of each quantity.
    pub violation: f64,
    /// How far it is from optimal; 0 where the method does not say.
    pub stationarity: f64,
    /// The objective.
    pub cost: f64,
    /// Condition number of the plan that it has led to; 0 where there is none, or the method does not say.
    pub condition: f64,
    /// Whether that plan is known to be a strict local minimum.
    pub sufficient: bool,
    /// Largest violation of a constraint that has a price, of that plan.
    pub priced: f64,
    /// What its violations cost.
    pub paid: f64,
    /// What it is at.
    pub phase: &'static str,
}

impl Iteration {
    /// Before the first.
    pub(crate) const NONE: Self = Self {
        iteration: 0,
        trials: 0,
        step_length: 1.0,
        violation: f64::INFINITY,
        stationarity: 0.0,
        cost: f64::INFINITY,
        condition: 0.0,
        sufficient: false,
        priced: 0.0,
        paid: 0.0,
        phase: "",
    };
}

/// Why there is no plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// No plan meets the inequalities, as far as is known.
    Infeasible,
    /// The iterations are used up, or none makes progress.
    NotConverged,
    /// The time is used up.
    Deadline,
    /// Somebody asked for its end.
    Cancelled,
    /// The task makes no sense.
    Refused,
}

/// How a task ended with a plan.
#[derive(Clone, Debug)]
pub(crate) struct Solved {
    pub(crate) plan: Plan,
    /// Those of the companions, in their order.
    pub(crate) companions: Vec<Plan>,
    /// The maneuver as it was seen in flight, if other bodies have a part in it.
    pub(crate) seen: Option<Arc<Maneuver>>,
    /// Which of several plans it is, how its commands switch, which soft constraints it violates, and whether it may be no minimum;
    /// empty where none is to be said.
    pub(crate) remark: String,
    /// Its phases.
    pub(crate) phased: Phased,
}

/// When the phases of a plan begin, and what it took to find that; empty without phases.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Phased {
    /// The steps of the run at which the phases after the first begin.
    pub(crate) switches: Vec<u64>,
    /// Number of schedules that were planned.
    pub(crate) schedules: u32,
    /// Number of times that a transfer was solved.
    pub(crate) solves: u32,
}

impl Solved {
    /// A plan of one body in a single leg.
    fn new(plan: Plan, remark: String) -> Self {
        Self {
            plan,
            companions: Vec::new(),
            seen: None,
            remark,
            phased: Phased::default(),
        }
    }

    /// Says how the plans' commands switch, which soft constraints they violate, and whether they may be no minimum.
    fn describe(&mut self) {
        let mut all = Iteration::NONE;
        all.settle(&self.plan);
        self.companions.iter().for_each(|plan| all.join(plan));
        if let Some(switching) = self.plan.certificate.switching {
            info!("{switching}");
            self.add(&switching.to_string());
        }
        let Iteration { priced, paid, .. } = all;
        if priced > 0.0 {
            self.add(&format!(
                "soft constraints are violated by up to {priced:.3e}, which costs {paid:.6e}"
            ));
        }
        if !all.sufficient {
            self.add(NOT_MINIMUM);
        }
    }

    fn add(&mut self, remark: &str) {
        if !self.remark.is_empty() {
            self.remark += "; ";
        }
        self.remark += remark;
    }
}

/// How a task ended without a plan.
#[derive(Clone, Debug)]
pub(crate) struct Unsolved {
    pub(crate) reason: Reason,
    pub(crate) message: String,
    /// The best iterate, where there is one.
    pub(crate) best: Option<Box<Plan>>,
    /// The constraint that stands in the way, if one does.
    pub(crate) violated: Option<Violated>,
}

impl Unsolved {
    pub(crate) fn new(reason: Reason, message: impl ToString) -> Self {
        Self {
            reason,
            message: message.to_string(),
            best: None,
            violated: None,
        }
    }
}

/// Sees each iteration, and may end the task.
type Observe<'o> = &'o mut dyn FnMut(&Iteration) -> bool;

/// Solves a task of the scene's maneuver.
pub(crate) fn solve(scene: &Scene, task: &Task, observe: Observe<'_>) -> Result<Solved, Unsolved> {
    let Some(maneuver) = &scene.maneuver else {
        return Err(Unsolved::new(Reason::Refused, NO_MANEUVER));
    };
    let refused = |error: &dyn Display| Unsolved::new(Reason::Refused, error);
    if maneuver.separation.is_some() {
        return formation::solve(scene, maneuver, task, observe);
    }
    let (initial, maneuver) = match &task.initial {
        Initial::State(state) => {
            check_known(scene, maneuver, task.first_step)?;
            let body = &scene.bodies[maneuver.body].body;
            (Predicted::of(body, *state), Cow::Borrowed(maneuver))
        }
        #[cfg(feature = "node")]
        Initial::Forecast(forecast) => {
            let predicted = forecast.of(scene, maneuver.body, task.first_step);
            let predicted = predicted.map_err(|error| refused(&error))?;
            let now = lgvi_scene::Seen {
                step: forecast.from.step,
                states: forecast.from.states.clone(),
            };
            let seen = scene.maneuver_seen(&[now]);
            let seen = seen.map_err(|error| refused(&error))?;
            (predicted, seen.map_or(Cow::Borrowed(maneuver), Cow::Owned))
        }
    };
    let problem = Problem {
        scene,
        maneuver: &maneuver,
        initial: &initial,
    };
    let mut solved = match task.end {
        End::After(_) if task.finds_phases(&maneuver) => {
            if task.first_step > 0 {
                return Err(Unsolved::new(Reason::Refused, LATER_PHASES));
            }
            phases::solve(problem, task.guess.as_ref(), observe)?
        }
        End::After(intervals) => {
            let proportional = || maneuver.proportional_switches(scene.steps);
            let switches = task.switches.clone().unwrap_or_else(proportional);
            let transfer = problem.transfer(intervals, &switches)?;
            let guess = task.guess.as_ref().and_then(|Guess { plan, flown }| {
                // What is too short to be shortened is no help.
                plan.remaining(&transfer, *flown).ok()
            });
            let solved = problem.solve(&transfer, &switches, guess.as_ref(), observe)?;
            if !switches.is_empty() {
                info!("{}", phases::described(&maneuver, &switches, scene.steps));
            }
            let phased = Phased {
                switches,
                schedules: 1,
                solves: 1,
            };
            Solved { phased, ..solved }
        }
        End::Free(range) => match range.minimize {
            Minimize::Cost => duration::solve(problem, range, observe)?,
            Minimize::Time => shortest::solve(problem, range, observe)?,
        },
    };
    solved.describe();
    if let Cow::Owned(seen) = maneuver {
        solved.seen = Some(Arc::new(seen));
    }
    Ok(solved)
}

/// Refuses plans from a later state if the actuators are not known there.
fn check_known(scene: &Scene, maneuver: &Maneuver, first_step: u64) -> Result<(), Unsolved> {
    let unknown = [
        (maneuver.commands() == Commands::Wheels, LATER),
        (maneuver.uses_propellant(scene), LIGHTER),
    ];
    match unknown
        .iter()
        .find(|(unknown, _)| *unknown && first_step > 0)
    {
        Some((_, why)) => Err(Unsolved::new(Reason::Refused, why)),
        None => Ok(()),
    }
}

/// The maneuver of a scene, from a state.
#[derive(Clone, Copy)]
struct Problem<'p> {
    scene: &'p Scene,
    /// That of the scene, or as it is seen in flight.
    maneuver: &'p Maneuver,
    initial: &'p Predicted,
}

impl Problem<'_> {
    /// The transfer whose phases after the first begin at the steps `switches` of the run.
    fn transfer(&self, intervals: usize, switches: &[u64]) -> Result<Transfer, Unsolved> {
        let Self {
            scene,
            maneuver,
            initial,
        } = self;
        let transfer = scene.transfer_of(maneuver, initial.state, intervals, switches);
        let with_propellant = |transfer: Transfer| match initial.propellant {
            Some(left) if maneuver.uses_propellant(scene) => transfer.with_propellant(left),
            _ => Ok(transfer),
        };
        transfer
            .and_then(with_propellant)
            .and_then(|transfer| transfer.with_wheel_momenta(&initial.wheel_momenta))
            .map_err(|error| Unsolved::new(Reason::Refused, error))
    }

    /// Solves one transfer with these switches.
    fn solve(
        &self,
        transfer: &Transfer,
        switches: &[u64],
        guess: Option<&Plan>,
        observe: Observe<'_>,
    ) -> Result<Solved, Unsolved> {
        let &Self {
            scene, maneuver, ..
        } = self;
        attempt(scene, maneuver, transfer, guess, observe).map_err(|unsolved| {
            match &unsolved.violated {
                None => unsolved,
                Some(violated) => Unsolved {
                    message: violated.told(scene, maneuver, transfer.intervals(), switches),
                    ..unsolved
                },
            }
        })
    }
}

fn attempt(
    scene: &Scene,
    maneuver: &Maneuver,
    transfer: &Transfer,
    guess: Option<&Plan>,
    observe: Observe<'_>,
) -> Result<Solved, Unsolved> {
    if !maneuver.processed {
        return by_method(maneuver, transfer, guess, observe);
    }
    let refused = |error: ProcessingError| Unsolved::new(Reason::Refused, error);
    let early = processed(transfer.clone()).map_err(refused)?;
    let Solved { plan, remark, .. } = by_method(maneuver, &early, None, observe)?;
    let plan = flown(&scene.bodies[maneuver.body].body, plan).map_err(refused)?;
    Ok(Solved::new(plan, remark))
}

fn by_method(
    maneuver: &Maneuver,
    transfer: &Transfer,
    guess: Option<&Plan>,
    observe: Observe<'_>,
) -> Result<Solved, Unsolved> {
    let solver = &maneuver.solver;
    let settings = newton_settings(solver);
    let plan = match (solver.method, maneuver.search, guess) {
        (SolverMethod::Shooting, ..) => shooting::solve(transfer, solver, observe)?,
        (SolverMethod::Newton, Some(search), None) => {
            return best(transfer, search, settings, observe);
        }
        (SolverMethod::Newton, ..) => newton(transfer, guess, &settings, observe)?,
    };
    Ok(Solved::new(plan, String::new()))
}

/// The cheapest local minimum of a search; the ranking goes to the log.
fn best(
    transfer: &Transfer,
    Search { starts, seed }: Search,
    newton: NewtonSettings,
    observe: Observe<'_>,
) -> Result<Solved, Unsolved> {
    let settings = SearchSettings {
        starts,
        seed,
        newton,
    };
    let minima = lgvi_control::search(transfer, &settings, |now| observe(&now.into()))?;
    let ranked: Vec<_> = (1..)
        .zip(&minima)
        .map(|(rank, minimum)| described(rank, minima.len(), minimum))
        .collect();
    for minimum in &ranked {
        info!("{minimum}");
    }
    match (minima.into_iter().next(), ranked.into_iter().next()) {
        (Some(Minimum { plan, .. }), Some(remark)) => Ok(Solved::new(plan, remark)),
        _ => {
            let message = "no start leads to a minimum";
            Err(Unsolved::new(Reason::NotConverged, message))
        }
    }
}

/// A local minimum in words.
fn described(rank: usize, of: usize, minimum: &Minimum) -> String {
    let (cost, starts) = (minimum.plan.cost, minimum.starts);
    let Winding { rotation, angle } = minimum.winding;
    let rotation: [f64; 3] = rotation.into();
    format!(
        "minimum {rank} of {of}: cost {cost}, turns by {angle:.2} rad in all, {rotation:.2?} about the body's axes, \
         from {starts} starts"
    )
}

fn newton_settings(solver: &Solver) -> NewtonSettings {
    let defaults = NewtonSettings::default();
    NewtonSettings {
        violation: solver.tolerance.unwrap_or(defaults.violation),
        iterations: solver.max_iterations.unwrap_or(defaults.iterations),
        ..defaults
    }
}

fn newton(
    transfer: &Transfer,
    guess: Option<&Plan>,
    settings: &NewtonSettings,
    observe: Observe<'_>,
) -> Result<Plan, Unsolved> {
    let start = guess.map_or(Start::Cold, Start::Warm);
    lgvi_control::solve(transfer, start, settings, |now| observe(&now.into())).map_err(Into::into)
}

impl Iteration {
    /// Says of the plan that the iteration has led to what the plan says of itself: its last step is seen by nobody.
    pub(crate) fn settle(&mut self, plan: &Plan) {
        self.cost = plan.cost;
        self.violation = violation(&plan.certificate);
        self.stationarity = plan.certificate.stationarity;
        self.condition = plan.certificate.condition;
        self.sufficient = plan.certificate.sufficient;
        self.priced = plan.certificate.priced;
        self.paid = plan.paid;
    }

    /// Adds what the plan of a companion says of itself: the sum of the costs, the worst of everything else.
    pub(crate) fn join(&mut self, plan: &Plan) {
        let mut other = *self;
        other.settle(plan);
        self.cost += other.cost;
        self.violation = self.violation.max(other.violation);
        self.stationarity = self.stationarity.max(other.stationarity);
        self.condition = self.condition.max(other.condition);
        self.sufficient &= other.sufficient;
        self.priced = self.priced.max(other.priced);
        self.paid += other.paid;
    }
}

/// What a plan misses its conditions by.
pub(crate) fn violation(certificate: &Certificate) -> f64 {
    let Certificate {
        defect,
        terminal,
        inequality,
        ..
    } = certificate;
    terminal.max(*defect).max(*inequality)
}

impl From<&Progress> for Iteration {
    fn from(now: &Progress) -> Self {
        Self {
            iteration: now.iteration,
            trials: now.trials,
            step_length: now.step_length,
            violation: now.violation,
            stationarity: now.stationarity,
            cost: now.cost,
            condition: 0.0,
            sufficient: false,
            priced: 0.0,
            paid: 0.0,
            phase: match now.phase {
                Phase::Coarse => "coarse",
                Phase::Fine => "fine",
                Phase::Constrained => "constrained",
            },
        }
    }
}

impl From<PlanError> for Unsolved {
    fn from(error: PlanError) -> Self {
        let message = error.to_string();
        let violated = Violated::of(&error);
        let (reason, best) = match error {
            PlanError::Infeasible { .. }
            | PlanError::NotFound { .. }
            | PlanError::Propellant { .. }
            | PlanError::WheelSpeed { .. } => (Reason::Infeasible, None),
            PlanError::Between { best, .. } | PlanError::Chance { best, .. } => {
                (Reason::Infeasible, best)
            }
            PlanError::NotConverged { best, .. } => (Reason::NotConverged, best),
            PlanError::Stopped { best } => (Reason::Cancelled, best),
            PlanError::Dynamics { .. } => (Reason::NotConverged, None),
            _ => (Reason::Refused, None),
        };
        Self {
            reason,
            message,
            best,
            violated,
        }
    }
}
