use std::ops::{Add, AddAssign};

use nalgebra::Vector3;

/// The load on a body: a force at its center of mass and a moment about it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// Force, inertial frame.
    pub force: Vector3<f64>,
    /// Moment about the center of mass, body frame.
    pub moment: Vector3<f64>,
}

impl Load {
    /// Returns true if any component is nonzero. Negative zero counts as zero.
    #[inline(always)]
    pub(crate) fn acts(&self) -> bool {
        let components = self.force.iter().chain(&self.moment);
        let bits = components.fold(0, |bits, component| bits | component.to_bits());
        bits << 1 != 0
    }

    /// Returns true if all six components are finite.
    pub fn is_finite(&self) -> bool {
        self.force.iter().chain(&self.moment).all(|c| c.is_finite())
    }
}

impl Add for Load {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        Self {
            force: self.force + other.force,
            moment: self.moment + other.moment,
        }
    }
}

impl AddAssign for Load {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
