//! Moments of forces that act on points of a body.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4};
use nalgebra::Vector3;

use super::jet::{self, Jet, Lanes, convolve, cross, jet};
use super::rotation::Matrix;

/// Distance from a line, relative to that from the origin, that is due to rounding.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// The first moments of the forces on the points of a body, whose product with the attitude is the moment.
pub(super) enum Lever {
    /// The points are on a line along this axis of the body: `B = Σ s f`, `M = a × Rᵀ B`.
    Line { axis: Vector3<f64>, b: Jet },
    /// `A = Σ f ρᵀ` by rows, and each row as (y, z, x): `M = Σ_i A_i × R_i`.
    Solid { rows: [Jet; 3], rotated: [Jet; 3] },
}

impl Lever {
    /// The lever of forces on `points`, or `None` if they are all at the origin.
    pub(super) fn new<'a>(
        points: impl Iterator<Item = &'a Vector3<f64>> + Clone,
        order: usize,
    ) -> Option<Self> {
        let lengths = points.clone().map(Vector3::norm_squared);
        let (longest, _) = points
            .clone()
            .zip(lengths)
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        let axis = longest.try_normalize(0.0)?;
        let aside = |point: &Vector3<f64>| point.cross(&axis).norm() > ROUNDING * point.norm();
        Some(if !points.clone().any(aside) {
            Self::Line {
                axis,
                b: jet(order),
            }
        } else {
            Self::Solid {
                rows: std::array::from_fn(|_| jet(order)),
                rotated: std::array::from_fn(|_| jet(order)),
            }
        })
    }

    /// Products per term of a sum.
    pub(super) fn terms(&self) -> f64 {
        match self {
            Self::Line { .. } => 3.0,
            Self::Solid { .. } => 6.0,
        }
    }

    /// Sets coefficient n from those of the forces on points.
    #[inline(always)]
    pub(super) fn set<'a, S: Simd>(
        &mut self,
        simd: S,
        n: usize,
        forces: impl Iterator<Item = (&'a Vector3<f64>, &'a Lanes)>,
    ) {
        let zero = f64x4::splat(simd, 0.0);
        match self {
            Self::Line { axis, b } => {
                let mut sum = zero;
                for (point, force) in forces {
                    sum += force.load(simd) * point.dot(axis);
                }
                b[n] = sum.into();
            }
            Self::Solid { rows, rotated } => {
                let mut sum = [zero; 3];
                for (point, force) in forces {
                    let point: f64x4<S> = [point.x, point.y, point.z, 0.0].simd_into(simd);
                    for (i, sum) in sum.iter_mut().enumerate() {
                        *sum += force.broadcast(simd, i) * point;
                    }
                }
                for ((jet, rotated), row) in rows.iter_mut().zip(rotated).zip(sum) {
                    jet[n] = row.into();
                    rotated[n] = jet::rotated(simd, row).into();
                }
            }
        }
    }

    /// Coefficient n of the moment in principal axes.
    #[inline(always)]
    pub(super) fn moment<S: Simd>(&self, simd: S, n: usize, matrix: &Matrix) -> f64x4<S> {
        let zero = f64x4::splat(simd, 0.0);
        match self {
            Self::Line { axis, b } => {
                let b = &b[..=n];
                let [x, y, z] = &matrix.rows;
                let (x, y, z) = (&x[..=n], &y[..=n], &z[..=n]);
                let mut sums = [zero; 3];
                convolve!(n, |j, k| {
                    sums[0] += b[j].broadcast(simd, 0) * x[k].load(simd);
                    sums[1] += b[j].broadcast(simd, 1) * y[k].load(simd);
                    sums[2] += b[j].broadcast(simd, 2) * z[k].load(simd);
                });
                cross(simd, axis, sums[0] + sums[1] + sums[2])
            }
            Self::Solid { rows, rotated } => {
                let mut sum = [zero; 2];
                for i in 0..3 {
                    let (a, a_rotated) = (&rows[i][..=n], &rotated[i][..=n]);
                    let (r, r_rotated) = (&matrix.rows[i][..=n], &matrix.rotated[i][..=n]);
                    convolve!(n, |j, k| {
                        sum[0] += a[j].load(simd) * r_rotated[k].load(simd);
                        sum[1] += a_rotated[j].load(simd) * r[k].load(simd);
                    });
                }
                // a × b from a (b_y, b_z, b_x) − (a_y, a_z, a_x) b
                jet::rotated(simd, sum[0] - sum[1])
            }
        }
    }
}
