//! The polhode and the motion along it, in lanes.

use super::super::elliptic::Jacobi;
use super::super::polhode::{Ratio, STEADY};
use super::elliptic::{Landen, reduce};
use super::third::{complete, incomplete};
use crate::lane::{Lane, Vector};

/// As [`polhode::Phase`](super::super::polhode::Phase).
pub(super) struct Phase<T> {
    pub(super) functions: Jacobi<T>,
    pub(super) half_turns: T,
    pub(super) third: T,
}

/// As [`polhode::Polhode`](super::super::polhode::Polhode), with the same names.
pub(super) struct Polhode<T> {
    minor: T,
    middle: T,
    major: T,
    ratio: Ratio<T>,
    other: T,
    m: T,
    m1: T,
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
        let reciprocal = one / (ratio.value * major_squared);
        let m = other * minor_squared * reciprocal;
        Self {
            minor,
            middle: a.y,
            major,
            ratio,
            other,
            m: m.where_in(m.at_most(one), one),
            m1: (pole_part - first_part).abs() * reciprocal,
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

    /// The phase at `u = rate × t`, in `lanes`.
    #[inline(always)]
    pub(super) fn phase(&self, rate: T, t: f64, lanes: u32) -> Phase<T> {
        let u = rate * t;
        let mut phase = Phase {
            half_turns: u.constant(0.0),
            functions: self.small(u, lanes),
            third: u,
        };
        let large = lanes & !u.abs().at_most(u.constant(Jacobi::SMALL));
        if large == 0 {
            phase.third = incomplete(&phase.functions, self.nu, lanes);
            return phase;
        }
        let landen = Landen::new(self.m1, large);
        let quarter_period = landen.quarter_period();
        let mut remainder = u;
        let over = large & !u.abs().at_most(quarter_period);
        if over != 0 {
            let parts = (&mut phase.half_turns, &mut remainder);
            reduce(rate, t, quarter_period, over, parts);
            phase.functions = self.small(remainder, lanes);
        }
        let large = large & !remainder.abs().at_most(u.constant(Jacobi::SMALL));
        if large != 0 {
            let functions = landen.jacobi(remainder, large);
            phase.functions = functions.or(phase.functions, large);
        }
        phase.third = incomplete(&phase.functions, self.nu, lanes);
        if over != 0 {
            let whole = phase.half_turns * 2.0 * complete(&landen, self.nu, over);
            phase.third = (phase.third + whole).where_in(over, phase.third);
        }
        phase
    }

    /// The elliptic functions at |u| ≤ 1/4.
    #[inline(always)]
    fn small(&self, u: T, lanes: u32) -> Jacobi<T> {
        let doubled = lanes & !u.abs().at_most(u.constant(Jacobi::SERIES));
        if doubled == 0 {
            return Jacobi::series(u, self.m);
        }
        let series = Jacobi::series((u * 0.25).where_in(doubled, u), self.m);
        series.doubled(self.m).doubled(self.m).or(series, doubled)
    }

    /// The change of the vector while u grows by the argument of `by`, in `lanes`.
    #[inline(always)]
    pub(super) fn change(&self, by: &Jacobi<T>, lanes: u32) -> Vector<T> {
        let Jacobi { sn, cn, dn } = *by;
        let (minor, middle, major) = (self.minor, self.middle, self.major);
        let dn0 = major / self.amplitude;
        let squared = sn * sn;
        let denominator = cn * cn + squared * dn0 * dn0;
        let direct = denominator.constant(0.5).below(denominator) & cn.constant(0.0).below(cn);
        let reciprocal = sn.constant(1.0) / denominator;
        let minor_term = -middle * self.ratio.root * dn0 * sn * dn;
        let middle_term = minor * dn0 * sn / self.ratio.root;
        let major_term = -self.other * minor * middle * sn * cn / self.rate();
        let sine = middle / self.amplitude;
        let common = self.other * sine * sine * squared;
        let less_cn = squared / (cn + 1.0);
        let less_dn = self.m * squared / (dn + 1.0);
        let less_both = less_cn + cn * less_dn;
        let mut by_minor = (minor * (common - less_cn) + minor_term) * reciprocal;
        let mut by_middle = (middle * (common - less_both) + middle_term) * reciprocal;
        let mut by_major = (major * (common - less_dn) + major_term) * reciprocal;
        if lanes & !direct != 0 {
            let to_minor = (minor * cn + minor_term) * reciprocal;
            let to_middle = (middle * cn * dn + middle_term) * reciprocal;
            let to_major = (major * dn + major_term) * reciprocal;
            by_minor = by_minor.where_in(direct, to_minor - minor);
            by_middle = by_middle.where_in(direct, to_middle - middle);
            by_major = by_major.where_in(direct, to_major - major);
        }
        let round = self.round_pole;
        Vector::new(
            by_minor.where_in(round, by_major),
            by_middle,
            by_major.where_in(round, by_minor),
        )
    }

    /// `b` rotated by half a turn about the major axis.
    #[inline(always)]
    pub(super) fn turned(&self, b: &Vector<T>) -> Vector<T> {
        let round = self.round_pole;
        Vector::new((-b.x).where_in(round, b.x), -b.y, b.z.where_in(round, -b.z))
    }

    /// Mask of the lanes in which a and b are on the same side of the major axis.
    #[inline(always)]
    pub(super) fn same_side(&self, a: &Vector<T>, b: &Vector<T>) -> u32 {
        let middle = a.y * b.y;
        let minor = (a.x * b.x).where_in(self.round_pole, a.z * b.z);
        !(middle + minor).below(middle.constant(0.0))
    }
}
