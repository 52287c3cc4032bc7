//! The algebraic part of the attitude: conversion from Euler angles about the pole to the least rotation between two
//! directions.
//!
//! Angles are represented by complex numbers of any length and halved by `e^{iα/2} ∝ |z| + z`, `α = arg z`. This is
//! accurate because every z here has a nonnegative real part.

use lgvi_lie::Quaternion;
use nalgebra::{Complex, Vector3};

use super::elliptic::Jacobi;
use super::polhode::{Polhode, Ratio};

/// The coordinates of a and of `b = a + change` perpendicular to the pole, in units of `A₁`.
struct Across {
    from: (f64, f64),
    to: (f64, f64),
    change: (f64, f64),
}

impl Across {
    #[inline]
    fn new(a: &Vector3<f64>, change: &Vector3<f64>, first_squared: f64) -> Self {
        let scale = 1.0 / first_squared.sqrt();
        let (from, change) = (
            (a.x * scale, a.y * scale),
            (change.x * scale, change.y * scale),
        );
        Self {
            from,
            to: (from.0 + change.0, from.1 + change.1),
            change,
        }
    }

    /// `ρ_a ρ_b`.
    #[inline]
    fn radii(&self) -> f64 {
        let ((x, y), (x_t, y_t)) = (self.from, self.to);
        ((x * x + y * y) * (x_t * x_t + y_t * y_t)).sqrt()
    }
}

/// `e^{iχ/2}`, up to a positive factor, for the `change` along the polhode. `by` contains the elliptic functions of the
/// argument of this change.
#[inline]
pub(super) fn half_chi(
    polhode: &Polhode,
    (near, far): (&Ratio, &Ratio),
    a: &Vector3<f64>,
    change: &Vector3<f64>,
    by: &Jacobi,
) -> Complex<f64> {
    let across = Across::new(a, change, polhode.first_squared);
    let ((x, y), (x_t, y_t)) = (across.from, across.to);
    let sines = by.sn * y * y_t / polhode.amplitude;
    let length = (1.0 + polhode.nu * by.sn * by.sn).sqrt() * across.radii();
    if polhode.round_pole {
        let real = 1.0 - near.value * by.cn * x * x_t;
        Complex::new(far.value * length + real, near.value * far.root * sines)
    } else {
        let real = (1.0 - by.cn * a.z * (a.z + change.z)) / polhode.first_squared;
        Complex::new(length + real, near.root * sines)
    }
}

/// `e^{iε/2}`, up to a positive factor, for `b = a + change` on the same side of the major axis as a.
#[inline]
pub(super) fn half_epsilon(
    first_squared: f64,
    a: &Vector3<f64>,
    change: &Vector3<f64>,
) -> Complex<f64> {
    let across = Across::new(a, change, first_squared);
    let ((x, y), (x_t, y_t), (dx, dy)) = (across.from, across.to, across.change);
    let (radii, b_z) = (across.radii(), a.z + change.z);
    Complex::new(
        (radii + x * x_t + y * y_t) * (1.0 + a.z * b_z + radii * first_squared),
        (a.z + b_z) * (x * dy - y * dx),
    )
}

/// The least rotation that takes `b = a + change` to a, followed by the rotation about a by twice the argument of
/// `half_angle`.
#[inline]
pub(super) fn least_then_about(
    half_angle: Complex<f64>,
    a: &Vector3<f64>,
    change: &Vector3<f64>,
) -> Quaternion {
    let b = a + change;
    Quaternion {
        w: half_angle.re * (1.0 + a.dot(&b)),
        u: half_angle.re * change.cross(a) + half_angle.im * (a + b),
    }
}
