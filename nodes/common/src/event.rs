//! What a node tells the process that started it. All quantities are SI unless said otherwise.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::Warning;

/// One event of a node's life.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// All ports are open.
    Ready,
    /// The planner has made an iteration.
    Planning(PlanReport),
    /// The planner has a plan and has published it.
    Planned {
        /// The last iteration.
        plan: PlanReport,
        /// Wall-clock time of the solution (s).
        seconds: f64,
    },
    /// The planner has looked for a new plan in flight.
    Replanned {
        /// Plans published in flight so far.
        published: u64,
        /// Times so far when there was none in time, and the old one was kept.
        kept: u64,
        /// What has come of the last one.
        last: ReplanReport,
    },
    /// What the planner or the propagator has published so far; the propagator publishes no more.
    Published {
        /// Messages published, by topic.
        messages: BTreeMap<String, u64>,
    },
    /// The propagator is on its way.
    Flying {
        /// Steps made.
        step: u64,
    },
    /// The propagator has made all steps and everything is published.
    Flown(FlightReport),
    /// The recorder has written messages.
    Recording {
        /// Messages written, by topic.
        messages: BTreeMap<String, u64>,
        /// Messages known to be missing.
        lost: u64,
        /// How often receiving has waited for writing.
        #[serde(default)]
        waits: u64,
        /// For how long in all (s).
        #[serde(default)]
        waited: f64,
    },
    /// The recorder has closed the bag.
    Recorded {
        /// The bag's directory.
        bag: PathBuf,
        /// Messages in it, by topic.
        messages: BTreeMap<String, u64>,
        /// Messages known to be missing.
        lost: u64,
        /// How often receiving has waited for writing.
        #[serde(default)]
        waits: u64,
        /// For how long in all (s).
        #[serde(default)]
        waited: f64,
    },
    /// The player is on its way.
    Playing {
        /// Messages published.
        messages: u64,
        /// Recorded time since the start (s).
        time: f64,
        /// Recorded time in all (s).
        duration: f64,
    },
    /// The player has played the whole bag.
    Played {
        /// Messages published.
        messages: u64,
    },
    /// There is something to mind, though nothing has failed.
    Warned(Warning),
    /// The node ends with an error.
    Failed {
        /// What went wrong.
        message: String,
    },
}

/// Where the planner's solver is; errors and cost in the scene's units.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct PlanReport {
    /// Newton iterations so far.
    pub iterations: u32,
    /// Trajectories integrated so far.
    pub trials: u32,
    /// Norm of the terminal error.
    pub violation: f64,
    /// Objective: the cost of the commands.
    pub cost: f64,
    /// What is violated at a price; none where nothing is, or before the plan is made.
    pub soft: Option<SoftReport>,
    /// The phases of a plan that is made, if the maneuver has any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub phases: Option<PhasesReport>,
}

/// The phases of a plan, and what it took to find their lengths.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct PhasesReport {
    /// Each phase, in their order.
    pub legs: Vec<PhaseReport>,
    /// Number of schedules that were planned.
    pub schedules: u32,
    /// Number of times that a transfer was solved.
    pub solves: u32,
}

/// A phase of a plan.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct PhaseReport {
    /// Its name.
    pub name: String,
    /// The step that it begins at.
    pub first_step: u64,
    /// Number of steps that it lasts.
    pub steps: u64,
}

/// The violated soft constraints of a plan, in the scene's units.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct SoftReport {
    /// The largest violation: in parts of a limit, of a radius or of a length, or in radians.
    pub violation: f64,
    /// What all of them cost, beside the commands.
    pub paid: f64,
}

/// What has come of planning anew in flight, once.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct ReplanReport {
    /// The step of the state that it is planned from.
    pub step: u64,
    /// The step that the plan begins at.
    pub first_step: u64,
    /// Wall-clock time from when the planner heard that state, until the plan was published or the old one
    /// was kept (s).
    pub seconds: f64,
    /// Newton iterations.
    pub iterations: u32,
    /// Why the old plan was kept; none where it was not.
    pub kept: Option<String>,
}

/// By how much the flown state misses the target.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Miss {
    /// Distance (m).
    pub position: f64,
    /// Momentum (kg m/s).
    pub linear_momentum: f64,
    /// Angle (rad).
    pub attitude: f64,
    /// Angular momentum (kg m²/s).
    pub angular_momentum: f64,
    /// Norm of all four in the scene's units.
    pub norm: f64,
}

/// What the propagator has flown.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct FlightReport {
    /// Steps made.
    pub steps: u64,
    /// Step (s).
    pub step_size: f64,
    /// Wall-clock time of the loop, waiting for slower subscribers included (s).
    pub seconds: f64,
    /// How far from the maneuver's target the flight ended; none without a maneuver.
    pub miss: Option<Miss>,
    /// Cost of the controls of the maneuver's own body as flown, in the scene's units; none without a maneuver.
    pub cost: Option<f64>,
    /// What has become of the other bodies that were planned together with that of the maneuver.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub companions: Vec<Arrival>,
    /// Energy at the start (J).
    pub energy_start: f64,
    /// Energy at the end (J).
    pub energy_end: f64,
    /// Change of total linear momentum from start to end (kg m/s).
    pub linear_momentum_change: f64,
    /// Change of total angular momentum about the origin from start to end (kg m²/s).
    pub angular_momentum_change: f64,
    /// `|RᵀR − I|` at the end.
    pub orthogonality_error: f64,
    /// Samples that subscribers on this host had no room for.
    pub refused: u64,
    /// Steps that came later than their time in real-time pace.
    pub overruns: u64,
    /// Control sequences that came after the step at which they were to begin, and were refused.
    #[serde(default)]
    pub late_controls: u64,
    /// Commands from outside that were over before others came, or that were missing.
    #[serde(default)]
    pub command_timeouts: Vec<CommandTimeouts>,
    /// Steps that could not be made as one and were cut.
    pub cut_steps: u64,
    /// How often an interaction of bodies was taken up in more or in less detail.
    pub detail_changes: u64,
    /// Bodies that have docked.
    #[serde(default)]
    pub docked: Vec<Docked>,
}

/// A planned body at the end of its flight.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Arrival {
    /// Name of the body.
    pub body: String,
    /// Cost of its controls as flown, in the scene's units.
    pub cost: f64,
    /// How far from its target it ended; none where the target is nowhere.
    pub miss: Option<Miss>,
}

/// What was missing of the commands for a body, its wheels or its thrusters.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct CommandTimeouts {
    /// What kind of command, and for which body.
    pub command: String,
    /// How often one was over before another came.
    pub timeouts: u64,
    /// For how long nothing acted after that, in all (s).
    pub idle: f64,
    /// How often one that was waited for did not come within its deadline.
    pub missed: u64,
}

impl Display for CommandTimeouts {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self {
            command,
            timeouts,
            idle,
            missed,
        } = self;
        write!(
            f,
            "{command}: {timeouts} over before another came, nothing acted for {idle:.3} s"
        )?;
        if *missed > 0 {
            write!(f, "; {missed} missing at the deadline")?;
        }
        Ok(())
    }
}

/// Two bodies that have become one.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Docked {
    /// Their names.
    pub bodies: [String; 2],
    /// The step at whose beginning they joined.
    pub step: u64,
    /// The time since the epoch (s).
    pub time: f64,
    /// Loss of kinetic energy (J).
    pub energy_loss: f64,
}

impl Display for Docked {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self {
            bodies: [one, other],
            step,
            time,
            energy_loss,
        } = self;
        write!(
            f,
            "{one} and {other} at step {step}, {time:.3} s, kinetic energy lost {energy_loss:.3e} J"
        )
    }
}
