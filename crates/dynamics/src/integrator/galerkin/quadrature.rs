use crate::MethodError;
use crate::quadrature::gauss_jacobi;

/// A quadrature rule on `[0, 1]`, with its number of points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quadrature {
    /// Gauss–Legendre: r points are exact up to degree `2r − 1`.
    Gauss(u32),
    /// Gauss–Lobatto, which includes both ends: r ≥ 2 points are exact up to degree `2r − 3`.
    Lobatto(u32),
}

/// Largest number of points.
const MAX_POINTS: u32 = 24;

impl Quadrature {
    /// Number of points.
    pub fn points(self) -> u32 {
        match self {
            Self::Gauss(points) | Self::Lobatto(points) => points,
        }
    }

    /// Checks that the rule exists and that it distinguishes all polynomials of a `degree` by their slopes, as a
    /// Galerkin method requires. This needs at least as many points as the degree.
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

    /// Nodes in increasing order, and weights. Nodes and weights are exactly symmetric.
    pub(super) fn rule(self) -> (Vec<f64>, Vec<f64>) {
        let mut rule = match self {
            Self::Gauss(points) => gauss_jacobi(points, 0, 0),
            Self::Lobatto(points) => {
                let end = 1.0 / (f64::from(points) * f64::from(points - 1));
                let inner = gauss_jacobi(points - 2, 1, 1).into_iter();
                let inner = inner.map(|(t, weight)| (t, weight / (t * (1.0 - t))));
                let inner: Vec<_> = inner.collect();
                [&[(0.0, end)], &inner[..], &[(1.0, end)]].concat()
            }
        };
        let last = rule.len() - 1;
        for index in 0..=last / 2 {
            let (node, weight) = rule[index];
            rule[last - index] = (1.0 - node, weight);
        }
        if last % 2 == 0 {
            rule[last / 2].0 = 0.5;
        }
        rule.into_iter().unzip()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that rules are exact for polynomials up to the stated degree, and not beyond.
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
