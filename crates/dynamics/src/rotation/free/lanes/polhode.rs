//! The polhode and the motion along it, in lanes, for arguments u that need neither the period nor Landen's
//! transformation.

use super::super::elliptic::Jacobi;
use super::super::polhode::{Ratio, STEADY};
use crate::lane::{Lane, Vector};

/// As [`polhode::Polhode`](super::super::polhode::Polhode), with the same names.
pub(super) struct Polhode<T> {
    minor: T,
    middle: T,
    major: T,
    ratio: Ratio<T>,
    other: T,
    m: T,
    pub(super) amplitude: T,
    pub(super) nu: T,
    pub(super) first_squared: T,
    /// Mask of the lanes in which the major axis is the pole.
    pub(super) round_pole: u32,
    /// Mask of the lanes in which Π moves.
    pub(super) moving: u32,
}

impl<T: Lane> Polhode<T> {
    #[inline(always)]
    pub(super) fn through(a: &Vector<T>, near: &Ratio<T>, far: &Ratio<T>) -> Self {
        let (p, p_far) = (near.value, far.value);
        let first_squared = a.x * a.x + p_far * a.y * a.y;
        let pole_squared = a.z * a.z + p * a.y * a.y;
        let (first_part, pole_part) = (p * a.x * a.x, p_far * a.z * a.z);
        let steady = p.constant(STEADY);
        let still = first_squared.below(steady) | (first_part + pole_part).below(steady * p);
        let round = first_part.at_most(pole_part);
        let ratio = Ratio {
            value: p_far.where_in(round, p),
            root: far.root.where_in(round, near.root),
        };
        let other = p.where_in(round, p_far);
        let minor_squared = first_squared.where_in(round, pole_squared);
        let major_squared = pole_squared.where_in(round, first_squared);
        let nu = p.where_in(round, pole_squared) / p_far.where_in(round, first_squared);
        let (minor, major) = (a.x.where_in(round, a.z), a.z.where_in(round, a.x));
        let one = p.constant(1.0);
        let m = other * minor_squared * (one / (ratio.value * major_squared));
        Self {
            minor,
            middle: a.y,
            major,
            ratio,
            other,
            m: m.where_in(m.at_most(one), one),
            amplitude: major_squared.sqrt().copysign(major),
            nu,
            first_squared,
            round_pole: round,
            moving: !still,
        }
    }

    /// `√r A`.
    #[inline(always)]
    pub(super) fn rate(&self) -> T {
        self.ratio.root * self.amplitude
    }

    /// The elliptic functions at u, and a mask of the lanes in which they are valid.
    #[inline(always)]
    pub(super) fn functions(&self, u: T, lanes: u32) -> (Jacobi<T>, u32) {
        let size = u.abs();
        let small = size.at_most(u.constant(Jacobi::SMALL));
        let doubled = lanes & small & !size.at_most(u.constant(Jacobi::SERIES));
        if doubled == 0 {
            return (Jacobi::series(u, self.m), small);
        }
        let series = Jacobi::series((u * 0.25).where_in(doubled, u), self.m);
        let Jacobi { sn, cn, dn } = series.doubled(self.m).doubled(self.m);
        let functions = Jacobi {
            sn: sn.where_in(doubled, series.sn),
            cn: cn.where_in(doubled, series.cn),
            dn: dn.where_in(doubled, series.dn),
        };
        (functions, small)
    }

    /// The change of the vector while u grows by the argument of `by`, and a mask of the lanes in which it is valid.
    #[inline(always)]
    pub(super) fn change(&self, by: &Jacobi<T>) -> (Vector<T>, u32) {
        let Jacobi { sn, cn, dn } = *by;
        let (minor, middle, major) = (self.minor, self.middle, self.major);
        let dn0 = major / self.amplitude;
        let squared = sn * sn;
        let denominator = cn * cn + squared * dn0 * dn0;
        let valid = denominator.constant(0.5).below(denominator) & cn.constant(0.0).below(cn);
        let reciprocal = sn.constant(1.0) / denominator;
        let minor_term = -middle * self.ratio.root * dn0 * sn * dn;
        let middle_term = minor * dn0 * sn / self.ratio.root;
        let major_term = -self.other * minor * middle * sn * cn / self.rate();
        let sine = middle / self.amplitude;
        let common = self.other * sine * sine * squared;
        let less_cn = squared / (cn + 1.0);
        let less_dn = self.m * squared / (dn + 1.0);
        let less_both = less_cn + cn * less_dn;
        let minor = (minor * (common - less_cn) + minor_term) * reciprocal;
        let middle = (middle * (common - less_both) + middle_term) * reciprocal;
        let major = (major * (common - less_dn) + major_term) * reciprocal;
        let round = self.round_pole;
        let change = Vector::new(
            minor.where_in(round, major),
            middle,
            major.where_in(round, minor),
        );
        (change, valid)
    }

    /// Mask of the lanes in which a and b are on the same side of the major axis.
    #[inline(always)]
    pub(super) fn same_side(&self, a: &Vector<T>, b: &Vector<T>) -> u32 {
        let middle = a.y * b.y;
        let minor = (a.x * b.x).where_in(self.round_pole, a.z * b.z);
        !(middle + minor).below(middle.constant(0.0))
    }
}
