use nalgebra::{Matrix3, Vector3};
use wide::f64x2;

use crate::PointMass;

/// Two points of a body side by side, for arithmetic on both at once. Of an odd number of points the last stands beside
/// a copy of itself without mass.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Couple {
    pub(super) masses: f64x2,
    /// `R ρ` of each.
    pub(super) arms: Vector3<f64x2>,
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
        let along = |axis: usize| f64x2::new([first.position[axis], second.position[axis]]);
        let row = |row: usize| {
            let by = |column: usize| f64x2::splat(attitude[(row, column)]);
            by(0) * along(0) + by(1) * along(1) + by(2) * along(2)
        };
        Self {
            masses: f64x2::new([first.mass, mass]),
            arms: Vector3::new(row(0), row(1), row(2)),
        }
    }

    /// All of a body's points.
    #[inline]
    pub(super) fn of<'a>(
        points: &'a [PointMass],
        attitude: &'a Matrix3<f64>,
    ) -> impl Iterator<Item = Self> + 'a {
        points
            .chunks(2)
            .map(|chunk| Self::new(&chunk[0], chunk.get(1), attitude))
    }

    /// The other way round.
    #[inline(always)]
    pub(super) fn swapped(&self) -> Self {
        Self {
            masses: swap(self.masses),
            arms: swapped(&self.arms),
        }
    }
}

#[inline(always)]
pub(super) fn swapped(vectors: &Vector3<f64x2>) -> Vector3<f64x2> {
    vectors.map(swap)
}

#[inline(always)]
fn swap(pair: f64x2) -> f64x2 {
    let [a, b] = pair.to_array();
    f64x2::new([b, a])
}

#[inline(always)]
pub(super) fn sum(vectors: &Vector3<f64x2>) -> Vector3<f64> {
    vectors.map(|pair| {
        let [a, b] = pair.to_array();
        a + b
    })
}

#[inline(always)]
pub(super) fn dot(a: &Vector3<f64x2>, b: &Vector3<f64x2>) -> f64x2 {
    a.x * b.x + a.y * b.y + a.z * b.z
}
