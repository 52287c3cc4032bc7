use crate::MethodError;

/// A quadrature rule on `[0, 1]`, by its number of points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quadrature {
    /// Gauss–Legendre: r points are exact up to degree `2r − 1`.
    Gauss(u32),
    /// Gauss–Lobatto, both ends among the points: r ≥ 2 points are exact up to degree `2r − 3`.
    Lobatto(u32),
}

/// Most points of a rule.
const MAX_POINTS: u32 = 24;

/// Newton corrections after which a node is taken as it is; four reach rounding from the starting guesses.
const MAX_ITERATIONS: u32 = 20;

impl Quadrature {
    /// Number of points.
    pub fn points(self) -> u32 {
        match self {
            Self::Gauss(points) | Self::Lobatto(points) => points,
        }
    }

    /// Whether the rule exists and tells all polynomials of a `degree` apart by their slopes, as a Galerkin method needs:
    /// at least as many points as the degree.
    pub(super) fn check(self, method: &'static str, degree: u32) -> Result<(), MethodError> {
        let least = match self {
            Self::Gauss(_) => 1,
            Self::Lobatto(_) => 2,
        };
        if (degree.max(least)..=MAX_POINTS).contains(&self.points()) {
            return Ok(());
        }
        Err(MethodError::Parameter {
            method,
            parameter: "number of quadrature points",
            value: f64::from(self.points()),
            expected: "at least the degree (and 2 for Lobatto's rule), at most 24",
        })
    }

    /// Nodes in rising order, and weights.
    pub(super) fn rule(self) -> (Vec<f64>, Vec<f64>) {
        let points = self.points();
        let place = |index| match self {
            Self::Gauss(_) => gauss(points, index),
            Self::Lobatto(_) => lobatto(points, index),
        };
        (0..points)
            .map(|index| {
                // Mirror images share their rounding errors.
                let mirrored = points - 1 - index;
                let (x, weight) = place(index.min(mirrored));
                let node = if index <= mirrored {
                    0.5 - 0.5 * x
                } else {
                    0.5 + 0.5 * x
                };
                (node, 0.5 * weight)
            })
            .unzip()
    }
}

/// `P_n(x)` and `P'_n(x)`, `|x| < 1`, by the three-term recurrence.
fn legendre(n: u32, x: f64) -> (f64, f64) {
    let (mut before, mut value) = (0.0, 1.0);
    for k in 0..n {
        let k = f64::from(k);
        let next = ((2.0 * k + 1.0) * x * value - k * before) / (k + 1.0);
        before = value;
        value = next;
    }
    (
        value,
        f64::from(n) * (before - x * value) / ((1.0 - x) * (1.0 + x)),
    )
}

/// Node (from 1 downwards) and weight on `[−1, 1]`: a root of `P_n`, `w = 2/((1 − x²) P'_n²)`.
fn gauss(n: u32, index: u32) -> (f64, f64) {
    if 2 * index + 1 == n {
        let slope = legendre(n, 0.0).1;
        return (0.0, 2.0 / (slope * slope));
    }
    let guess = (f64::from(index) + 0.75) / (f64::from(n) + 0.5);
    let x = newton(libm::cos(std::f64::consts::PI * guess), |x| {
        let (value, slope) = legendre(n, x);
        value / slope
    });
    let slope = legendre(n, x).1;
    (x, 2.0 / ((1.0 - x) * (1.0 + x) * slope * slope))
}

/// Node (from 1 downwards) and weight on `[−1, 1]`: 1 or a root of `P'_{n−1}`, `w = 2/(n (n − 1) P_{n−1}²)`.
fn lobatto(n: u32, index: u32) -> (f64, f64) {
    let m = n - 1;
    let scale = 2.0 / (f64::from(n) * f64::from(m));
    if index == 0 {
        return (1.0, scale);
    }
    let x = if 2 * index == m {
        0.0
    } else {
        let guess = libm::cos(std::f64::consts::PI * f64::from(index) / f64::from(m));
        // (1 − x²) P'' = 2 x P' − m (m + 1) P
        newton(guess, |x| {
            let (value, slope) = legendre(m, x);
            let curvature = (2.0 * x * slope - f64::from(m) * f64::from(m + 1) * value)
                / ((1.0 - x) * (1.0 + x));
            slope / curvature
        })
    };
    let value = legendre(m, x).0;
    (x, scale / (value * value))
}

fn newton(mut x: f64, correction: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..MAX_ITERATIONS {
        let step = correction(x);
        x -= step;
        if step.abs() <= f64::EPSILON {
            break;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exact for polynomials up to the degree stated, and no further.
    #[test]
    fn rules_are_exact_up_to_their_degree() {
        let mut rules: Vec<_> = (1..=24)
            .map(|r| (Quadrature::Gauss(r), 2 * r - 1))
            .collect();
        rules.extend((2..=24).map(|r| (Quadrature::Lobatto(r), 2 * r - 3)));
        for (rule, degree) in rules {
            let (nodes, weights) = rule.rule();
            let error = |power: u32| {
                let sum: f64 = nodes
                    .iter()
                    .zip(&weights)
                    .map(|(c, b)| b * c.powi(power as i32))
                    .sum();
                (sum * f64::from(power + 1) - 1.0).abs()
            };
            for power in 0..=degree {
                assert!(error(power) < 2e-14, "{rule:?}: {:e}", error(power));
            }
            if rule.points() <= 10 {
                assert!(error(degree + 1) > 1e-12, "{rule:?}");
            }
            assert!(nodes.windows(2).all(|pair| pair[0] < pair[1]), "{rule:?}");
        }
    }

    #[test]
    fn rules_that_cannot_be_are_refused() {
        for rule in [
            Quadrature::Gauss(0),
            Quadrature::Gauss(2),
            Quadrature::Lobatto(1),
            Quadrature::Gauss(25),
        ] {
            assert!(rule.check("test", 3).is_err(), "{rule:?}");
        }
        assert!(Quadrature::Lobatto(1).check("test", 1).is_err());
        assert!(Quadrature::Gauss(3).check("test", 3).is_ok());
    }
}
