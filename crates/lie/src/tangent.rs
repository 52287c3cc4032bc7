use nalgebra::{Matrix3, Vector3};

use crate::hat;

/// The exponential map of SO(3) and its derivatives at a rotation vector `ξ`.
///
/// With `S = S(ξ)` and `θ = |ξ|`: `exp S = I + (1 − b θ²) S + a S²` and `J_r = I − a S + b S²`, where `a = (1 − cos
/// θ)/θ²` and `b = (θ − sin θ)/θ³`.
///
/// `J_r` is the right Jacobian, in left trivialization: `R = exp S(ξ)` has the angular velocity `Ω = J_r(ξ) ξ̇`, and a
/// variation `δξ` is `δR = R S(ζ)` with `ζ = J_r(ξ) δξ`. Its transpose is the left Jacobian, `J_l(ξ) = J_r(−ξ) = exp
/// S(ξ) J_r(ξ)`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tangent {
    /// `ξ`
    pub xi: Vector3<f64>,
    /// `cos θ`
    cos: f64,
    /// `sin θ/θ`
    sinc: f64,
    a: f64,
    b: f64,
    /// `(da/dθ)/θ`
    a_slope: f64,
    /// `(db/dθ)/θ`
    b_slope: f64,
}

/// Terms of the series in `θ²`. The first omitted term is below rounding for `θ ≤ 1`.
const TERMS: usize = 9;

/// Coefficients of `a = Σ (−θ²)ⁿ/(2n + 2)!`, `b = Σ (−θ²)ⁿ/(2n + 3)!` and of their derivatives divided by θ.
const SERIES: [[f64; 4]; TERMS] = {
    let mut series = [[0.0; 4]; TERMS];
    let (mut a, mut b) = (0.5, 1.0 / 6.0);
    let mut n = 0;
    while n < TERMS {
        series[n][0] = a;
        series[n][1] = b;
        n += 1;
        let k = 2.0 * n as f64;
        a /= -(k + 1.0) * (k + 2.0);
        b /= -(k + 2.0) * (k + 3.0);
        series[n - 1][2] = k * a;
        series[n - 1][3] = k * b;
    }
    series
};

impl Tangent {
    /// Evaluates the coefficients at `xi`, by series up to `θ = 1` and by closed forms beyond.
    pub fn at(xi: Vector3<f64>) -> Self {
        let squared = xi.norm_squared();
        if squared <= 1.0 {
            let mut sums = [0.0; 4];
            for terms in SERIES.iter().rev() {
                for (sum, term) in sums.iter_mut().zip(terms) {
                    *sum = *sum * squared + term;
                }
            }
            let [a, b, a_slope, b_slope] = sums;
            return Self {
                xi,
                cos: 1.0 - a * squared,
                sinc: 1.0 - b * squared,
                a,
                b,
                a_slope,
                b_slope,
            };
        }
        let angle = squared.sqrt();
        let (sin, cos) = libm::sincos(angle);
        let a = (1.0 - cos) / squared;
        let b = (angle - sin) / (squared * angle);
        Self {
            xi,
            cos,
            sinc: sin / angle,
            a,
            b,
            a_slope: (sin / angle - 2.0 * a) / squared,
            b_slope: (a - 3.0 * b) / squared,
        }
    }

    /// `exp S(ξ)`.
    pub fn rotation(&self) -> Matrix3<f64> {
        self.combine(self.cos, self.sinc, self.a)
    }

    /// The right Jacobian `J_r(ξ)`.
    pub fn jacobian(&self) -> Matrix3<f64> {
        self.combine(self.sinc, -self.a, self.b)
    }

    /// `unit I + skew S(ξ) + square ξ ξᵀ`
    fn combine(&self, unit: f64, skew: f64, square: f64) -> Matrix3<f64> {
        let s = skew * self.xi;
        let q = square * self.xi;
        let (x, y, z) = (self.xi.x, self.xi.y, self.xi.z);
        Matrix3::new(
            unit + q.x * x,
            q.x * y - s.z,
            q.x * z + s.y,
            q.x * y + s.z,
            unit + q.y * y,
            q.y * z - s.x,
            q.x * z - s.y,
            q.y * z + s.x,
            unit + q.z * z,
        )
    }

    /// `D(ξ, y) = ∂(J_r(ξ) y)/∂ξ` at fixed `y`. With `w = ξ × y`, `D = (b'/θ ξ × w − a'/θ w) ξᵀ + a S(y) − b (S(w) +
    /// S(ξ) S(y))`.
    pub fn derivative(&self, y: &Vector3<f64>) -> Matrix3<f64> {
        let w = self.xi.cross(y);
        let along = self.b_slope * self.xi.cross(&w) - self.a_slope * w;
        along * self.xi.transpose() + self.a * hat(y) - self.b * (hat(&w) + hat(&self.xi) * hat(y))
    }

    /// `D(ξ, y)ᵀ p`.
    pub fn derivative_transposed(&self, y: &Vector3<f64>, p: &Vector3<f64>) -> Vector3<f64> {
        let w = self.xi.cross(y);
        let along = self.b_slope * self.xi.cross(&w) - self.a_slope * w;
        along.dot(p) * self.xi - self.a * y.cross(p)
            + self.b * (w.cross(p) + y.cross(&p.cross(&self.xi)))
    }

    /// `∂(D(ξ, y)ᵀ p)/∂ξ` at fixed `y` and `p`, without the terms of second order in `ξ`, whose factor is `b'/θ ≈
    /// −1/60`. This is accurate enough for a Newton iteration.
    pub fn second_derivative(&self, y: &Vector3<f64>, p: &Vector3<f64>) -> Matrix3<f64> {
        let n = y.cross(p);
        let (sy, sp) = (hat(y), hat(p));
        let outer = self.xi * n.transpose();
        self.b * (sp * sy + sy * sp)
            - self.a_slope
                * (Matrix3::from_diagonal_element(self.xi.dot(&n)) + outer + outer.transpose())
    }

    /// The map and its derivatives at `−ξ`.
    pub fn reversed(&self) -> Self {
        Self {
            xi: -self.xi,
            ..*self
        }
    }
}
