//! Points on which forces act.

use nalgebra::Vector3;

use super::jet::Lanes;

/// Points that are fixed in bodies or in space, with one Taylor coefficient of their positions and forces.
#[derive(Default)]
pub(super) struct Places {
    pub(super) all: Vec<Place>,
    /// Of the positions, inertial frame.
    pub(super) at: Vec<Lanes>,
    /// Of the forces, inertial frame.
    pub(super) force: Vec<Lanes>,
}

/// A point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    /// Fixed in space.
    Fixed(Vector3<f64>),
    /// Fixed in a body, in its principal axes.
    Body(usize, Vector3<f64>),
}

impl Places {
    pub(super) fn add(&mut self, place: Place) {
        self.all.push(place);
        self.at.push(Lanes::default());
        self.force.push(Lanes::default());
    }
}
