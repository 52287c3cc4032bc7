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
pub use form::{Form, Placement, SourceShape};
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

    /// Its interactions, each of which can be simplified by itself; none where it cannot be taken apart.
    fn separable(&mut self) -> Option<&mut dyn Separable> {
        None
    }

    /// How far bodies must stay from each other and from the sources; none where they may be anywhere.
    fn clearance(&self) -> Option<&dyn Clearance> {
        None
    }

    /// It in numbers, from which [`lanes`](crate::lanes) compute it for many systems at once; none where it has no such form.
    fn form(&self) -> Option<Form> {
        None
    }

    /// Cost of an evaluation for `bodies`, in multiples of a point in a central field, roughly.
    fn cost(&self, bodies: &[RigidBody]) -> f64 {
        let points = bodies.iter().map(|body| body.points().len().max(1) as f64);
        points.sum()
    }
}

/// Gravity that is a sum of [`Interaction`]s, of which a [`Skip`](crate::Skip) may leave something out.
pub trait Separable {
    /// The interactions, in the order in which they are computed.
    fn interactions(&self, bodies: &[RigidBody]) -> Vec<Interaction>;

    /// Makes whatever any level of an interaction needs, so that loads allocate nothing.
    fn prepare(&mut self, _bodies: &[RigidBody]) {}

    /// Adds to `loads` what the interactions that are kept exert.
    fn add_kept_loads(
        &mut self,
        bodies: &[RigidBody],
        states: &[BodyState],
        loads: &mut [Load],
        kept: &[Kept],
    );
}

/// Extents of bodies and sources that nothing may enter.
pub trait Clearance {
    /// Whether any of `bodies` or of the sources has an extent that another could enter.
    fn has_extents(&self, _bodies: &[RigidBody]) -> bool {
        true
    }

    /// Whether all bodies are outside each other's extents and those of the sources.
    ///
    /// # Errors
    /// The first pair that is not.
    fn check(&self, bodies: &[RigidBody], states: &[BodyState]) -> Result<(), CloseApproach>;
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
