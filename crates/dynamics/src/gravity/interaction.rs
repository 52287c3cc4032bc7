use nalgebra::Vector3;

use super::extent::Extent;
use super::{Attractor, Remainder};
use crate::RigidBody;

/// The level of detail at which an interaction is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Nothing.
    Dropped,
    /// The force between the bodies as point masses at their centers, without moments.
    Monopole,
    /// Force and moments to second order: the second moments of each body interact with the other's monopole.
    Quadrupole,
    /// Everything that the model contains.
    Full,
}

/// The partner of a body in an interaction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Partner {
    /// Another body.
    Body(usize),
    /// A fixed source at this position, inertial frame.
    Source(Vector3<f64>),
    /// A field without a position.
    Field,
}

/// The interaction of a body with another body or a fixed source: the smallest part of gravity that can be simplified
/// separately.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interaction {
    /// Index of the body, from 0. For a pair of bodies, the smaller index.
    pub body: usize,
    /// The partner.
    pub partner: Partner,
    /// The lowest level whose result is exact to rounding.
    pub exact: Level,
    /// True if the full interaction exerts a moment on the body, and on the partner.
    pub moments: [bool; 2],
    /// The falloff of the omitted terms with distance, or `None` if it is not known.
    pub remainder: Option<Remainder>,
    /// Approximate cost of each level, in multiples of a point in a central field.
    pub costs: [f64; 4],
}

/// An interaction to be computed, and its level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kept {
    /// The body.
    pub body: usize,
    /// The other body, or `body` again if the partner is a fixed source.
    pub other: usize,
    /// The level, never [`Level::Dropped`].
    pub level: Level,
    /// The body's mass, or the product of both masses for a pair.
    pub masses: f64,
}

/// The falloff of a fixed source's field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Falloff {
    /// `GM`, 0 for a uniform field.
    pub strength: f64,
    /// Sum of the absolute eigenvalues of `H`, where `−e·He/r⁵` is the potential beyond the monopole.
    pub harmonic: f64,
}

impl Interaction {
    /// The other body, or `None` if the partner is not a body.
    pub fn other(&self) -> Option<usize> {
        match self.partner {
            Partner::Body(other) => Some(other),
            Partner::Source(_) | Partner::Field => None,
        }
    }

    /// The mass on which a source acts, or the product of both masses.
    pub(crate) fn masses(&self, bodies: &[RigidBody]) -> f64 {
        let mass = |body: usize| bodies[body].attracted_mass();
        let other = self.other().map_or(1.0, mass);
        mass(self.body) * other
    }

    /// The interaction of two bodies with the gravitational constant `g` and the cost of its full computation.
    pub(super) fn of_pair(
        pair: [usize; 2],
        bodies: [&RigidBody; 2],
        extents: [&Option<Extent>; 2],
        (g, cost): (f64, f64),
    ) -> Self {
        let given = bodies.iter().all(|body| body.mobility().is_given());
        let moments = extents.map(|extent| extent.is_none_or(|extent| !extent.is_point));
        let remainder = match extents {
            [Some(a), Some(b)] if a.is_centered && b.is_centered => Some(Remainder {
                reach: a.reach + b.reach,
                sides: [a.side(b, g), b.side(a, g)],
            }),
            _ => None,
        };
        Self {
            body: pair[0],
            partner: Partner::Body(pair[1]),
            exact: exact(given, moments == [false; 2]),
            moments,
            remainder,
            costs: [0.0, cost.min(POINTS), cost.min(SERIES), cost],
        }
    }

    /// The interaction of a fixed attractor and a body.
    pub(super) fn of_source(
        index: usize,
        body: &RigidBody,
        source: &dyn Attractor,
        cost: f64,
    ) -> Self {
        let place = source.monopole().map(|monopole| monopole.position);
        let extent = Extent::of(body);
        let is_point = extent.is_some_and(|extent| extent.is_point);
        let falls = source.falloff();
        let remainder = extent.zip(falls).filter(|(extent, _)| extent.is_centered);
        let remainder = remainder.map(|(extent, falloff)| Remainder {
            reach: extent.reach,
            sides: [
                extent.side_of([falloff.strength, falloff.harmonic], 0.0),
                None,
            ],
        });
        let uniform = remainder.is_some() && place.is_none();
        Self {
            body: index,
            partner: place.map_or(Partner::Field, Partner::Source),
            exact: exact(body.mobility().is_given(), is_point || uniform),
            moments: [!is_point, false],
            remainder,
            costs: [0.0, cost.min(source.cost()), cost, cost],
        }
    }
}

/// Cost of a pair of points, and of a pair of second-order multipoles.
const POINTS: f64 = 0.6;
const SERIES: f64 = 2.5;

fn exact(given: bool, point: bool) -> Level {
    match (given, point) {
        (true, _) => Level::Dropped,
        (false, true) => Level::Monopole,
        (false, false) => Level::Full,
    }
}
