//! Gravity models, one per file.
//!
//! A [`Gravity`] acts on all bodies of a system. A [`Field`] has fixed sources, acts on each body independently, and
//! has first and second derivatives for the planner. With the feature `num-dual`, `AutoDiff` derives them from a potential
//! that is written once.

mod attractor;
#[cfg(feature = "num-dual")]
mod autodiff;
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
#[cfg(feature = "num-dual")]
pub use autodiff::{AutoDiff, Potential};
pub use central::Central;
pub use field::{Field, Intrusion, LoadCurvature, LoadGradient};
pub use fixed::Fixed;
pub use form::{Form, Placement, SourceShape};
pub use interaction::{Falloff, Interaction, Kept, Level, Partner};
pub use moments::Moments;
pub(crate) use multipole::HigherTensors;
pub use multipole::Multipole;
pub use mutual::Mutual;
pub use polyhedron::{ObjError, Polyhedron, PolyhedronError, PolyhedronField, PolyhedronMass};
pub use remainder::{Neglect, Remainder};
pub use sources::Sources;
pub use uniform::Uniform;

use crate::{BodyState, Load, RigidBody};

/// Gravity on all bodies of a system.
pub trait Gravity: Send {
    /// Adds the gravity in `states` to `loads` (one per body).
    fn add_loads(&mut self, bodies: &[RigidBody], states: &[BodyState], loads: &mut [Load]);

    /// The potential `U` in `states`.
    fn potential(&self, bodies: &[RigidBody], states: &[BodyState]) -> f64;

    /// The interactions, each of which can be simplified separately, or `None` if the model has no such decomposition.
    fn separable(&mut self) -> Option<&mut dyn Separable> {
        None
    }

    /// The minimum distances between bodies and to the sources, or `None` if there are none.
    fn clearance(&self) -> Option<&dyn Clearance> {
        None
    }

    /// The parameters of the model, from which [`lanes`](crate::lanes) evaluate it for many systems at once, or `None`
    /// if it has no such form.
    fn form(&self) -> Option<Form> {
        None
    }

    /// The fixed source as a monopole, about which a method may follow Kepler's motion exactly, or `None` if there is none.
    fn center(&self) -> Option<Monopole> {
        None
    }

    /// The gravitational constant, if all bodies attract each other.
    fn constant(&self) -> Option<f64> {
        None
    }

    /// Approximate cost of an evaluation for `bodies`, in multiples of a point in a central field.
    fn cost(&self, bodies: &[RigidBody]) -> f64 {
        let points = bodies.iter().map(|body| body.points().len().max(1) as f64);
        points.sum()
    }
}

/// Gravity that is a sum of [`Interaction`]s. A [`Skip`](crate::Skip) may omit parts of them.
pub trait Separable {
    /// The interactions, in the order of their computation.
    fn interactions(&self, bodies: &[RigidBody]) -> Vec<Interaction>;

    /// Prepares the data that interactions need at any level, so that computing loads allocates nothing.
    fn prepare(&mut self, _bodies: &[RigidBody]) {}

    /// Adds the loads of the kept interactions to `loads`.
    fn add_kept_loads(
        &mut self,
        bodies: &[RigidBody],
        states: &[BodyState],
        loads: &mut [Load],
        kept: &[Kept],
    );
}

/// Extents of bodies and sources that other bodies must not enter.
pub trait Clearance {
    /// Returns true if any of `bodies` or of the sources has an extent that another could enter.
    fn has_extents(&self, _bodies: &[RigidBody]) -> bool {
        true
    }

    /// Checks that all bodies are outside each other's extents and those of the sources.
    ///
    /// # Errors
    /// Returns the first pair that violates this.
    fn check(&self, bodies: &[RigidBody], states: &[BodyState]) -> Result<(), CloseApproach>;

    /// As [`check`](Self::check), but of two bodies only those that are `apart`, given their indices.
    fn check_apart(
        &self,
        bodies: &[RigidBody],
        states: &[BodyState],
        _apart: &dyn Fn(usize, usize) -> bool,
    ) -> Result<(), CloseApproach> {
        self.check(bodies, states)
    }
}

/// A body has entered the extent of another body or of a source.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub struct CloseApproach {
    /// Index of the body, from 0.
    pub body: usize,
    /// Index of the other body, from 0, or `None` for a fixed source.
    pub other: Option<usize>,
    /// Distance between their origins.
    pub distance: f64,
    /// Sum of their radii.
    pub limit: f64,
}

impl CloseApproach {
    /// Returns the error as a message that calls the body of an index by its `name`.
    pub fn in_words(&self, name: impl Fn(usize) -> String) -> String {
        let other = self.other.map_or_else(|| "the attractor".into(), &name);
        format!(
            "{} and {other} are {} apart, inside the sum {} of their radii",
            name(self.body),
            self.distance,
            self.limit
        )
    }
}

impl fmt::Display for CloseApproach {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.in_words(|body| format!("body {body}")))
    }
}
