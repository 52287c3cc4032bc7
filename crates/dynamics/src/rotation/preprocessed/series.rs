//! The modified moments of inertia as power series in the invariants.
//!
//! The discrete Moser–Veselov step is the exact flow over `h` of a Hamiltonian `K(H, C)`, `C = ½|hΠ|²` and `H = ½ Σ (hΠ_k)² x_k`,
//! with `x_k` the inverse moments (all relative to `tr J`). K is found order by order:
//!
//! - for `F = cay(f)`, (2.6) gives the series of `f` in h, and `Π⁺ = FᵀΠ` equated to the series of the Euler equations' solution
//!   after the time `h ∂K/∂H` gives `∂K/∂H`, a polynomial in H, C and the symmetric functions of the `x_k`;
//! - rotation about principal axis k, where `H = x_k C` and the step turns by `asin(x_k |hΠ|)`, gives what depends on C alone.
//!
//! So `K = H + (e₁H² − e₂HC + e₃C²)/6 + …`, `e_i` the elementary symmetric functions. In body axes the flow turns at the rates
//! `(K_H x_k + K_C) Π_k`. With `x̃_k = σ x_k + d` in place of `x_k` it is therefore that of the body itself if
//! `σ K_H = 1` and `d K_H + K_C = 0` at the modified invariants, two equations that are inverted as power series.
//!
//! Everything is written about the middle moment, with `m` its inverse, `y = H − m C` and `x_k = m + δ_k`: the symmetric functions
//! `p`, `q` of the two other `δ_k` stay harmless where a moment is nearly zero, as `p y` and `q C` are of the order of the
//! squared angle turned by, and no powers of a great `x_k` cancel.

use super::PreprocessedOrder;

/// Highest degree in the invariants.
const DEGREE: usize = 4;

/// Polynomial of the invariants: entry `(a, b)` multiplies `yᵃ Cᵇ`, `a + b ≤ DEGREE`.
type Coefficients = [[f64; DEGREE + 1]; DEGREE + 1];

/// The polynomials in the invariants for one body.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Series {
    scale: Coefficients,
    middle: Coefficients,
}

impl Series {
    /// For the inverse middle moment `m`, and sum `p` and product `q` of the two others' differences from it.
    #[rustfmt::skip]
    pub(super) fn new(order: PreprocessedOrder, m: f64, p: f64, q: f64) -> Self {
        let degree = order.degree();
        let (m2, p2, q2) = (m * m, p * p, q * q);
        let (m3, p3, q3) = (m2 * m, p2 * p, q2 * q);
        let (m4, p4, q4) = (m2 * m2, p2 * p2, q2 * q2);
        let (m5, m6, m7, m8, m9) = (m4 * m, m4 * m2, m4 * m3, m4 * m4, m4 * m4 * m);
        let mut scale = [[0.0; DEGREE + 1]; DEGREE + 1];
        let mut middle = scale;
        scale[0][0] = 1.0;
        middle[0][0] = m;
        scale[0][1] = (-3.0 * m2 + q) / 6.0;
        scale[1][0] = (-3.0 * m - p) / 3.0;
        middle[0][1] = -m3 / 3.0;
        middle[1][0] = (-3.0 * m2 + q) / 6.0;
        if degree >= 2 {
            scale[0][2] = (5.0 * m4 - 5.0 * m2 * q + 2.0 * q2) / 60.0;
            scale[1][1] = (10.0 * m3 + 5.0 * m2 * p - p * q) / 30.0;
            scale[2][0] = (15.0 * m2 + 10.0 * m * p + 2.0 * p2 - q) / 60.0;
            middle[0][2] = m5 / 30.0;
            middle[1][1] = (5.0 * m4 - q2) / 60.0;
            middle[2][0] = (-5.0 * m2 * p - 10.0 * m * q - p * q) / 60.0;
        }
        if degree >= 3 {
            scale[0][3] = (-14.0 * m6 + 35.0 * m4 * q - 42.0 * m2 * q2 + 17.0 * q3) / 2520.0;
            scale[1][2] = (-42.0 * m5 - 35.0 * m4 * p + 21.0 * m2 * p * q - 28.0 * m * q2 - 18.0 * p * q2) / 1260.0;
            scale[2][1] = (-105.0 * m4 - 140.0 * m3 * p - 42.0 * m2 * p2 - 84.0 * m2 * q + 6.0 * p2 * q + 41.0 * q2) / 2520.0;
            scale[3][0] = (-7.0 * m * p2 + 21.0 * m * q - p3 + p * q) / 630.0;
            middle[0][3] = -m7 / 630.0;
            middle[1][2] = (-7.0 * m6 + q3) / 1260.0;
            middle[2][1] = (35.0 * m4 * p + 140.0 * m3 * q + 84.0 * m2 * p * q + 112.0 * m * q2 + 13.0 * p * q2) / 2520.0;
            middle[3][0] = (-21.0 * m2 * p2 + 63.0 * m2 * q - 14.0 * m * p * q + p2 * q - 13.0 * q2) / 1260.0;
        }
        if degree >= 4 {
            scale[0][4] = (9.0 * m8 - 42.0 * m6 * q + 126.0 * m4 * q2 - 153.0 * m2 * q3 + 62.0 * q4) / 45360.0;
            scale[1][3] = (36.0 * m7 + 42.0 * m6 * p - 63.0 * m4 * p * q + 168.0 * m3 * q2 + 162.0 * m2 * p * q2 - 72.0 * m * q3 - 77.0 * p * q3) / 22680.0;
            scale[2][2] = (21.0 * m6 + 42.0 * m5 * p + 21.0 * m4 * p2 + 42.0 * m4 * q - 9.0 * m2 * p2 * q + 12.0 * m2 * q2 + 72.0 * m * p * q2 + 26.0 * p2 * q2 + 3.0 * q3) / 7560.0;
            scale[3][1] = (42.0 * m3 * p2 - 126.0 * m3 * q + 9.0 * m2 * p3 - 72.0 * m2 * p * q - 252.0 * m * q2 - p3 * q - 66.0 * p * q2) / 11340.0;
            scale[4][0] = (189.0 * m2 * p2 - 567.0 * m2 * q + 18.0 * m * p3 + 108.0 * m * p * q + 2.0 * p4 - 3.0 * p2 * q + 153.0 * q2) / 45360.0;
            middle[0][4] = m9 / 22680.0;
            middle[1][3] = (9.0 * m8 - q4) / 45360.0;
            middle[2][2] = (-7.0 * m6 * p - 42.0 * m5 * q - 42.0 * m4 * p * q - 112.0 * m3 * q2 - 48.0 * m2 * p * q2 - 48.0 * m * q3 - 5.0 * p * q3) / 7560.0;
            middle[3][1] = (63.0 * m4 * p2 - 189.0 * m4 * q + 84.0 * m3 * p * q + 144.0 * m2 * p2 * q - 360.0 * m2 * q2 + 72.0 * m * p * q2 - 15.0 * p2 * q2 + 97.0 * q3) / 22680.0;
            middle[4][0] = (-153.0 * m2 * p3 + 594.0 * m2 * p * q - 162.0 * m * p2 * q + 594.0 * m * q2 - p3 * q - 6.0 * p * q2) / 45360.0;
        }
        Self { scale, middle }
    }

    /// `σ` and the modified inverse middle moment `σ m + d`; the two other inverse moments are `σ δ_k` more.
    #[inline]
    pub(super) fn at(&self, y: f64, c: f64) -> (f64, f64) {
        (sum(&self.scale, y, c), sum(&self.middle, y, c))
    }
}

/// `Σ coefficients[a][b] yᵃ cᵇ` over the triangle.
#[inline]
fn sum(coefficients: &Coefficients, y: f64, c: f64) -> f64 {
    let mut total = 0.0;
    for a in (0..=DEGREE).rev() {
        let mut row = 0.0;
        for b in (0..=DEGREE - a).rev() {
            row = row * c + coefficients[a][b];
        }
        total = total * y + row;
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;

    /// About principal axis k the step turns by `asin(x̃_k |hΠ|)`, and the body by `θ = x_k |hΠ|`: `x̃_k / x_k` is the
    /// series of `sin θ / θ`, to the last coefficient.
    #[test]
    fn on_the_principal_axes_the_series_are_those_of_the_sine() {
        let mut rng = fastrand::Rng::with_seed(3);
        let orders = [
            PreprocessedOrder::Four,
            PreprocessedOrder::Six,
            PreprocessedOrder::Eight,
            PreprocessedOrder::Ten,
        ];
        for _ in 0..100 {
            let [m, u, v] = [2.0 + rng.f64(), 2.0 * rng.f64(), -rng.f64()];
            for order in orders {
                let series = Series::new(order, m, u + v, u * v);
                for offset in [0.0, u, v] {
                    let squared = 10.0 * rng.f64();
                    let inverse = m + offset;
                    let c = 0.5 * squared / (inverse * inverse);
                    let (scale, middle) = series.at(offset * c, c);
                    let mut term = 1.0;
                    let mut sine = 1.0;
                    for n in 1..=order.degree() as i32 {
                        term *= -squared / f64::from(2 * n * (2 * n + 1));
                        sine += term;
                    }
                    let found = (scale * offset + middle) / inverse;
                    assert!((found - sine).abs() < 2e-13, "{order:?}: {found}, {sine}");
                }
            }
        }
    }
}
