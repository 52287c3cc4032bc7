use nalgebra::Vector3;

use super::extent::Extent;
use super::{Attractor, Remainder};
use crate::RigidBody;

/// How much of an interaction is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Nothing.
    Dropped,
    /// The force on the bodies as points of mass at their centers; no moment.
    Monopole,
    /// Force and moments to second order: each one's second moments of mass meet the other's monopole.
    Quadrupole,
    /// All that the model has.
    Full,
}

/// With what a body interacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Partner {
    /// With another body.
    Body(usize),
    /// With a source held at this place, inertial frame.
    Source(Vector3<f64>),
    /// With a field that has no place.
    Field,
}

/// What a body and another, or a fixed source, exert on each other: the least of gravity that can be simplified by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interaction {
    /// Which body, from 0; of two the one that comes first.
    pub body: usize,
    /// With what.
    pub partner: Partner,
    /// The lowest level that leaves nothing out but rounding.
    pub exact: Level,
    /// Whether it has a moment on the body, and on the other, if it is computed in full.
    pub moments: [bool; 2],
    /// How what is left out falls off with the distance; none where that is not known.
    pub remainder: Option<Remainder>,
    /// What each level costs, in multiples of a point in a central field, roughly.
    pub costs: [f64; 4],
}

/// An interaction that is computed, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kept {
    /// The body.
    pub body: usize,
    /// The other; with a fixed source the body again.
    pub other: usize,
    /// Not [`Level::Dropped`].
    pub level: Level,
    /// The body's mass, or the product of both.
    pub masses: f64,
}

/// How a fixed source's field falls off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Falloff {
    /// `GM`, 0 for a uniform field.
    pub strength: f64,
    /// Sum of the absolute eigenvalues of `H`, `−e·He/r⁵` being what there is beside the monopole.
    pub harmonic: f64,
}

impl Interaction {
    /// The other body, where there is one.
    pub fn other(&self) -> Option<usize> {
        match self.partner {
            Partner::Body(other) => Some(other),
            Partner::Source(_) | Partner::Field => None,
        }
    }

    /// Of two bodies under the gravitational constant `g`, with the cost of all of it.
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

    /// Of a fixed attractor and a body.
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

/// What two points cost, and two series of second order.
const POINTS: f64 = 0.6;
const SERIES: f64 = 2.5;

fn exact(given: bool, point: bool) -> Level {
    match (given, point) {
        (true, _) => Level::Dropped,
        (false, true) => Level::Monopole,
        (false, false) => Level::Full,
    }
}
