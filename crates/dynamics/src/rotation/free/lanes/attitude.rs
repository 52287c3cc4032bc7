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

    /// This number in `lanes`, and the other one elsewhere.
    #[inline(always)]
    pub(super) fn or(self, other: Self, lanes: u32) -> Self {
        Self {
            re: self.re.where_in(lanes, other.re),
            im: self.im.where_in(lanes, other.im),
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

/// As [`attitude::Across`](super::super::attitude).
#[derive(Clone, Copy)]
pub(super) struct Across<T> {
    from: (T, T),
    to: (T, T),
    change: (T, T),
    /// `ρ_a ρ_b`.
    radii: T,
}

impl<T: Lane> Across<T> {
    #[inline(always)]
    pub(super) fn new(a: &Vector<T>, change: &Vector<T>, first_squared: T) -> Self {
        let scale = a.x.constant(1.0) / first_squared.sqrt();
        let (x, y) = (a.x * scale, a.y * scale);
        let (dx, dy) = (change.x * scale, change.y * scale);
        let (x_t, y_t) = (x + dx, y + dy);
        Self {
            from: (x, y),
            to: (x_t, y_t),
            change: (dx, dy),
            radii: ((x * x + y * y) * (x_t * x_t + y_t * y_t)).sqrt(),
        }
    }

    /// `e^{iχ/2}` up to a positive factor, as [`half_chi`](super::super::attitude::half_chi).
    #[inline(always)]
    pub(super) fn half_chi(
        &self,
        polhode: &Polhode<T>,
        (near, far): (&Ratio<T>, &Ratio<T>),
        a: &Vector<T>,
        change: &Vector<T>,
        by: &Jacobi<T>,
    ) -> Complex<T> {
        let one = by.sn.constant(1.0);
        let ((x, y), (x_t, y_t)) = (self.from, self.to);
        let sines = by.sn * y * y_t / polhode.amplitude;
        let length = (polhode.nu * by.sn * by.sn + 1.0).sqrt() * self.radii;
        let along = one - near.value * by.cn * x * x_t;
        let across = (one - by.cn * a.z * (a.z + change.z)) / polhode.first_squared;
        let round = polhode.round_pole;
        let root = (near.value * far.root).where_in(round, near.root);
        Complex {
            re: far.value.where_in(round, one) * length + along.where_in(round, across),
            im: root * sines,
        }
    }

    /// `e^{iε/2}` up to a positive factor, as [`half_epsilon`](super::super::attitude::half_epsilon).
    #[inline(always)]
    pub(super) fn half_epsilon(
        &self,
        first_squared: T,
        a: &Vector<T>,
        change: &Vector<T>,
    ) -> Complex<T> {
        let ((x, y), (x_t, y_t), (dx, dy)) = (self.from, self.to, self.change);
        let b_z = a.z + change.z;
        Complex {
            re: (self.radii + x * x_t + y * y_t) * (a.z * b_z + 1.0 + self.radii * first_squared),
            im: (a.z + b_z) * (x * dy - y * dx),
        }
    }
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
