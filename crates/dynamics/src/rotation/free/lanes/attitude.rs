//! The algebraic part of the attitude, in lanes.

use super::super::elliptic::Jacobi;
use super::super::polhode::Ratio;
use super::polhode::Polhode;
use crate::lane::{Lane, Vector};
use crate::rotation::LaneQuaternion;

/// A complex number in every lane.
#[derive(Clone, Copy)]
pub(super) struct Complex<T> {
    pub(super) re: T,
    pub(super) im: T,
}

impl<T: Lane> Complex<T> {
    #[inline(always)]
    pub(super) fn times(self, other: Self) -> Self {
        Self {
            re: self.re * other.re - self.im * other.im,
            im: self.re * other.im + self.im * other.re,
        }
    }

    #[inline(always)]
    pub(super) fn conj(self) -> Self {
        Self {
            re: self.re,
            im: -self.im,
        }
    }
}

/// `e^{iχ/2}` and `e^{iε/2}`, up to positive factors, as [`half_chi`](super::super::attitude::half_chi) and
/// [`half_epsilon`](super::super::attitude::half_epsilon), for a and `a + change` on the same side of the major axis.
#[inline(always)]
pub(super) fn half_angles<T: Lane>(
    polhode: &Polhode<T>,
    (near, far): (&Ratio<T>, &Ratio<T>),
    a: &Vector<T>,
    change: &Vector<T>,
    by: &Jacobi<T>,
) -> [Complex<T>; 2] {
    let one = by.sn.constant(1.0);
    let first_squared = polhode.first_squared;
    let scale = one / first_squared.sqrt();
    let (x, y) = (a.x * scale, a.y * scale);
    let (dx, dy) = (change.x * scale, change.y * scale);
    let (x_t, y_t) = (x + dx, y + dy);
    let radii = ((x * x + y * y) * (x_t * x_t + y_t * y_t)).sqrt();
    let b_z = a.z + change.z;

    let sines = by.sn * y * y_t / polhode.amplitude;
    let length = (polhode.nu * by.sn * by.sn + 1.0).sqrt() * radii;
    let round = polhode.round_pole;
    let (along, across) = (
        one - near.value * by.cn * x * x_t,
        (one - by.cn * a.z * b_z) / first_squared,
    );
    let real = far.value.where_in(round, one) * length + along.where_in(round, across);
    let root = (near.value * far.root).where_in(round, near.root);
    let chi = Complex {
        re: real,
        im: root * sines,
    };
    let epsilon = Complex {
        re: (radii + x * x_t + y * y_t) * (a.z * b_z + 1.0 + radii * first_squared),
        im: (a.z + b_z) * (x * dy - y * dx),
    };
    [chi, epsilon]
}

/// As [`least_then_about`](super::super::attitude::least_then_about).
#[inline(always)]
pub(super) fn least_then_about<T: Lane>(
    half_angle: Complex<T>,
    a: &Vector<T>,
    change: &Vector<T>,
) -> LaneQuaternion<T> {
    let b = *a + *change;
    LaneQuaternion {
        w: half_angle.re * (a.dot(b) + 1.0),
        u: change.cross(*a) * half_angle.re + (*a + b) * half_angle.im,
    }
}
