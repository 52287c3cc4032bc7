//! Random numbers, vectors and rotations that are the same on every machine.

use lgvi_lie::Quaternion;
use nalgebra::{Matrix3, Vector3};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// A stream of random numbers from the generator PCG XSL 128/64 by O'Neill.
#[derive(Clone, Debug)]
pub struct Random(Pcg64Mcg);

impl Random {
    /// Creates stream `index` of `seed`. Each stream has a seed of its own, because segments of a single stream that
    /// are a power of two apart would share the low bits of their states.
    pub fn new(seed: u64, index: u64) -> Self {
        let first = Pcg64Mcg::seed_from_u64(seed).next_u64();
        Self(Pcg64Mcg::seed_from_u64(first.wrapping_add(index)))
    }

    /// Draws a number uniform in `[low, high)`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        let unit = (self.0.next_u64() >> 11) as f64 * (0.5 * f64::EPSILON);
        low + (high - low) * unit
    }

    /// Draws a number in `[low, high)` with a uniform logarithm.
    pub fn log_uniform(&mut self, low: f64, high: f64) -> f64 {
        libm::exp(self.uniform(libm::log(low), libm::log(high)))
    }

    /// Draws one of `0 … count − 1`, or returns 0 if `count` is 0.
    pub fn below(&mut self, count: usize) -> usize {
        (self.uniform(0.0, count as f64) as usize).min(count.saturating_sub(1))
    }

    /// Draws a standard normal number by the Box–Muller transform.
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * libm::log(1.0 - self.uniform(0.0, 1.0))).sqrt();
        radius * libm::cos(self.uniform(0.0, std::f64::consts::TAU))
    }

    /// Draws three standard normal numbers.
    pub fn normals(&mut self) -> Vector3<f64> {
        Vector3::new(self.normal(), self.normal(), self.normal())
    }

    /// Draws a unit vector, uniform on the sphere.
    pub fn direction(&mut self) -> Vector3<f64> {
        let height = self.uniform(-1.0, 1.0);
        let angle = self.uniform(0.0, std::f64::consts::TAU);
        let radius = (1.0 - height * height).sqrt();
        Vector3::new(radius * libm::cos(angle), radius * libm::sin(angle), height)
    }

    /// Draws a rotation, uniform on SO(3).
    pub fn rotation(&mut self) -> Matrix3<f64> {
        let (w, u) = (self.normal(), self.normals());
        let norm = (w * w + u.norm_squared()).sqrt();
        Quaternion {
            w: w / norm,
            u: u / norm,
        }
        .matrix()
    }
}
