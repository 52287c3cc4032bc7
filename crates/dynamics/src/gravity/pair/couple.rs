use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x2};
use nalgebra::Matrix3;

use crate::PointMass;
use crate::lane::Vector;

/// Two points of a body side by side. If the number of points is odd, the last one is paired with a massless copy of
/// itself.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Couple {
    masses: [f64; 2],
    /// `R ρ` of each point.
    arms: Vector<[f64; 2]>,
}

/// A [`Couple`] in SIMD registers, for arithmetic on both points at once.
#[derive(Clone, Copy)]
pub(super) struct Loaded<S: Simd> {
    pub(super) masses: f64x2<S>,
    pub(super) arms: Vector<f64x2<S>>,
}

impl Couple {
    #[inline(always)]
    pub(super) fn new(
        first: &PointMass,
        second: Option<&PointMass>,
        attitude: &Matrix3<f64>,
    ) -> Self {
        let mass = second.map_or(0.0, |second| second.mass);
        let second = second.unwrap_or(first);
        let [a, b] = [first, second].map(|point| attitude * point.position);
        Self {
            masses: [first.mass, mass],
            arms: Vector::new([a.x, b.x], [a.y, b.y], [a.z, b.z]),
        }
    }

    /// All points of a body as couples.
    #[inline]
    pub(super) fn of<'a>(
        points: &'a [PointMass],
        attitude: &'a Matrix3<f64>,
    ) -> impl Iterator<Item = Self> + 'a {
        points
            .chunks(2)
            .map(|chunk| Self::new(&chunk[0], chunk.get(1), attitude))
    }

    #[inline(always)]
    pub(super) fn load<S: Simd>(&self, simd: S) -> Loaded<S> {
        let Vector { x, y, z } = self.arms;
        Loaded {
            masses: self.masses.simd_into(simd),
            arms: Vector::new(x.simd_into(simd), y.simd_into(simd), z.simd_into(simd)),
        }
    }
}

impl<S: Simd> Loaded<S> {
    /// The couple with its two points exchanged.
    #[inline(always)]
    pub(super) fn swapped(self) -> Self {
        Self {
            masses: self.masses.reverse(),
            arms: swapped(self.arms),
        }
    }
}

#[inline(always)]
pub(super) fn swapped<S: Simd>(v: Vector<f64x2<S>>) -> Vector<f64x2<S>> {
    Vector::new(v.x.reverse(), v.y.reverse(), v.z.reverse())
}
