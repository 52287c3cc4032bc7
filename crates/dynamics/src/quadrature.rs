//! Gauss quadrature rules.

use std::f64::consts::PI;

/// Limit of Newton corrections per node. Five reach rounding from the initial guesses.
const MAX_ITERATIONS: u32 = 20;

/// Nodes, in increasing order, and weights of `∫₀¹ t^β (1 − t)^α f(t) dt`, exact for f of degree `2 count − 1`. The
/// nodes are roots of the Jacobi polynomial, computed by Newton's method with deflation of the previous roots (G. E.
/// Karniadakis & S. J. Sherwin, Spectral/hp Element Methods for CFD, app. B).
pub(crate) fn gauss_jacobi(count: u32, alpha: u32, beta: u32) -> Vec<(f64, f64)> {
    let jacobi = Jacobi::new(count, alpha, beta);
    let mut roots: Vec<f64> = Vec::with_capacity(count as usize);
    for index in 0..count {
        let chebyshev = -libm::cos(PI * (f64::from(index) + 0.5) / f64::from(count));
        let mut x = roots
            .last()
            .map_or(chebyshev, |last| 0.5 * (chebyshev + last));
        for _ in 0..MAX_ITERATIONS {
            let (value, slope) = jacobi.at(x);
            let divided: f64 = roots.iter().map(|root| 1.0 / (x - root)).sum();
            let step = value / (slope - value * divided);
            x -= step;
            if step.abs() <= f64::EPSILON {
                break;
            }
        }
        roots.push(x);
    }
    // Γ(n + α + 1) Γ(n + β + 1) / (n! Γ(n + α + β + 1))
    let scale: f64 = (1..=alpha.min(beta))
        .map(|k| f64::from(count + k) / f64::from(count + k + alpha.max(beta)))
        .product();
    let rule = roots.into_iter().map(|x| {
        let (_, slope) = jacobi.at(x);
        (
            0.5 + 0.5 * x,
            scale / ((1.0 - x) * (1.0 + x) * slope * slope),
        )
    });
    rule.collect()
}

/// The Jacobi polynomial `P_n^{(α, β)}` on `[−1, 1]`.
struct Jacobi {
    degree: u32,
    alpha: f64,
    beta: f64,
}

impl Jacobi {
    fn new(degree: u32, alpha: u32, beta: u32) -> Self {
        Self {
            degree,
            alpha: alpha.into(),
            beta: beta.into(),
        }
    }

    /// Value and derivative at `|x| < 1`, by the three-term recurrence.
    fn at(&self, x: f64) -> (f64, f64) {
        let Self { alpha, beta, .. } = *self;
        let both = alpha + beta;
        let (mut before, mut value) = (0.0, 1.0);
        for k in 0..self.degree {
            let k = f64::from(k);
            let next = if k == 0.0 {
                0.5 * (alpha - beta + (both + 2.0) * x)
            } else {
                let s = 2.0 * k + both;
                let ahead = (s + 1.0) * (s * (s + 2.0) * x + alpha * alpha - beta * beta) * value;
                let behind = 2.0 * (k + alpha) * (k + beta) * (s + 2.0) * before;
                (ahead - behind) / (2.0 * (k + 1.0) * (k + both + 1.0) * s)
            };
            before = value;
            value = next;
        }
        let n = f64::from(self.degree);
        let s = 2.0 * n + both;
        let slope = n * (alpha - beta - s * x) * value + 2.0 * (n + alpha) * (n + beta) * before;
        (value, slope / (s * (1.0 - x) * (1.0 + x)))
    }
}

#[cfg(test)]
mod tests {
    use super::gauss_jacobi;

    /// The moments are beta functions, `B(k + β + 1, α + 1)`.
    #[test]
    fn rules_are_exact_up_to_their_degree() {
        for (alpha, beta) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 0)] {
            for count in 1..=24 {
                let rule = gauss_jacobi(count, alpha, beta);
                assert!(rule.windows(2).all(|pair| pair[0].0 < pair[1].0));
                let error = |power: u32| {
                    let sum: f64 = rule.iter().map(|(t, w)| w * t.powi(power as i32)).sum();
                    let steps = (1..=alpha).map(|j| f64::from(j) / f64::from(power + beta + 1 + j));
                    let exact: f64 = steps.product::<f64>() / f64::from(power + beta + 1);
                    (sum / exact - 1.0).abs()
                };
                for power in 0..2 * count {
                    let found = error(power);
                    assert!(
                        found < 1e-13,
                        "{count}, {alpha}, {beta}, {power}: {found:e}"
                    );
                }
                assert!(count > 8 || error(2 * count) > 1e-12);
            }
        }
    }
}
