//! Gravity: what acts on bodies, one model a file.
//!
//! A [`Gravity`] acts on all bodies of a system; a [`Field`] has fixed sources, acts on each body by itself, and is
//! differentiated twice for the planner.

mod attractor;
mod central;
mod extent;
mod field;
mod fixed;
mod form;
mod harmonic;
mod interaction;
mod moments;
mod multipole;
mod mutual;
mod pair;
mod polyhedron;
mod remainder;
mod sources;
mod uniform;

use std::fmt;

use thiserror::Error;

pub use attractor::{Attractor, Monopole};
pub use central::Central;
pub use field::{Field, Intrusion, LoadCurvature, LoadGradient};
pub use fixed::Fixed;
pub use form::{Form, Placement, Shape};
pub use interaction::{Falloff, Interaction, Kept, Level, Partner};
pub use moments::Moments;
pub use multipole::Multipole;
pub use mutual::Mutual;
pub use polyhedron::{ObjError, Polyhedron, PolyhedronError, PolyhedronField, PolyhedronMass};
pub use remainder::{Neglect, Remainder};
pub use sources::Sources;
pub use uniform::Uniform;

use crate::{BodyState, Load, RigidBody};

/// Gravity on all bodies of a system.
pub trait Gravity: Send {
    /// Adds to `loads` (one a body) what gravity exerts in `states`.
    fn add_loads(&mut self, bodies: &[RigidBody], states: &[BodyState], loads: &mut [Load]);

    /// The potential `U` in `states`.
    fn potential(&self, bodies: &[RigidBody], states: &[BodyState]) -> f64;

    /// What it consists of, in the order in which it is computed; none where it cannot be taken apart.
    fn interactions(&self, _bodies: &[RigidBody]) -> Option<Vec<Interaction>> {
        None
    }

    /// Makes whatever any level of an interaction needs, so that loads allocate nothing.
    fn prepare(&mut self, _bodies: &[RigidBody]) {}

    /// Adds to `loads` what those of its interactions exert that are kept.
    fn add_kept_loads(
        &mut self,
        bodies: &[RigidBody],
        states: &[BodyState],
        loads: &mut [Load],
        _kept: &[Kept],
    ) {
        self.add_loads(bodies, states, loads);
    }

    /// Whether any of `bodies` or of the sources has an extent that another could enter.
    fn has_extents(&self, _bodies: &[RigidBody]) -> bool {
        true
    }

    /// What an evaluation for `bodies` costs, in multiples of a point in a central field, roughly.
    fn cost(&self, bodies: &[RigidBody]) -> f64 {
        bodies
            .iter()
            .map(|body| body.points().len().max(1) as f64)
            .sum()
    }

    /// What it is in numbers; none where it has no such form.
    fn form(&self) -> Option<Form> {
        None
    }

    /// Whether all bodies are outside each other's radii and those of the sources.
    fn check_clearance(
        &self,
        _bodies: &[RigidBody],
        _states: &[BodyState],
    ) -> Result<(), CloseApproach> {
        Ok(())
    }
}

/// A body is where another body or a source is.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub struct CloseApproach {
    /// Which body, from 0.
    pub body: usize,
    /// The other body, from 0; none for a fixed source.
    pub other: Option<usize>,
    /// Distance of their origins.
    pub distance: f64,
    /// Sum of their radii.
    pub limit: f64,
}

impl fmt::Display for CloseApproach {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            body,
            distance,
            limit,
            ..
        } = self;
        match self.other {
            Some(other) => write!(f, "bodies {body} and {other}")?,
            None => write!(f, "body {body} and the attractor")?,
        }
        write!(
            f,
            " are {distance} apart, inside the sum {limit} of their radii"
        )
    }
}
