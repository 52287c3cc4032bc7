//! Jacobi's elliptic functions by Landen's transformation, in lanes.

use std::f64::consts::FRAC_PI_2;

use super::super::elliptic::{self, CLOSE, Jacobi, LEAST_COMPLEMENT, LEVELS};
use crate::lane::Lane;

/// As [`elliptic::Landen`].
pub(super) struct Landen<T> {
    means: [(T, T); LEVELS],
    /// Masks of the lanes whose sequence contains the means of a level.
    lanes: [u32; LEVELS],
    depth: usize,
    limit: T,
}

impl<T: Lane> Landen<T> {
    /// Computes the sequence in `lanes`.
    #[inline(always)]
    pub(super) fn new(m1: T, lanes: u32) -> Self {
        let (one, least) = (m1.constant(1.0), m1.constant(LEAST_COMPLEMENT));
        let (mut a, mut b) = (one, m1.where_in(least.at_most(m1), least).sqrt());
        let mut landen = Self {
            means: [(one, one); LEVELS],
            lanes: [0; LEVELS],
            depth: 0,
            limit: one,
        };
        let mut open = lanes;
        while open != 0 && landen.depth < LEVELS {
            landen.means[landen.depth] = (a, b);
            landen.lanes[landen.depth] = open;
            landen.depth += 1;
            let mean = (a + b) * 0.5;
            landen.limit = mean.where_in(open, landen.limit);
            open &= !(a - b).abs().at_most(a * CLOSE);
            (a, b) = (mean, (a * b).sqrt());
        }
        landen
    }

    /// `K`.
    #[inline(always)]
    pub(super) fn quarter_period(&self) -> T {
        self.limit.constant(FRAC_PI_2) / self.limit
    }

    /// The means of a level, which is their limit beyond the last.
    #[inline(always)]
    pub(super) fn means(&self, level: usize) -> (T, T) {
        if level >= self.depth {
            return (self.limit, self.limit);
        }
        let (a, b) = self.means[level];
        let lanes = self.lanes[level];
        (a.where_in(lanes, self.limit), b.where_in(lanes, self.limit))
    }

    /// Number of levels in the lane that has the most.
    #[inline(always)]
    pub(super) fn depth(&self) -> usize {
        self.depth
    }

    /// The functions at |u| ≤ K, u ≠ 0, in `lanes`.
    #[inline(always)]
    pub(super) fn jacobi(&self, u: T, lanes: u32) -> Jacobi<T> {
        let one = u.constant(1.0);
        let (mut sin, mut cos) = (one, one);
        sines(self.limit * u, lanes, (&mut sin, &mut cos));
        let mut c = self.limit * cos / sin;
        let mut dn = one;
        let mut next = self.limit;
        for level in (0..self.depth).rev() {
            let ((a, b), lanes) = (self.means[level], self.lanes[level]);
            let squared = c * c;
            c = (c * dn).where_in(lanes, c);
            dn = ((next * b + squared) / (next * a + squared)).where_in(lanes, dn);
            next = a.where_in(lanes, next);
        }
        let sn = (one / (c * c + 1.0).sqrt()).copysign(u);
        Jacobi { sn, cn: c * sn, dn }
    }
}

/// Sets sine and cosine in these lanes, one by one.
#[inline(never)]
fn sines<T: Lane>(angle: T, lanes: u32, (sin, cos): (&mut T, &mut T)) {
    for k in (0..T::COUNT).filter(|k| lanes & (1 << k) != 0) {
        let (sine, cosine) = libm::sincos(angle.lane(k));
        sin.set_lane(k, sine);
        cos.set_lane(k, cosine);
    }
}

/// Sets the count and the remainder of [`elliptic::reduce`] in these lanes, one by one.
#[inline(never)]
pub(super) fn reduce<T: Lane>(
    rate: T,
    t: f64,
    quarter_period: T,
    lanes: u32,
    (count, remainder): (&mut T, &mut T),
) {
    for k in (0..T::COUNT).filter(|k| lanes & (1 << k) != 0) {
        let (turns, rest) = elliptic::reduce(rate.lane(k), t, quarter_period.lane(k));
        count.set_lane(k, turns);
        remainder.set_lane(k, rest);
    }
}
