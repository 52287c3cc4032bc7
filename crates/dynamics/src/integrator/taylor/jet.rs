//! Taylor coefficients in time of several functions at once.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4};
use nalgebra::Vector3;

/// Four numbers, one per lane of a vector register.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(32))]
pub(super) struct Lanes(pub(super) [f64; 4]);

/// The Taylor coefficients of four functions, by order.
pub(super) type Jet = Box<[Lanes]>;

/// A jet of zeros up to `order`.
pub(super) fn jet(order: usize) -> Jet {
    vec![Lanes::default(); order + 1].into()
}

impl Lanes {
    pub(super) fn vector([x, y, z]: [f64; 3]) -> Self {
        Self([x, y, z, 0.0])
    }

    #[inline(always)]
    pub(super) fn load<S: Simd>(&self, simd: S) -> f64x4<S> {
        self.0.simd_into(simd)
    }

    /// One of the numbers in all lanes.
    #[inline(always)]
    pub(super) fn broadcast<S: Simd>(&self, simd: S, lane: usize) -> f64x4<S> {
        f64x4::splat(simd, self.0[lane])
    }

    /// The first three numbers.
    #[inline(always)]
    pub(super) fn three(&self) -> [f64; 3] {
        let [x, y, z, _] = self.0;
        [x, y, z]
    }

    /// The sum of squares.
    pub(super) fn norm_squared(&self) -> f64 {
        let [x, y, z, w] = self.0;
        (x * x + y * y) + (z * z + w * w)
    }
}

impl<S: Simd> From<f64x4<S>> for Lanes {
    #[inline(always)]
    fn from(vector: f64x4<S>) -> Self {
        Self(vector.into())
    }
}

/// `1/n` in two parts, of which the first has 26 bits.
///
/// Products with the rounded `1/n` have the same relative error in all steps, which adds up. The error of this sum is
/// rounding alone.
#[derive(Clone, Copy)]
struct Reciprocal([f64; 2]);

impl Reciprocal {
    #[inline(always)]
    fn of(n: usize) -> Self {
        let n = n as f64;
        let high = f64::from_bits((1.0 / n).to_bits() & (u64::MAX << 27));
        Self([high, (1.0 - high * n) / n])
    }
}

/// Coefficients n + 1 of functions from coefficients n of their derivatives, in a unit of time that is a power of two.
#[derive(Clone, Copy)]
pub(super) struct Integral([f64; 2]);

impl Integral {
    #[inline(always)]
    pub(super) fn new(unit: f64, n: usize) -> Self {
        let Reciprocal([high, low]) = Reciprocal::of(n + 1);
        Self([unit * high, unit * low])
    }

    #[inline(always)]
    pub(super) fn of<S: Simd>(self, derivative: f64x4<S>) -> f64x4<S> {
        let [high, low] = self.0;
        derivative * high + derivative * low
    }
}

/// `(y, z, x)`.
#[inline(always)]
pub(super) fn rotated<S: Simd>(simd: S, vector: f64x4<S>) -> f64x4<S> {
    let [x, y, z, _]: [f64; 4] = vector.into();
    [y, z, x, 0.0].simd_into(simd)
}

/// The vector product with a constant.
#[inline(always)]
pub(super) fn cross<S: Simd>(simd: S, a: &Vector3<f64>, b: f64x4<S>) -> f64x4<S> {
    let b_rotated = rotated(simd, b);
    let plus: f64x4<S> = [a.z, a.x, a.y, 0.0].simd_into(simd);
    let minus: f64x4<S> = [a.y, a.z, a.x, 0.0].simd_into(simd);
    minus * rotated(simd, b_rotated) - plus * b_rotated
}

/// What rounding has left out of a number to which every step adds: compensated summation, by Knuth's exact sum of two.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Remainder(Lanes);

impl Remainder {
    /// The number with a change, for an output within the step.
    #[inline(always)]
    pub(super) fn sum<S: Simd>(&self, simd: S, number: &Lanes, change: f64x4<S>) -> Lanes {
        (number.load(simd) + (change + self.0.load(simd))).into()
    }

    /// Adds a change to the number; returns the sum.
    #[inline(always)]
    pub(super) fn add<S: Simd>(&mut self, simd: S, number: &Lanes, change: f64x4<S>) -> Lanes {
        let number = number.load(simd);
        let change = change + self.0.load(simd);
        let sum = number + change;
        let added = sum - number;
        self.0 = ((number - (sum - added)) + (change - added)).into();
        sum.into()
    }
}

/// The changes from time 0 to t.
#[inline(always)]
pub(super) fn changes<S: Simd, const COUNT: usize>(
    simd: S,
    jets: [&Jet; COUNT],
    t: f64,
) -> [f64x4<S>; COUNT] {
    let mut sums = [f64x4::splat(simd, 0.0); COUNT];
    let length = jets[0].len();
    for k in (1..length).rev() {
        for (sum, jet) in sums.iter_mut().zip(jets) {
            *sum = (*sum + jet[k].load(simd)) * t;
        }
    }
    sums
}

/// The sum of the first three lanes.
#[inline(always)]
pub(super) fn sum_of_three<S: Simd>(vector: f64x4<S>) -> f64 {
    let [x, y, z, _]: [f64; 4] = vector.into();
    x + y + z
}

/// Executes a block for all `j + k = n`, those with the newest coefficients last, so that the other ones need not wait for
/// them.
macro_rules! convolve {
    ($n:expr, |$j:ident, $k:ident| $block:block) => {{
        let n: usize = $n;
        for $j in 1..n {
            let $k = n - $j;
            $block
        }
        if n > 0 {
            let ($j, $k) = (n, 0);
            $block
        }
        let ($j, $k) = (0, n);
        $block
    }};
}

pub(super) use convolve;

/// The coefficients of the square of a distance in each lane.
pub(super) struct Squared {
    /// `s_k`
    s: Jet,
    /// `k s_k`
    weighted: Jet,
    /// `1/s₀`
    inverse: Lanes,
}

/// The coefficients of a power `u = s^α` for each lane.
///
/// From `s u′ = α s′ u` follows `n s₀ u_n = α Σ_{j<n} (n − j) s_{n−j} u_j − Σ_{j<n} s_{n−j} j u_j` (Jorba and Zou 2005).
pub(super) struct Power {
    exponent: Lanes,
    pub(super) u: Jet,
    /// `j u_j`
    weighted: Jet,
}

impl Squared {
    pub(super) fn new(order: usize) -> Self {
        Self {
            s: jet(order),
            weighted: jet(order),
            inverse: Lanes::default(),
        }
    }

    /// Sets coefficient n.
    #[inline(always)]
    pub(super) fn set<S: Simd>(&mut self, simd: S, n: usize, s: f64x4<S>) {
        self.s[n] = s.into();
        self.weighted[n] = (s * n as f64).into();
        if n == 0 {
            self.inverse = (f64x4::splat(simd, 1.0) / s).into();
        }
    }

    /// `r⁻³` and `r⁻²` from coefficients 0.
    #[inline(always)]
    pub(super) fn inverse_cube<S: Simd>(&self, simd: S) -> [f64x4<S>; 2] {
        let inverse = self.inverse.load(simd);
        [inverse * inverse * self.s[0].load(simd).sqrt(), inverse]
    }
}

impl Power {
    pub(super) fn new(order: usize, exponent: [f64; 4]) -> Self {
        Self {
            exponent: Lanes(exponent),
            u: jet(order),
            weighted: jet(order),
        }
    }

    /// Sets coefficient 0.
    #[inline(always)]
    pub(super) fn begin<S: Simd>(&mut self, u: f64x4<S>) {
        self.u[0] = u.into();
        self.weighted[0] = Lanes::default();
    }

    /// Sets coefficient n > 0 and returns it.
    #[inline(always)]
    pub(super) fn advance<S: Simd>(&mut self, simd: S, n: usize, base: &Squared) -> f64x4<S> {
        let zero = f64x4::splat(simd, 0.0);
        let (s, weighted_s) = (&base.s[..=n], &base.weighted[..=n]);
        let (u, weighted_u) = (&self.u[..n], &self.weighted[..n]);
        let (mut rising, mut falling) = (zero, zero);
        for j in 1..n {
            let k = n - j;
            rising += weighted_s[k].load(simd) * u[j].load(simd);
            falling += s[k].load(simd) * weighted_u[j].load(simd);
        }
        rising += weighted_s[n].load(simd) * u[0].load(simd);
        let inverse = base.inverse.load(simd);
        let Reciprocal([high, low]) = Reciprocal::of(n);
        let sum = self.exponent.load(simd) * rising - falling;
        let u = sum * (inverse * high) + sum * (inverse * low);
        self.u[n] = u.into();
        self.weighted[n] = (u * n as f64).into();
        u
    }
}

/// Coefficient n of `x²`, `y²` and `z²`.
#[inline(always)]
pub(super) fn squares<S: Simd>(simd: S, d: &[Jet; 3], n: usize) -> [f64x4<S>; 3] {
    let d = [&d[0][..=n], &d[1][..=n], &d[2][..=n]];
    let mut sums = [f64x4::splat(simd, 0.0); 3];
    for j in 1..n.div_ceil(2) {
        for (sum, d) in sums.iter_mut().zip(d) {
            *sum += d[j].load(simd) * d[n - j].load(simd);
        }
    }
    for (sum, d) in sums.iter_mut().zip(d) {
        let middle = d[n / 2].load(simd);
        let newest = d[0].load(simd) * d[n].load(simd);
        *sum = match n {
            0 => newest,
            _ if n.is_multiple_of(2) => (*sum + newest) * 2.0 + middle * middle,
            _ => (*sum + newest) * 2.0,
        };
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The product of the first part with n is exact, so that both together are 1/n to more than twice the digits of a part.
    #[test]
    fn reciprocals_are_known_to_twice_the_digits() {
        for n in 1..=64 {
            let Reciprocal([high, low]) = Reciprocal::of(n);
            let n = n as f64;
            assert_eq!((high * n).to_bits() & ((1 << 20) - 1), 0, "{n}: {high}");
            let rest = (1.0 - high * n) - low * n;
            assert!(rest.abs() < 1e-23, "{n}: {rest:e}");
        }
    }
}
