use lgvi_lie::hat;
use nalgebra::{Matrix3, Vector3};

/// The exponential map and its tangents at `ξ`: with `S = S(ξ)`, `θ = |ξ|`,
/// `exp S = I + (1 − b θ²) S + a S²` and `J_r = I − a S + b S²`, `a = (1 − cos θ)/θ²`, `b = (θ − sin θ)/θ³`.
///
/// `J_r` is the `dexp` of §2.2 in left trivialisation: `R = exp S(ξ)` has `Ω = J_r(ξ) ξ̇`, and a variation `δξ` is
/// `δR = R S(ζ)` with `ζ = J_r(ξ) δξ`. Its transpose is `J_r(−ξ) = exp S(ξ) J_r(ξ)`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tangent {
    pub(super) xi: Vector3<f64>,
    squared: f64,
    a: f64,
    b: f64,
    /// `(da/dθ)/θ`
    a_slope: f64,
    /// `(db/dθ)/θ`
    b_slope: f64,
}

/// Terms of the series in `θ²`, whose next is below rounding for `θ ≤ 1`.
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
    pub(super) fn at(xi: Vector3<f64>) -> Self {
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
                squared,
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
            squared,
            a,
            b,
            a_slope: (sin / angle - 2.0 * a) / squared,
            b_slope: (a - 3.0 * b) / squared,
        }
    }

    /// `exp S(ξ)`.
    pub(super) fn rotation(&self) -> Matrix3<f64> {
        self.combine(
            1.0 - self.a * self.squared,
            1.0 - self.b * self.squared,
            self.a,
        )
    }

    /// `J_r(ξ)`.
    pub(super) fn jacobian(&self) -> Matrix3<f64> {
        self.combine(1.0 - self.b * self.squared, -self.a, self.b)
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

    /// `D(ξ, y) = ∂(J_r(ξ) y)/∂ξ` at fixed `y`: with `w = ξ × y`,
    /// `D = (b'/θ ξ × w − a'/θ w) ξᵀ + a S(y) − b (S(w) + S(ξ) S(y))`.
    pub(super) fn derivative(&self, y: &Vector3<f64>) -> Matrix3<f64> {
        let w = self.xi.cross(y);
        let along = self.b_slope * self.xi.cross(&w) - self.a_slope * w;
        along * self.xi.transpose() + self.a * hat(y) - self.b * (hat(&w) + hat(&self.xi) * hat(y))
    }

    /// `D(ξ, y)ᵀ p`.
    pub(super) fn derivative_transposed(&self, y: &Vector3<f64>, p: &Vector3<f64>) -> Vector3<f64> {
        let w = self.xi.cross(y);
        let along = self.b_slope * self.xi.cross(&w) - self.a_slope * w;
        along.dot(p) * self.xi - self.a * y.cross(p)
            + self.b * (w.cross(p) + y.cross(&p.cross(&self.xi)))
    }

    /// `∂(D(ξ, y)ᵀ p)/∂ξ` at fixed `y` and `p`, without the terms of second order in `ξ`, whose factor is `b'/θ ≈ −1/60`:
    /// exact enough for a Newton iteration.
    pub(super) fn second_derivative(&self, y: &Vector3<f64>, p: &Vector3<f64>) -> Matrix3<f64> {
        let n = y.cross(p);
        let (sy, sp) = (hat(y), hat(p));
        let outer = self.xi * n.transpose();
        self.b * (sp * sy + sy * sp)
            - self.a_slope
                * (Matrix3::from_diagonal_element(self.xi.dot(&n)) + outer + outer.transpose())
    }

    /// The same at `−ξ`.
    pub(super) fn reversed(&self) -> Self {
        Self {
            xi: -self.xi,
            ..*self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lgvi_lie::{exp, right_jacobian_inverse};

    fn points() -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>, Vector3<f64>)> {
        let mut rng = fastrand::Rng::with_seed(12);
        let mut unit = move || Vector3::from_fn(|_, _| 2.0 * rng.f64() - 1.0).normalize();
        let angles = [0.0, 1e-9, 1e-3, 0.3, 0.999_999, 1.000_001, 2.0, 3.1];
        (0..20)
            .flat_map(move |_| angles)
            .map(move |angle| (angle * unit(), unit(), unit()))
    }

    /// Both branches, against the closed forms and each other.
    #[test]
    fn maps_are_those_of_the_group() {
        for (xi, ..) in points() {
            let tangent = Tangent::at(xi);
            assert!((tangent.rotation() - exp(&xi)).norm() < 2e-15);
            let product = tangent.jacobian() * right_jacobian_inverse(&xi);
            assert!((product - Matrix3::identity()).norm() < 4e-15);
            let transposed = tangent.jacobian().transpose();
            assert!((transposed - tangent.reversed().jacobian()).norm() < 1e-15);
            assert!((transposed - tangent.rotation() * tangent.jacobian()).norm() < 4e-15);
        }
    }

    #[test]
    fn derivatives_are_those_of_the_maps() {
        let e = 1e-5;
        for (xi, y, p) in points() {
            let tangent = Tangent::at(xi);
            let derivative = tangent.derivative(&y);
            for axis in 0..3 {
                let delta = Vector3::ith(axis, e);
                let [ahead, behind] = [Tangent::at(xi + delta), Tangent::at(xi - delta)];
                let difference = (ahead.jacobian() - behind.jacobian()) * y / (2.0 * e);
                assert!((difference - derivative.column(axis)).norm() < 1e-9);
                let difference = (ahead.derivative_transposed(&y, &p)
                    - behind.derivative_transposed(&y, &p))
                    / (2.0 * e);
                let second = tangent.second_derivative(&y, &p);
                let neglected = 0.1 * xi.norm().powi(2);
                assert!((difference - second.column(axis)).norm() < 1e-9 + neglected);
            }
            let transposed = derivative.transpose() * p;
            assert!((transposed - tangent.derivative_transposed(&y, &p)).norm() < 4e-15);
        }
    }
}
