//! The elliptic integral of the third kind, in lanes.

use super::super::elliptic::{Jacobi, LEVELS};
use super::super::third::{NEGLIGIBLE, R_C_SERIES, SPREAD, equal, r_c_series};
use super::elliptic::Landen;
use crate::lane::Lane;

/// As [`incomplete`](super::super::third::incomplete), in `lanes`.
#[inline(always)]
pub(super) fn incomplete<T: Lane>(at: &Jacobi<T>, nu: T, lanes: u32) -> T {
    let squared = at.sn * at.sn;
    let arguments = [
        at.cn * at.cn,
        at.dn * at.dn,
        nu.constant(1.0),
        nu * squared + 1.0,
    ];
    at.sn * squared * r_j(arguments, lanes) / 3.0
}

/// As [`complete`](super::super::third::complete), in `lanes`.
#[inline(always)]
pub(super) fn complete<T: Lane>(landen: &Landen<T>, nu: T, lanes: u32) -> T {
    let one = nu.constant(1.0);
    let mut p = (nu + 1.0).sqrt();
    let (mut q, mut sum) = (one, one);
    let mut open = lanes;
    for level in 0..landen.depth() + LEVELS {
        let (a, b) = landen.means(level);
        let (squared, product) = (p * p, a * b);
        q = q * ((squared - product) * 0.5 / (squared + product));
        sum = (sum + q).where_in(open, sum);
        open &= !q.abs().below(sum * NEGLIGIBLE);
        if open == 0 {
            break;
        }
        p = (p + product / p) * 0.5;
    }
    landen.quarter_period() * 0.5 / (nu + 1.0) * sum
}

/// Carlson's `R_J`. The duplication is repeated in the lanes that need it.
#[inline(always)]
fn r_j<T: Lane>([x, y, z, p]: [T; 4], lanes: u32) -> T {
    let mean = (x + y + z + p * 2.0) * 0.2;
    let (below, above) = (mean - x, p - mean);
    let spread = below.where_in(above.at_most(below), above);
    let open = lanes & (mean * SPREAD).below(spread);
    let (zero, one) = (mean.constant(0.0), mean.constant(1.0));
    let mut narrowed = Narrowed {
        arguments: [x, y, z, p],
        mean,
        scale: one,
        sum: zero,
    };
    if open != 0 {
        narrow(&mut narrowed, spread, open);
    }
    let Narrowed {
        arguments: [x, y, z, _],
        mean,
        scale,
        sum,
    } = narrowed;
    let (reciprocal, series) = equal(mean, [x, y, z]);
    sum * 6.0 + scale * reciprocal * reciprocal.sqrt() * series
}

/// Arguments after some duplications.
struct Narrowed<T> {
    arguments: [T; 4],
    mean: T,
    /// `4⁻ⁿ`.
    scale: T,
    sum: T,
}

#[inline(always)]
fn narrow<T: Lane>(narrowed: &mut Narrowed<T>, spread: T, mut open: u32) {
    let [x, y, z, p] = narrowed.arguments;
    let delta = (p - x) * (p - y) * (p - z);
    let mut present = 1.0;
    while open != 0 {
        let Narrowed {
            arguments: [x, y, z, p],
            mean,
            scale,
            sum,
        } = *narrowed;
        let (rx, ry, rz, rp) = (x.sqrt(), y.sqrt(), z.sqrt(), p.sqrt());
        let lambda = rx * ry + ry * rz + rz * rx;
        let d = (rp + rx) * (rp + ry) * (rp + rz);
        let e = delta * (present * present * present) / (d * d);
        let term = d.constant(present) / d * r_c(e, open);
        present *= 0.25;
        *narrowed = Narrowed {
            arguments: [
                quarter(x, lambda).where_in(open, x),
                quarter(y, lambda).where_in(open, y),
                quarter(z, lambda).where_in(open, z),
                quarter(p, lambda).where_in(open, p),
            ],
            mean: quarter(mean, lambda).where_in(open, mean),
            scale: scale.constant(present).where_in(open, scale),
            sum: (sum + term).where_in(open, sum),
        };
        open &= (narrowed.mean * SPREAD).below(spread * present);
    }
}

// A function, because calls inside a closure need not be inlined.
#[inline(always)]
fn quarter<T: Lane>(argument: T, lambda: T) -> T {
    (argument + lambda) * 0.25
}

/// `R_C(1, 1 + e)` in `lanes`.
#[inline(always)]
fn r_c<T: Lane>(e: T, lanes: u32) -> T {
    let mut all = r_c_series(e);
    let large = lanes & e.constant(R_C_SERIES).at_most(e);
    if large != 0 {
        let root = e.sqrt();
        for k in (0..T::COUNT).filter(|k| large & (1 << k) != 0) {
            all.set_lane(k, libm::atan(root.lane(k)) / root.lane(k));
        }
    }
    all
}
