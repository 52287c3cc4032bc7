use nalgebra::Vector3;

use super::FlyError;
use super::fit::{Layout, Unfit};
use crate::range::check_step;
use crate::simulation::check;
use crate::{BodyState, Load, Method, StepError, System};

/// Settings that all members of a flight share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flight<'a> {
    /// The integration method.
    pub method: Method,
    /// Step size, negative for integration backwards in time.
    pub h: f64,
    /// Substeps of the method per step, at least 1.
    pub substeps: u32,
    /// Number of steps.
    pub steps: u64,
    /// Loads in addition to gravity, or `None`.
    pub thrust: Option<Thrust<'a>>,
}

/// Loads on one body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thrust<'a> {
    /// Index of the body, from 0.
    pub body: usize,
    /// Loads, one per step from step 0. No load acts after the last one.
    pub loads: &'a [Load],
}

/// One of many systems.
pub struct Member {
    /// Bodies and gravity.
    pub system: System,
    /// States at step 0, one per body.
    pub states: Vec<BodyState>,
    /// Factors for the components of the thrust's force, inertial frame.
    pub force: Vector3<f64>,
    /// Factors for the components of the thrust's moment, body frame.
    pub moment: Vector3<f64>,
}

/// The result of a flight for one member.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The states after the last successful step.
    pub states: Vec<BodyState>,
    /// Steps made.
    pub steps: u64,
    /// Error of the next step, or `None` if the flight was completed.
    pub failure: Option<StepError>,
}

/// The input of a flight of at most as many members as there are lanes.
pub(super) struct Batch<'a> {
    pub(super) flight: &'a Flight<'a>,
    pub(super) layout: Layout,
    pub(super) members: &'a [Member],
    /// States, one vector per member.
    pub(super) states: Vec<Vec<BodyState>>,
    /// Is told the number of steps since the last call.
    pub(super) flown: &'a dyn Fn(u64),
}

impl<'a> Batch<'a> {
    pub(super) fn new(
        flight: &'a Flight,
        members: &'a [Member],
        flown: &'a dyn Fn(u64),
    ) -> Result<Self, FlyError> {
        check_step(flight.h)?;
        let mut layouts = Vec::with_capacity(members.len());
        let mut all = Vec::with_capacity(members.len());
        for (member, Member { system, states, .. }) in members.iter().enumerate() {
            check(system, states)?;
            let mut states = states.clone();
            system.constrain(&mut states);
            all.push(states);
            let layout = Layout::of(system, flight.method)?;
            if layouts.first().is_some_and(|first| *first != layout) {
                return Err(Unfit::Unlike { member }.into());
            }
            layouts.push(layout);
        }
        let layout = layouts.into_iter().next().ok_or(Unfit::Nobody)?;
        if let Some(Thrust { body, .. }) = flight.thrust
            && body >= layout.motions.len()
        {
            return Err(Unfit::Thrust { body }.into());
        }
        Ok(Self {
            flight,
            layout,
            members,
            states: all,
            flown,
        })
    }

    /// Batches of at most `count` of the members.
    #[cfg(target_arch = "x86_64")]
    pub(super) fn parts(&self, count: usize) -> impl Iterator<Item = Self> {
        let parts = self.members.chunks(count).zip(self.states.chunks(count));
        parts.map(|(members, states)| Self {
            flight: self.flight,
            layout: self.layout.clone(),
            members,
            states: states.to_vec(),
            flown: self.flown,
        })
    }
}
