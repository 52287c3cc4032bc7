//! What is to be planned.

use std::sync::Arc;

use lgvi_control::{Plan, Transfer};
use lgvi_dynamics::thrusters::Thrusters;
use lgvi_dynamics::wheels::Wheels;
use lgvi_dynamics::{BodyState, RigidBody};
use lgvi_scene::{FinalTime, Maneuver, Scene};

#[cfg(feature = "node")]
use crate::prediction::Forecast;

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
    pub(super) fn finds_phases(&self, maneuver: &Maneuver) -> bool {
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
    /// This one, with actuators as at the start of the scene.
    State(BodyState),
    /// What is known of the body.
    Known(Predicted),
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

/// Earlier plans, of which a part will have been flown.
#[derive(Clone, Debug)]
pub(crate) struct Guess {
    /// The plan.
    pub(crate) plan: Arc<Plan>,
    /// Those of the companions.
    pub(crate) companions: Vec<Arc<Plan>>,
    /// Their intervals before the new one begins.
    pub(crate) flown: usize,
}

impl Guess {
    /// What is left of the plans, if that is enough for these transfers of their bodies.
    pub(super) fn remaining(&self, transfers: &[Transfer]) -> Vec<Plan> {
        let plans = std::iter::once(&self.plan).chain(&self.companions);
        let rest = plans.zip(transfers);
        let rest: Result<_, _> = rest
            .map(|(plan, transfer)| plan.remaining(transfer, self.flown))
            .collect();
        rest.unwrap_or_default()
    }
}

/// When a plan is to arrive.
#[derive(Clone, Copy, Debug)]
pub(crate) enum End {
    /// After so many steps.
    After(usize),
    /// When it is best.
    Free(FinalTime),
}
