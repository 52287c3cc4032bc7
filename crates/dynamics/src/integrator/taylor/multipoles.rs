//! Attraction of second-order multipoles by each other.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4};
use nalgebra::Matrix3;

use super::body::Body;
use super::jet::{Jet, Lanes, Power, Squared, convolve, jet, rotated, sum_of_three};
use super::places::Places;

/// Two multipoles that attract each other: the asphericity of each interacts with the other's monopole, as in
/// [`Mutual`](crate::gravity::Mutual).
pub(super) struct Multipoles {
    /// Places of both centers.
    centers: [usize; 2],
    /// `G m₁ m₂`
    strength: f64,
    sides: Vec<Side>,
    /// From the second center to the first.
    d: Jet,
    squared: Squared,
    /// `r⁻³, r⁻⁵, r⁻⁷`
    powers: Power,
    /// `Σ 5 G m e·He`
    p: Jet,
    /// The factor of −d in the force on the first center.
    straight: Jet,
}

/// An aspherical body.
pub(super) struct Side {
    body: usize,
    /// `2 G m H` in principal axes, with the mass of the other body.
    second: Matrix3<f64>,
    /// `e = Rᵀ d`, and as (y, z, x).
    e: Jet,
    rotated_e: Jet,
    /// `2 G m H e`
    slope: Jet,
    /// `2 G m H e r⁻⁵`, and as (y, z, x).
    falling: Jet,
    rotated_falling: Jet,
}

impl Side {
    /// The asphericity `second` of a body in its principal axes, attracted by `gm`.
    pub(super) fn new(body: usize, gm: f64, second: &Matrix3<f64>, order: usize) -> Self {
        let jet = || jet(order);
        Self {
            body,
            second: 2.0 * gm * second,
            e: jet(),
            rotated_e: jet(),
            slope: jet(),
            falling: jet(),
            rotated_falling: jet(),
        }
    }

    /// Sets coefficient n of e and of `2 G m H e`.
    #[inline(always)]
    fn look<S: Simd>(&mut self, simd: S, n: usize, d: &Jet, rows: &[Jet; 3]) {
        let d = &d[..=n];
        let rows = [&rows[0][..=n], &rows[1][..=n], &rows[2][..=n]];
        let mut sums = [f64x4::splat(simd, 0.0); 3];
        convolve!(n, |j, k| {
            for (axis, (sum, row)) in sums.iter_mut().zip(rows).enumerate() {
                *sum += d[j].broadcast(simd, axis) * row[k].load(simd);
            }
        });
        let e = sums[0] + sums[1] + sums[2];
        self.e[n] = e.into();
        self.rotated_e[n] = rotated(simd, e).into();
        let [x, y, z] = self.e[n].three();
        let h = &self.second;
        let along = |i| h[(i, 0)] * x + h[(i, 1)] * y + h[(i, 2)] * z;
        self.slope[n] = Lanes::vector([along(0), along(1), along(2)]);
    }

    /// Sets coefficient n of `2 G m H e r⁻⁵`. Returns that of `5 G m e·He`.
    #[inline(always)]
    fn fall<S: Simd>(&mut self, simd: S, n: usize, powers: &Power) -> f64 {
        let zero = f64x4::splat(simd, 0.0);
        let (mut falling, mut p) = (zero, zero);
        let (slope, e, u) = (&self.slope[..=n], &self.e[..=n], &powers.u[..=n]);
        convolve!(n, |j, k| {
            let slope = slope[j].load(simd);
            falling += slope * u[k].broadcast(simd, 1);
            p += slope * e[k].load(simd);
        });
        self.falling[n] = falling.into();
        self.rotated_falling[n] = rotated(simd, falling).into();
        2.5 * sum_of_three(p)
    }

    /// Coefficient n of `2 G m R H e r⁻⁵` in the inertial frame and of the moment in principal axes.
    #[inline(always)]
    fn loads<S: Simd>(&self, simd: S, n: usize, rows: &[Jet; 3]) -> [f64x4<S>; 2] {
        let zero = f64x4::splat(simd, 0.0);
        let (mut across, mut moment) = ([zero; 3], [zero; 2]);
        let rows = [&rows[0][..=n], &rows[1][..=n], &rows[2][..=n]];
        let (falling, rotated_falling) = (&self.falling[..=n], &self.rotated_falling[..=n]);
        let (e, rotated_e) = (&self.e[..=n], &self.rotated_e[..=n]);
        convolve!(n, |j, k| {
            let falling = falling[j].load(simd);
            for (sum, row) in across.iter_mut().zip(rows) {
                *sum += falling * row[k].load(simd);
            }
            moment[0] += falling * rotated_e[k].load(simd);
            moment[1] += rotated_falling[j].load(simd) * e[k].load(simd);
        });
        let [x, y, z] = across;
        let across = [sum_of_three(x), sum_of_three(y), sum_of_three(z), 0.0];
        [across.simd_into(simd), rotated(simd, moment[0] - moment[1])]
    }
}

impl Multipoles {
    /// Products per term of a sum, with this number of aspherical bodies.
    pub(super) fn terms(sides: usize) -> f64 {
        5.0 + 10.0 * sides as f64
    }

    /// Two bodies at these places with the product `strength` of their masses and G.
    pub(super) fn new(centers: [usize; 2], strength: f64, sides: Vec<Side>, order: usize) -> Self {
        Self {
            centers,
            strength,
            sides,
            d: jet(order),
            squared: Squared::new(order),
            powers: Power::new(order, [-1.5, -2.5, -3.5, 0.0]),
            p: jet(order),
            straight: jet(order),
        }
    }

    /// Adds coefficient n of all forces and moments.
    #[inline(always)]
    pub(super) fn add_loads<S: Simd>(
        &mut self,
        simd: S,
        n: usize,
        places: &mut Places,
        bodies: &mut [Body],
    ) {
        let [one, other] = self.centers;
        self.d[n] = (places.at[one].load(simd) - places.at[other].load(simd)).into();
        self.set_powers(simd, n);
        let mut p = 0.0;
        for side in &mut self.sides {
            if let Some(matrix) = bodies[side.body].matrix() {
                side.look(simd, n, &self.d, &matrix.rows);
                p += side.fall(simd, n, &self.powers);
            }
        }
        self.p[n] = Lanes([p; 4]);
        let zero = f64x4::splat(simd, 0.0);
        let mut along = zero;
        let (p, u) = (&self.p[..=n], &self.powers.u[..=n]);
        convolve!(n, |j, k| {
            along += p[j].load(simd) * u[k].load(simd);
        });
        let [.., along, _]: [f64; 4] = along.into();
        let straight = self.strength * self.powers.u[n].0[0] + along;
        self.straight[n] = Lanes([straight; 4]);
        let mut force = zero;
        let (straight, d) = (&self.straight[..=n], &self.d[..=n]);
        convolve!(n, |j, k| {
            force -= straight[j].load(simd) * d[k].load(simd);
        });
        for side in &self.sides {
            let body = &mut bodies[side.body];
            if let Some(matrix) = body.matrix() {
                let [across, moment] = side.loads(simd, n, &matrix.rows);
                force += across;
                body.moment = (body.moment.load(simd) + moment).into();
            }
        }
        places.force[one] = (places.force[one].load(simd) + force).into();
        places.force[other] = (places.force[other].load(simd) - force).into();
    }

    #[inline(always)]
    fn set_powers<S: Simd>(&mut self, simd: S, n: usize) {
        let d = &self.d[..=n];
        let mut squared = f64x4::splat(simd, 0.0);
        convolve!(n, |j, k| {
            squared += d[j].load(simd) * d[k].load(simd);
        });
        let squared = f64x4::splat(simd, sum_of_three(squared));
        self.squared.set(simd, n, squared);
        if n > 0 {
            self.powers.advance(simd, n, &self.squared);
            return;
        }
        let [third, inverse] = self.squared.inverse_cube(simd).map(|lanes| lanes[0]);
        let fifth = third * inverse;
        let powers = Lanes([third, fifth, fifth * inverse, 0.0]);
        self.powers.begin(powers.load(simd));
    }
}
