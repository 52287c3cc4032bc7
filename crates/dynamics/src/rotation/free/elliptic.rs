//! Jacobi's elliptic functions sn, cn, dn of parameter m = k² by Landen's descending transformation, and the quarter
//! period K by the arithmetic-geometric mean.
//!
//! All functions take `m₁ = 1 − m` as input, so that no accuracy is lost as m → 1.

use std::f64::consts::FRAC_PI_2;

use crate::lane::Lane;

/// `sn u`, `cn u`, `dn u`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Jacobi<T = f64> {
    pub(super) sn: T,
    pub(super) cn: T,
    pub(super) dn: T,
}

impl Jacobi {
    /// Largest |u| for [`small`](Self::small).
    pub(super) const SMALL: f64 = 0.25;

    /// Largest |u| for [`series`](Self::series).
    pub(super) const SERIES: f64 = 0.0625;

    /// The functions for |u| ≤ 1/4, by the Maclaurin series of sn up to u¹¹ for |u| ≤ 1/16, and by two doublings
    /// beyond.
    ///
    /// The series has a radius of convergence of at least π/2, which bounds the remainder by `(1/8π)¹² ≈ 2e-17`.
    #[inline]
    pub(super) fn small(u: f64, m: f64) -> Self {
        if u.abs() <= Self::SERIES {
            Self::series(u, m)
        } else {
            Self::series(0.25 * u, m).doubled(m).doubled(m)
        }
    }
}

impl<T: Lane> Jacobi<T> {
    /// The functions for |u| ≤ 1/16.
    #[inline(always)]
    pub(super) fn series(u: T, m: T) -> Self {
        let q = u * u;
        let c3 = m + 1.0;
        let c5 = m * (m + 14.0) + 1.0;
        let c7 = m * (m * (m + 135.0) + 135.0) + 1.0;
        let c9 = m * (m * (m * (m + 1228.0) + 5478.0) + 1228.0) + 1.0;
        let c11 = m * (m * (m * (m * (m + 11_069.0) + 165_826.0) + 165_826.0) + 11_069.0) + 1.0;
        let sum = q
            * (c3 * (-1.0 / 6.0)
                + q * (c5 * (1.0 / 120.0)
                    + q * (c7 * (-1.0 / 5_040.0)
                        + q * (c9 * (1.0 / 362_880.0) + q * c11 * (-1.0 / 39_916_800.0)))));
        Self::first_quarter(u + u * sum, m)
    }

    /// `sn 2u = 2 sn cn dn / (1 − m sn⁴)` (DLMF 22.6.5), for |2u| well below K.
    #[inline(always)]
    pub(super) fn doubled(self, m: T) -> Self {
        let squared = self.sn * self.sn;
        let one = m.constant(1.0);
        let sn = self.sn * 2.0 * self.cn * self.dn / (one - m * squared * squared);
        Self::first_quarter(sn, m)
    }

    /// These functions in `lanes`, and the others elsewhere.
    #[inline(always)]
    pub(super) fn or(self, others: Self, lanes: u32) -> Self {
        Self {
            sn: self.sn.where_in(lanes, others.sn),
            cn: self.cn.where_in(lanes, others.cn),
            dn: self.dn.where_in(lanes, others.dn),
        }
    }

    #[inline(always)]
    fn first_quarter(sn: T, m: T) -> Self {
        let squared = sn * sn;
        let one = m.constant(1.0);
        Self {
            sn,
            cn: (one - squared).sqrt(),
            dn: (one - m * squared).sqrt(),
        }
    }
}

/// The sequence of arithmetic and geometric means that starts from `1` and `k′ = √m₁`.
pub(super) struct Landen {
    means: [(f64, f64); LEVELS],
    depth: usize,
    limit: f64,
}

/// Number of levels, sufficient for every `m₁ ≥` [`LEAST_COMPLEMENT`], which needs 13.
pub(super) const LEVELS: usize = 16;

/// Lower limit of `m₁`. Smaller values are replaced by it, which keeps K finite: about 346.
pub(super) const LEAST_COMPLEMENT: f64 = 1e-300;

/// Relative difference of two means at which the next one, (a − b)²/8a, is below rounding.
pub(super) const CLOSE: f64 = 1e-8;

impl Landen {
    /// Computes the sequence for `0 ≤ m₁ ≤ 1`.
    #[inline]
    pub(super) fn new(m1: f64) -> Self {
        let mut means = [(0.0, 0.0); LEVELS];
        let (mut a, mut b) = (1.0, m1.max(LEAST_COMPLEMENT).sqrt());
        let mut depth = 0;
        loop {
            means[depth] = (a, b);
            depth += 1;
            let mean = 0.5 * (a + b);
            if (a - b).abs() <= CLOSE * a || depth == LEVELS {
                return Self {
                    means,
                    depth,
                    limit: mean,
                };
            }
            (a, b) = (mean, (a * b).sqrt());
        }
    }

    /// The pairs of means, followed by their common limit.
    pub(super) fn means(&self) -> impl Iterator<Item = (f64, f64)> {
        let limits = [(self.limit, self.limit); LEVELS];
        self.means.into_iter().take(self.depth).chain(limits)
    }

    /// `K = π/(2 AGM(1, k′))` (DLMF 19.8.5).
    #[inline]
    pub(super) fn quarter_period(&self) -> f64 {
        FRAC_PI_2 / self.limit
    }

    /// The functions at |u| ≤ K, u ≠ 0.
    ///
    /// With `C_n = a_n cn/sn` of the n-th modulus, Landen's descending transformation (DLMF 22.7(i)) becomes `C_n =
    /// C_{n+1} dn_{n+1}`, `dn_n = (a_{n+1} b_n + C_{n+1}²)/(a_{n+1} a_n + C_{n+1}²)`. No terms cancel, so cn and dn
    /// keep their relative accuracy even if they are small. At the limit, `cn/sn = cot(a u)` and `dn = 1`.
    #[inline]
    pub(super) fn jacobi(&self, u: f64) -> Jacobi {
        let (sin, cos) = libm::sincos(self.limit * u);
        let mut c = self.limit * cos / sin;
        let mut dn = 1.0;
        let mut next = self.limit;
        for &(a, b) in self.means[..self.depth].iter().rev() {
            let squared = c * c;
            c *= dn;
            dn = (next * b + squared) / (next * a + squared);
            next = a;
        }
        let sn = (1.0 / (1.0 + c * c).sqrt()).copysign(u);
        Jacobi { sn, cn: c * sn, dn }
    }
}

/// Decomposes `u = rate × t` into `count × 2K + remainder`, |remainder| ≤ K. The products are computed to twice the
/// working precision, so the remainder has only the error of `rate` and K.
#[inline]
pub(super) fn reduce(rate: f64, t: f64, quarter_period: f64) -> (f64, f64) {
    let half_period = 2.0 * quarter_period;
    let count = (rate * t / half_period).round();
    let (phase, phase_error) = two_product(rate, t);
    let (whole, whole_error) = two_product(count, half_period);
    let remainder = (phase - whole) + (phase_error - whole_error);
    (count, remainder.clamp(-quarter_period, quarter_period))
}

/// `a b` as rounded product and rounding error (Dekker 1971).
#[inline]
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let split = |x: f64| {
        let scaled = 134_217_729.0 * x;
        let high = scaled - (scaled - x);
        (high, x - high)
    };
    let product = a * b;
    let ((a_high, a_low), (b_high, b_low)) = (split(a), split(b));
    let error = a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low);
    (product, error)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Computed with mpmath 1.3.0 and `mp.dps = 260`: `ellipfun(f, u, m=1 - mpf(m1))`, f = 'sn', 'cn', 'dn', and
    /// `ellipk(1 - mpf(m1))`.
    const FUNCTIONS: [(f64, f64, [f64; 3], f64); 10] = [
        (
            1.0,
            0.7,
            [0.644217687237691, 0.7648421872844885, 1.0],
            FRAC_PI_2,
        ),
        (
            0.75,
            0.2,
            [0.198345391214472, 0.9801321879134355, 0.9950702369410888],
            1.685750354812596,
        ),
        (
            0.75,
            -1.3,
            [-0.9440485674912202, 0.329806461758673, 0.8815855463620327],
            1.685750354812596,
        ),
        (
            0.75,
            1.6,
            [0.997242159102727, 0.07421641400749103, 0.866820061504712],
            1.685750354812596,
        ),
        (
            0.5,
            0.05,
            [0.04996877146851736, 0.9987507806644894, 0.9993755855227621],
            1.8540746773013719,
        ),
        (
            0.001,
            0.25,
            [0.24492114114781866, 0.9695430029755515, 0.9695739378635502],
            4.841132560550297,
        ),
        (
            0.001,
            4.0,
            [0.999554689913788, 0.02983993752257426, 0.04346874106159257],
            4.841132560550297,
        ),
        (
            1e-20,
            10.0,
            [
                0.9999999958776927,
                9.079985933778971e-5,
                9.079985933784478e-5,
            ],
            24.412145291060348,
        ),
        (
            1e-20,
            -24.0,
            [-1.0, 4.2391288223277614e-11, 1.0861409354788629e-10],
            24.412145291060348,
        ),
        (
            1e-200,
            3.0,
            [0.9950547536867305, 0.0993279274194332, 0.0993279274194332],
            231.64480366052445,
        ),
    ];

    #[test]
    fn functions_match_mpmath_in_relative_accuracy() {
        for (m1, u, expected, quarter_period) in FUNCTIONS {
            let landen = Landen::new(m1);
            assert!((landen.quarter_period() / quarter_period - 1.0).abs() < 1e-15);
            let check = |Jacobi { sn, cn, dn }: Jacobi| {
                for (value, expected) in [sn, cn, dn].into_iter().zip(expected) {
                    // The sensitivity of cn and dn to u is that of exp(−u).
                    let bound = 1e-15 * (1.0 + u.abs());
                    assert!((value / expected - 1.0).abs() < bound, "{m1} {u}: {value}");
                }
            };
            check(landen.jacobi(u));
            if u.abs() <= Jacobi::SMALL {
                check(Jacobi::small(u, 1.0 - m1));
            }
        }
    }

    #[test]
    fn series_and_landen_agree_for_small_arguments() {
        for m1 in [0.0, 1e-9, 0.1, 0.5, 1.0] {
            for n in 1..=250 {
                let u = 1e-3 * f64::from(n);
                let (small, landen) = (Jacobi::small(u, 1.0 - m1), Landen::new(m1).jacobi(u));
                assert!((small.sn - landen.sn).abs() < 2e-15 * u, "{m1} {u}");
                assert!((small.cn - landen.cn).abs() < 4e-16, "{m1} {u}");
                assert!((small.dn - landen.dn).abs() < 4e-16, "{m1} {u}");
            }
        }
    }

    /// Integer multiples of a period of 1 − 2⁻⁵², which no double can represent.
    #[test]
    fn reduction_keeps_the_products_exactly() {
        let half_period = 1.0 - f64::EPSILON;
        let (count, remainder) = reduce(1e15 + 1.0, 1.0 - f64::EPSILON, 0.5 * half_period);
        assert_eq!((count, remainder), (1e15 + 1.0, 0.0));
        let (count, remainder) = reduce(1e8 + 1.0, 1e7 + 1.0, 0.5 * half_period);
        // (10⁸ + 1)(10⁷ + 1) = 10¹⁵ + 1.1 × 10⁸ + 1, and the remainder is that number times 2⁻⁵².
        let whole = 1_000_000_110_000_001.0;
        assert_eq!(count, whole);
        assert!((remainder - whole * f64::EPSILON).abs() < 1e-16);
    }
}
