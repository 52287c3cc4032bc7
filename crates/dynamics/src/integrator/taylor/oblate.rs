//! Attraction of points of mass by a fixed source with second moments.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4};
use nalgebra::{Matrix3, Vector3};

use super::jet::{Jet, Lanes, Power, Squared, convolve, jet, squares};
use super::places::Places;

/// A fixed source: `φ = −GM/r − d·Hd/r⁵` in its principal axes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Source {
    pub(super) gm: f64,
    /// The diagonal of H.
    pub(super) second: Vector3<f64>,
    pub(super) position: Vector3<f64>,
    /// Rotation from its principal axes to the inertial frame, or `None` if they are the same.
    pub(super) attitude: Option<Matrix3<f64>>,
}

/// Four points side by side, attracted by one source.
pub(super) struct Oblate {
    source: Source,
    places: Vec<usize>,
    /// Mass of each point, 0 in unused lanes.
    masses: Lanes,
    d: [Jet; 3],
    squared: Squared,
    /// `d·Hd`
    p: Jet,
    /// `r⁻³`, `r⁻⁵`, `r⁻⁷`
    powers: [Power; 3],
    /// The factors of d in the force, for each axis.
    factors: [Jet; 3],
}

impl Oblate {
    /// Products per term of a sum.
    pub(super) const TERMS: f64 = 11.5;

    /// At most four `points`, each a place and its mass, at least one.
    pub(super) fn new(source: Source, points: &[(usize, f64)], order: usize) -> Self {
        let mass = |lane: usize| points.get(lane).map_or(0.0, |point| point.1);
        Self {
            source,
            places: points.iter().map(|point| point.0).collect(),
            masses: Lanes(std::array::from_fn(mass)),
            d: std::array::from_fn(|_| jet(order)),
            squared: Squared::new(order),
            p: jet(order),
            powers: [-1.5, -2.5, -3.5].map(|exponent| Power::new(order, [exponent; 4])),
            factors: std::array::from_fn(|_| jet(order)),
        }
    }

    /// Adds coefficient n of all forces.
    #[inline(always)]
    pub(super) fn add_forces<S: Simd>(&mut self, simd: S, n: usize, places: &mut Places) {
        let mut lanes = [[0.0; 4]; 3];
        for (lane, place) in self.places.iter().enumerate() {
            let mut d = Vector3::from(places.at[*place].three());
            if n == 0 {
                d -= self.source.position;
            }
            if let Some(attitude) = &self.source.attitude {
                d = attitude.tr_mul(&d);
            }
            for (lanes, d) in lanes.iter_mut().zip(d.iter()) {
                lanes[lane] = *d;
            }
        }
        // Unused lanes are as the first.
        for lanes in &mut lanes {
            let first = lanes[0];
            lanes[self.places.len()..].fill(first);
        }
        for (d, lanes) in self.d.iter_mut().zip(lanes) {
            d[n] = Lanes(lanes);
        }
        let second = self.source.second;
        let [x, y, z] = squares(simd, &self.d, n);
        self.squared.set(simd, n, x + y + z);
        let p = x * second.x + y * second.y + z * second.z;
        self.p[n] = p.into();
        let [u3, u5, along] = self.powers(simd, n, p);
        let straight = u3 * -self.source.gm - along * 5.0;
        for (factor, second) in self.factors.iter_mut().zip(second.iter()) {
            factor[n] = (straight + u5 * (2.0 * second)).into();
        }
        let mut force = [f64x4::splat(simd, 0.0); 3];
        let [x, y, z] = &self.factors;
        let factors = [&x[..=n], &y[..=n], &z[..=n]];
        let [x, y, z] = &self.d;
        let d = [&x[..=n], &y[..=n], &z[..=n]];
        convolve!(n, |j, k| {
            for ((force, factor), d) in force.iter_mut().zip(factors).zip(d) {
                *force += factor[j].load(simd) * d[k].load(simd);
            }
        });
        let masses = self.masses.load(simd);
        let [x, y, z] = force;
        let force: [[f64; 4]; 3] = [
            (x * masses).into(),
            (y * masses).into(),
            (z * masses).into(),
        ];
        for (lane, place) in self.places.iter().enumerate() {
            let mut force = Vector3::new(force[0][lane], force[1][lane], force[2][lane]);
            if let Some(attitude) = &self.source.attitude {
                force = attitude * force;
            }
            for (sum, force) in places.force[*place].0.iter_mut().zip(force.iter()) {
                *sum += force;
            }
        }
    }

    /// Coefficient n of `r⁻³`, `r⁻⁵` and `d·Hd r⁻⁷`.
    #[inline(always)]
    fn powers<S: Simd>(&mut self, simd: S, n: usize, p: f64x4<S>) -> [f64x4<S>; 3] {
        let mut powers = [p; 3];
        let [mut u, inverse] = self.squared.inverse_cube(simd);
        for (power, to) in self.powers.iter_mut().zip(&mut powers) {
            if n == 0 {
                power.begin(u);
                *to = u;
                u *= inverse;
            } else {
                *to = power.advance(simd, n, &self.squared);
            }
        }
        let (u, p) = (&self.powers[2].u[..=n], &self.p[..=n]);
        let mut along = f64x4::splat(simd, 0.0);
        convolve!(n, |j, k| {
            along += u[j].load(simd) * p[k].load(simd);
        });
        [powers[0], powers[1], along]
    }
}
