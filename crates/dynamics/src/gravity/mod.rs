//! Gravity: what acts on bodies, one model a file.
//!
//! A [`Gravity`] acts on all bodies of a system; a [`Field`] has fixed sources, acts on each body by itself, and is
//! differentiated twice for the planner.

mod attractor;
mod central;
mod field;
mod fixed;
mod harmonic;
mod moments;
mod multipole;
mod mutual;
mod pair;
mod polyhedron;
mod sources;
mod uniform;

use std::fmt;

use thiserror::Error;

pub use attractor::{Attractor, Monopole};
pub use central::Central;
pub use field::{Field, Intrusion, LoadCurvature, LoadGradient};
pub use fixed::Fixed;
pub use moments::Moments;
pub use multipole::Multipole;
pub use mutual::Mutual;
pub use polyhedron::{ObjError, Polyhedron, PolyhedronError, PolyhedronField, PolyhedronMass};
pub use sources::Sources;
pub use uniform::Uniform;

use crate::{BodyState, Load, RigidBody};

/// Gravity on all bodies of a system.
pub trait Gravity: Send {
    /// Adds to `loads` (one a body) what gravity exerts in `states`.
    fn add_loads(&mut self, bodies: &[RigidBody], states: &[BodyState], loads: &mut [Load]);

    /// The potential `U` in `states`.
    fn potential(&self, bodies: &[RigidBody], states: &[BodyState]) -> f64;

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
