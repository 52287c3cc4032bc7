//! The polhode, the curve of the angular momentum's direction in the body frame, and the motion along it.

use nalgebra::Vector3;

use super::elliptic::{Jacobi, Landen, reduce};
use super::third;

/// A ratio of differences of reciprocal moments, and its square root.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ratio<T = f64> {
    pub(super) value: T,
    pub(super) root: T,
}

impl Ratio {
    pub(super) fn new(value: f64) -> Self {
        Self {
            value,
            root: value.sqrt(),
        }
    }
}

/// The polhode through a unit vector: a loop about its major axis, 3 (the pole) or 1, on which `major = A dn u`,
/// `minor = B cn u`, `middle = (B/√r) sn u`.
pub(super) struct Polhode {
    minor: f64,
    middle: f64,
    major: f64,
    /// r: p′ about the pole, p about axis 1.
    ratio: Ratio,
    /// `1 − r`.
    other: f64,
    m: f64,
    m1: f64,
    /// A, with the sign of the major component.
    pub(super) amplitude: f64,
    /// ν of the integral of the third kind.
    pub(super) nu: f64,
    /// `A₁² = a₁² + p′a₂²`.
    pub(super) first_squared: f64,
    /// True if the major axis is the pole.
    pub(super) round_pole: bool,
}

/// The phase u, as `half_turns × 2K` plus a remainder of magnitude at most K.
pub(super) struct Phase {
    /// Elliptic functions of the remainder.
    pub(super) functions: Jacobi,
    /// Number of half periods. Each `u → u + 2K` is half a turn about the major axis.
    pub(super) half_turns: f64,
    /// `T(u)` of the total u.
    pub(super) third: f64,
}

/// Squared distance from an axis below which Π is treated as lying on it. Otherwise, it would stay equally close to the
/// pole forever, and close to the middle axis for more than 300 of its time constants.
pub(super) const STEADY: f64 = 1e-300;

impl Polhode {
    /// The polhode through `a`, in principal axes, with `near = p` and `far = p′`. Returns `None` on the pole and on
    /// the middle axis, where Π is constant. Π is also constant on axis 1, but nothing is singular there.
    #[inline]
    pub(super) fn through(a: &Vector3<f64>, near: Ratio, far: Ratio) -> Option<Self> {
        let (p, p_far) = (near.value, far.value);
        let first_squared = a.x * a.x + p_far * a.y * a.y;
        let pole_squared = a.z * a.z + p * a.y * a.y;
        let (first_part, pole_part) = (p * a.x * a.x, p_far * a.z * a.z);
        if first_squared < STEADY || first_part + pole_part < STEADY * p {
            return None;
        }
        let round_pole = pole_part >= first_part;
        let (minor, major, ratio, other, minor_squared, major_squared, nu) = if round_pole {
            (a.x, a.z, far, p, first_squared, pole_squared, p / p_far)
        } else {
            let nu = pole_squared / first_squared;
            (a.z, a.x, near, p_far, pole_squared, first_squared, nu)
        };
        let reciprocal = 1.0 / (ratio.value * major_squared);
        Some(Self {
            minor,
            middle: a.y,
            major,
            ratio,
            other,
            m: (other * minor_squared * reciprocal).min(1.0),
            m1: (pole_part - first_part).abs() * reciprocal,
            amplitude: major_squared.sqrt().copysign(major),
            nu,
            first_squared,
            round_pole,
        })
    }

    /// `√r A`, the rate of u in units of `κ |Π|`.
    #[inline]
    pub(super) fn rate(&self) -> f64 {
        self.ratio.root * self.amplitude
    }

    /// The phase at `u = rate × t`.
    #[inline]
    pub(super) fn phase(&self, rate: f64, t: f64) -> Phase {
        let u = rate * t;
        if u.abs() <= Jacobi::SMALL {
            let functions = Jacobi::small(u, self.m);
            return Phase {
                functions,
                half_turns: 0.0,
                third: third::incomplete(&functions, self.nu),
            };
        }
        let landen = Landen::new(self.m1);
        let quarter_period = landen.quarter_period();
        let (half_turns, remainder) = if u.abs() <= quarter_period {
            (0.0, u)
        } else {
            reduce(rate, t, quarter_period)
        };
        let functions = if remainder.abs() <= Jacobi::SMALL {
            Jacobi::small(remainder, self.m)
        } else {
            landen.jacobi(remainder)
        };
        let mut third = third::incomplete(&functions, self.nu);
        if half_turns != 0.0 {
            third += 2.0 * half_turns * third::complete(&landen, self.nu);
        }
        Phase {
            functions,
            half_turns,
            third,
        }
    }

    /// The change of the vector while u grows by the argument of `by`, from the addition theorems (DLMF 22.8(i)) for
    /// `u₀ + u`. The components themselves provide the functions of `u₀`.
    ///
    /// The denominator `1 − m sn² sn₀² = cn² + sn² dn₀²` is a sum of squares. Unless it is small, the changes are
    /// formed from `1 − cn` and `1 − dn` instead of differences, so that small steps have no bias.
    #[inline]
    pub(super) fn change(&self, by: &Jacobi) -> Vector3<f64> {
        let Jacobi { sn, cn, dn } = *by;
        let (minor, middle, major) = (self.minor, self.middle, self.major);
        let dn0 = major / self.amplitude;
        let squared = sn * sn;
        let denominator = cn * cn + squared * dn0 * dn0;
        let reciprocal = 1.0 / denominator;
        let minor_term = -middle * self.ratio.root * dn0 * sn * dn;
        let middle_term = minor * dn0 * sn / self.ratio.root;
        let major_term = -self.other * minor * middle * sn * cn / self.rate();
        let (minor, middle, major) = if denominator > 0.5 && cn > 0.0 {
            // m sn₀² = (1 − r) middle²/A²
            let sine = middle / self.amplitude;
            let common = self.other * sine * sine * squared;
            let less_cn = squared / (1.0 + cn);
            let less_dn = self.m * squared / (1.0 + dn);
            let less_both = less_cn + cn * less_dn;
            (
                (minor * (common - less_cn) + minor_term) * reciprocal,
                (middle * (common - less_both) + middle_term) * reciprocal,
                (major * (common - less_dn) + major_term) * reciprocal,
            )
        } else {
            (
                (minor * cn + minor_term) * reciprocal - minor,
                (middle * cn * dn + middle_term) * reciprocal - middle,
                (major * dn + major_term) * reciprocal - major,
            )
        };
        if self.round_pole {
            Vector3::new(minor, middle, major)
        } else {
            Vector3::new(major, middle, minor)
        }
    }

    /// `b` rotated by half a turn about the major axis, if that brings it to the same side of the axis as `a`, else
    /// `None`.
    #[inline]
    pub(super) fn turned(&self, a: &Vector3<f64>, b: &Vector3<f64>) -> Option<Vector3<f64>> {
        let middle = a.y * b.y;
        if self.round_pole {
            (middle + a.x * b.x < 0.0).then(|| Vector3::new(-b.x, -b.y, b.z))
        } else {
            (middle + a.z * b.z < 0.0).then(|| Vector3::new(b.x, -b.y, -b.z))
        }
    }
}
