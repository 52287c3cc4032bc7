//! Double-double arithmetic: numbers represented as the sum of a value and its rounding error (Dekker 1971).

use std::ops::{Add, Mul, Sub};

/// The sum of both numbers. The second is at most half a unit in the last place of the first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DoubleDouble(pub f64, pub f64);

/// 2π.
pub(crate) const TAU: DoubleDouble =
    DoubleDouble(std::f64::consts::TAU, 2.449_293_598_294_706_4e-16);

impl DoubleDouble {
    fn normalized(high: f64, low: f64) -> Self {
        let sum = high + low;
        Self(sum, low - (sum - high))
    }

    pub(crate) fn square_root(self) -> Self {
        let root = Self::from(self.0.sqrt());
        let rest = self - root * root;
        Self::normalized(root.0, rest.0 / (2.0 * root.0))
    }

    pub(crate) fn reciprocal(self) -> Self {
        let inverse = Self::from(1.0 / self.0);
        inverse + inverse * (Self::from(1.0) - self * inverse)
    }

    /// Returns the angle modulo 2π, in −π … π.
    pub(crate) fn reduced(self) -> f64 {
        let turns = (self.0 / TAU.0).round();
        (self - TAU * Self::from(turns)).0
    }
}

impl From<f64> for DoubleDouble {
    fn from(value: f64) -> Self {
        Self(value, 0.0)
    }
}

impl Add for DoubleDouble {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let sum = self.0 + other.0;
        let part = sum - self.0;
        let rest = (self.0 - (sum - part)) + (other.0 - part);
        Self::normalized(sum, rest + self.1 + other.1)
    }
}

impl Sub for DoubleDouble {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + Self(-other.0, -other.1)
    }
}

impl Mul for DoubleDouble {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let product = self.0 * other.0;
        let rest = libm::fma(self.0, other.0, -product);
        Self::normalized(product, rest + self.0 * other.1 + self.1 * other.0)
    }
}
