use nalgebra::Vector3;

use super::FlyError;
use super::fit::{Layout, Unfit};
use crate::range::check_step;
use crate::simulation::check;
use crate::{BodyState, Load, Method, StepError, System};

/// What all members of a flight have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flight<'a> {
    /// What flies them.
    pub method: Method,
    /// Step, negative for a flight back in time.
    pub h: f64,
    /// Steps of the method in each step, 1 at least.
    pub substeps: u32,
    /// Steps to make.
    pub steps: u64,
    /// What acts beside gravity; `None` for nothing.
    pub thrust: Option<Thrust<'a>>,
}

/// Loads on one body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thrust<'a> {
    /// Which body, from 0.
    pub body: usize,
    /// One a step from step 0 on; nothing acts after the last.
    pub loads: &'a [Load],
}

/// One of many systems.
pub struct Member {
    /// Its bodies and their gravity.
    pub system: System,
    /// Their states at step 0, one a body.
    pub states: Vec<BodyState>,
    /// Factors of the components of the thrust's force, inertial frame.
    pub force: Vector3<f64>,
    /// Factors of the components of the thrust's moment, body frame.
    pub moment: Vector3<f64>,
}

/// Where a member has come to.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The states after the last step that could be made.
    pub states: Vec<BodyState>,
    /// Steps made.
    pub steps: u64,
    /// Why the next could not be made; `None` at the end of the flight.
    pub failure: Option<StepError>,
}

/// A flight of as many members as there are lanes, or fewer.
pub(super) struct Batch<'a> {
    pub(super) flight: &'a Flight<'a>,
    pub(super) layout: Layout,
    pub(super) members: &'a [Member],
    /// One a member.
    pub(super) states: Vec<Vec<BodyState>>,
}

impl<'a> Batch<'a> {
    pub(super) fn new(flight: &'a Flight, members: &'a [Member]) -> Result<Self, FlyError> {
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
        })
    }
}
