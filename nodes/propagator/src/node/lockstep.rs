use std::time::{Duration, Instant};

use lgvi_scene::{Replan, Scene};
use tracing::warn;

use crate::Flight;

/// How long a plan is waited for in silence.
const SILENCE: Duration = Duration::from_secs(5);

/// Where a flight waits for the plans that are made on its way: the states of these steps are what its planner plans from.
pub(crate) struct Lockstep {
    replan: Replan,
    /// The bodies that are planned for.
    bodies: Vec<usize>,
    /// Of the scene (s).
    step_size: f64,
    /// The present wait, if there is one.
    wait: Option<Wait>,
}

struct Wait {
    /// The step that the plan begins at.
    first_step: u64,
    since: Instant,
    told: bool,
}

impl Lockstep {
    /// That of the scene's maneuver; `None` where it is not planned anew.
    pub(crate) fn new(scene: &Scene) -> Option<Self> {
        let maneuver = scene.maneuver.as_ref()?;
        Some(Self {
            replan: maneuver.replan?,
            bodies: maneuver.planned().map(|planned| planned.body).collect(),
            step_size: scene.seconds(1),
            wait: None,
        })
    }

    /// The flight has made a step; whether a plan is made of the state that it has led to.
    pub(crate) fn reach(&mut self, flight: &Flight) -> bool {
        let arrivals = self.bodies.iter().map(|body| flight.sequence_end(*body));
        let arrival = arrivals.min().flatten().unwrap_or(0);
        let first_step = self
            .replan
            .in_lockstep(flight.step(), self.step_size, arrival);
        self.wait = first_step.map(|first_step| Wait {
            first_step,
            since: Instant::now(),
            told: false,
        });
        self.wait.is_some()
    }

    /// Whether the flight waits for a plan; if for long, it is said once.
    pub(crate) fn waits(&mut self, flight: &Flight) -> bool {
        let Some(wait) = &mut self.wait else {
            return false;
        };
        let begins = |body: &usize| flight.has_sequence_from(*body, wait.first_step);
        if self.bodies.iter().all(begins) {
            self.wait = None;
            return false;
        }
        if !wait.told && wait.since.elapsed() >= SILENCE {
            wait.told = true;
            let (step, first_step) = (flight.step(), wait.first_step);
            warn!(
                "in lockstep, held at step {step} for a control sequence with `first_step` {first_step}"
            );
        }
        true
    }

    /// The flight begins anew.
    pub(crate) fn begin_anew(&mut self) {
        self.wait = None;
    }
}
