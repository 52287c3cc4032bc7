//! The rotation of a body.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4};
use nalgebra::Vector3;

use super::jet::{Integral, Jet, Lanes, convolve, jet};

/// The coefficients of a body's attitude and angular velocity in its principal axes.
pub(super) struct Rotation {
    /// The quaternion (w, x, y, z).
    pub(super) q: Jet,
    /// Angular velocity ω.
    pub(super) omega: Jet,
    /// (ω_y, ω_z, ω_x) and (ω_z, ω_x, ω_y)
    rotated: [Jet; 2],
    /// The attitude, if forces depend on it.
    pub(super) matrix: Option<Matrix>,
    /// `½` of the angular velocity in the inertial frame and in the body, if both are prescribed.
    prescribed: Option<[Vector3<f64>; 2]>,
    /// Differences of principal moments, each divided by the third one.
    gyroscopic: Lanes,
    /// The inverse principal moments.
    inverse: Lanes,
    /// Coefficient n of the derivative of ω without moments.
    free: Lanes,
}

/// A rotation matrix.
pub(super) struct Matrix {
    pub(super) rows: [Jet; 3],
    /// Each row as (y, z, x).
    pub(super) rotated: [Jet; 3],
    /// Coefficient n of the columns.
    columns: [Lanes; 3],
}

impl Matrix {
    fn new(order: usize) -> Self {
        Self {
            rows: std::array::from_fn(|_| jet(order)),
            rotated: std::array::from_fn(|_| jet(order)),
            columns: [Lanes::default(); 3],
        }
    }

    /// Coefficient n of the products `q_w q`, `q_x q` and `q_y q` gives that of the matrix.
    #[inline(always)]
    fn set(&mut self, n: usize, [w, x, y]: [[f64; 4]; 3]) {
        let one = if n == 0 { 1.0 } else { 0.0 };
        // |q| = 1 replaces q_z².
        let xx = 2.0 * (w[0] + x[1]) - one;
        let yy = 2.0 * (w[0] + y[2]) - one;
        let zz = one - 2.0 * (x[1] + y[2]);
        let (xy, yx) = (2.0 * (x[2] - w[3]), 2.0 * (x[2] + w[3]));
        let (yz, zy) = (2.0 * (y[3] - w[1]), 2.0 * (y[3] + w[1]));
        let (zx, xz) = (2.0 * (x[3] - w[2]), 2.0 * (x[3] + w[2]));
        self.rows[0][n] = Lanes([xx, xy, xz, 0.0]);
        self.rows[1][n] = Lanes([yx, yy, yz, 0.0]);
        self.rows[2][n] = Lanes([zx, zy, zz, 0.0]);
        self.rotated[0][n] = Lanes([xy, xz, xx, 0.0]);
        self.rotated[1][n] = Lanes([yy, yz, yx, 0.0]);
        self.rotated[2][n] = Lanes([zy, zz, zx, 0.0]);
        self.columns[0] = Lanes([xx, yx, zx, 0.0]);
        self.columns[1] = Lanes([xy, yy, zy, 0.0]);
        self.columns[2] = Lanes([xz, yz, zz, 0.0]);
    }

    /// Coefficient n of `R v` for a constant v.
    #[inline(always)]
    pub(super) fn times<S: Simd>(&self, simd: S, v: &Vector3<f64>) -> f64x4<S> {
        let [x, y, z] = &self.columns;
        x.load(simd) * v.x + y.load(simd) * v.y + z.load(simd) * v.z
    }
}

impl Rotation {
    /// A rotation with principal `moments` up to `order`, with its matrix if forces depend on it.
    pub(super) fn new(order: usize, moments: &Vector3<f64>, matrix: bool) -> Self {
        let m = moments;
        let gyroscopic = [(m.y - m.z) / m.x, (m.z - m.x) / m.y, (m.x - m.y) / m.z];
        Self {
            q: jet(order),
            omega: jet(order),
            rotated: [jet(order), jet(order)],
            matrix: matrix.then(|| Matrix::new(order)),
            prescribed: None,
            gyroscopic: Lanes::vector(gyroscopic),
            inverse: Lanes::vector([1.0 / m.x, 1.0 / m.y, 1.0 / m.z]),
            free: Lanes::default(),
        }
    }

    /// Prescribes the angular velocity `rate` in the inertial frame plus `spin` in the body.
    pub(super) fn prescribe(&mut self, rate: &Vector3<f64>, spin: &Vector3<f64>) {
        self.prescribed = Some([0.5 * rate, 0.5 * spin]);
    }

    /// Sets coefficients 0.
    pub(super) fn begin(&mut self, q: Lanes, omega: Lanes) {
        let inverse = 1.0 / q.norm_squared().sqrt();
        self.q[0] = Lanes(q.0.map(|c| c * inverse));
        self.set_omega(0, omega);
    }

    /// The coefficients of ω up to n as (y, z, x) and as (z, x, y).
    #[inline(always)]
    pub(super) fn rotated(&self, n: usize) -> [&[Lanes]; 2] {
        [&self.rotated[0][..=n], &self.rotated[1][..=n]]
    }

    #[inline(always)]
    fn set_omega(&mut self, n: usize, omega: Lanes) {
        let [x, y, z, _] = omega.0;
        self.omega[n] = omega;
        self.rotated[0][n] = Lanes([y, z, x, 0.0]);
        self.rotated[1][n] = Lanes([z, x, y, 0.0]);
    }

    /// Sets coefficient n of the matrix and coefficient n + 1 of the quaternion, from those up to n.
    #[inline(always)]
    pub(super) fn turn<S: Simd>(&mut self, simd: S, n: usize, integral: Integral) {
        let (q, omega) = (&self.q[..=n], &self.omega[..=n]);
        let [yzx, zxy] = [&self.rotated[0][..=n], &self.rotated[1][..=n]];
        let zero = f64x4::splat(simd, 0.0);
        if let Some(matrix) = &mut self.matrix {
            let (mut w, mut x, mut y) = (zero, zero, zero);
            convolve!(n, |j, k| {
                let at_j = q[j].load(simd);
                w += at_j * q[k].broadcast(simd, 0);
                x += at_j * q[k].broadcast(simd, 1);
                y += at_j * q[k].broadcast(simd, 2);
            });
            matrix.set(n, [w.into(), x.into(), y.into()]);
        }
        if let Some([rate, spin]) = &self.prescribed {
            let [w, x, y, z] = q[n].0;
            let u = Vector3::new(x, y, z);
            let next = w * (rate + spin) + rate.cross(&u) + u.cross(spin);
            let next = [-(rate + spin).dot(&u), next.x, next.y, next.z];
            self.q[n + 1] = integral.of(Lanes(next).load(simd)).into();
            return;
        }
        let (mut x, mut y, mut z, mut gyroscopic) = (zero, zero, zero, zero);
        convolve!(n, |j, k| {
            let at_j = q[j].load(simd);
            x += at_j * omega[k].broadcast(simd, 0);
            y += at_j * omega[k].broadcast(simd, 1);
            z += at_j * omega[k].broadcast(simd, 2);
            gyroscopic += yzx[j].load(simd) * zxy[k].load(simd);
        });
        self.free = (gyroscopic * self.gyroscopic.load(simd)).into();
        let [x, y, z]: [[f64; 4]; 3] = [x.into(), y.into(), z.into()];
        let twice = Lanes([
            -(x[1] + y[2] + z[3]),
            x[0] + z[2] - y[3],
            y[0] + x[3] - z[1],
            z[0] + y[1] - x[2],
        ]);
        self.q[n + 1] = integral.of(twice.load(simd) * 0.5).into();
    }

    /// Sets coefficient n + 1 of ω from coefficient n of the moment.
    #[inline(always)]
    pub(super) fn accelerate<S: Simd>(
        &mut self,
        simd: S,
        n: usize,
        integral: Integral,
        moment: f64x4<S>,
    ) {
        let rate = self.free.load(simd) + moment * self.inverse.load(simd);
        self.set_omega(n + 1, integral.of(rate).into());
    }
}
