//! Attraction of points of mass by each other.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4};

use super::jet::{Jet, Lanes, Power, Squared, jet, squares};
use super::places::Places;

/// Two points that attract each other: the indices of their places, and `G m₁ m₂`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pair {
    pub(super) places: [usize; 2],
    pub(super) strength: f64,
}

/// Four pairs of points side by side.
pub(super) struct Pairs {
    places: [[usize; 2]; 4],
    /// Of each pair, 0 in unused lanes.
    strengths: Lanes,
    d: [Jet; 3],
    squared: Squared,
    /// `−G m₁ m₂ r⁻³`
    pull: Power,
}

impl Pairs {
    /// Products per term of a sum.
    pub(super) const TERMS: f64 = 6.5;

    /// At most four `pairs`, at least one.
    pub(super) fn new(pairs: &[Pair], order: usize) -> Self {
        let used = |lane: usize| pairs.get(lane).unwrap_or(&pairs[0]);
        let strength = |lane: usize| pairs.get(lane).map_or(0.0, |pair| pair.strength);
        Self {
            places: std::array::from_fn(|lane| used(lane).places),
            strengths: Lanes(std::array::from_fn(strength)),
            d: std::array::from_fn(|_| jet(order)),
            squared: Squared::new(order),
            pull: Power::new(order, [-1.5; 4]),
        }
    }

    /// Adds coefficient n of all forces.
    #[inline(always)]
    pub(super) fn add_forces<S: Simd>(&mut self, simd: S, n: usize, places: &mut Places) {
        let mut lanes = [[0.0; 4]; 3];
        for (lane, [one, other]) in self.places.into_iter().enumerate() {
            let d: [f64; 4] = (places.at[one].load(simd) - places.at[other].load(simd)).into();
            for (lanes, d) in lanes.iter_mut().zip(d) {
                lanes[lane] = d;
            }
        }
        for (d, lanes) in self.d.iter_mut().zip(lanes) {
            d[n] = Lanes(lanes);
        }
        let [x, y, z] = squares(simd, &self.d, n);
        self.squared.set(simd, n, x + y + z);
        let newest = if n == 0 {
            let [inverse_cube, _] = self.squared.inverse_cube(simd);
            let u = inverse_cube * -self.strengths.load(simd);
            self.pull.begin(u);
            u
        } else {
            self.pull.advance(simd, n, &self.squared)
        };
        let u = &self.pull.u[..=n];
        let d = [&self.d[0][..=n], &self.d[1][..=n], &self.d[2][..=n]];
        let mut force = [f64x4::splat(simd, 0.0); 3];
        for j in 0..n {
            let u = u[j].load(simd);
            for (force, d) in force.iter_mut().zip(d) {
                *force += u * d[n - j].load(simd);
            }
        }
        let mut forces = [[0.0; 4]; 3];
        for ((to, force), d) in forces.iter_mut().zip(force).zip(d) {
            *to = (force + newest * d[0].load(simd)).into();
        }
        let [x, y, z] = forces;
        for (lane, [one, other]) in self.places.into_iter().enumerate() {
            let force = Lanes([x[lane], y[lane], z[lane], 0.0]).load(simd);
            places.force[one] = (places.force[one].load(simd) + force).into();
            places.force[other] = (places.force[other].load(simd) - force).into();
        }
    }
}
