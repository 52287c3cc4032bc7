//! Moments of uniform fields.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4};
use lgvi_lie::Quaternion;
use nalgebra::Vector3;

use super::jet::{Integral, Jet, Lanes, convolve, jet};
use super::rotation::Rotation;

/// A uniform field on a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Weight {
    pub(super) acceleration: Vector3<f64>,
    pub(super) mass: f64,
    /// `Σ m ρ`, in principal axes once a body has it.
    pub(super) first_moment: Vector3<f64>,
}

/// The coefficients of a uniform field g as a turning body sees it, `g′ = g × ω`, and its moment `Σ m ρ × g`.
///
/// They do not depend on those of the attitude, which therefore nothing waits for.
pub(super) struct Torque {
    acceleration: Vector3<f64>,
    /// `Σ m ρ`, and the coefficients of g, both in principal axes as (y, z, x) and as (z, x, y).
    first_moment: [Lanes; 2],
    field: [Jet; 2],
}

impl Torque {
    /// The moment of `weight` with its first moment in principal axes.
    pub(super) fn new(weight: &Weight, order: usize) -> Self {
        Self {
            acceleration: weight.acceleration,
            first_moment: both(weight.first_moment.into()),
            field: [jet(order), jet(order)],
        }
    }

    /// Sets coefficient 0.
    pub(super) fn begin(&mut self, rotation: &Rotation) {
        let [w, x, y, z] = rotation.q[0].0;
        let u = Vector3::new(x, y, z);
        let field = Quaternion { w, u }.matrix().tr_mul(&self.acceleration);
        let [yzx, zxy] = both(field.into());
        self.field[0][0] = yzx;
        self.field[1][0] = zxy;
    }

    /// Sets coefficient n + 1 of the field.
    #[inline(always)]
    pub(super) fn turn<S: Simd>(
        &mut self,
        simd: S,
        n: usize,
        integral: Integral,
        rotation: &Rotation,
    ) {
        let [yzx, zxy] = [&self.field[0][..=n], &self.field[1][..=n]];
        let [omega_yzx, omega_zxy] = rotation.rotated(n);
        let zero = f64x4::splat(simd, 0.0);
        let (mut plus, mut minus) = (zero, zero);
        convolve!(n, |j, k| {
            plus += yzx[j].load(simd) * omega_zxy[k].load(simd);
            minus += zxy[j].load(simd) * omega_yzx[k].load(simd);
        });
        let next: [f64; 4] = integral.of(plus - minus).into();
        let [x, y, z, _] = next;
        self.field[0][n + 1] = Lanes([y, z, x, 0.0]);
        self.field[1][n + 1] = Lanes([z, x, y, 0.0]);
    }

    /// Coefficient n of the moment in principal axes.
    #[inline(always)]
    pub(super) fn moment<S: Simd>(&self, simd: S, n: usize) -> f64x4<S> {
        let [yzx, zxy] = &self.first_moment;
        yzx.load(simd) * self.field[1][n].load(simd) - zxy.load(simd) * self.field[0][n].load(simd)
    }
}

/// A vector as (y, z, x) and as (z, x, y).
fn both([x, y, z]: [f64; 3]) -> [Lanes; 2] {
    [Lanes::vector([y, z, x]), Lanes::vector([z, x, y])]
}
