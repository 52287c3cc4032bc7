//! How an error grows after the time that it was measured for.

/// Exponents of time between which a power law is believed: phase errors of a symplectic method in regular motion grow
/// linearly, those of a method that loses energy quadratically.
const EXPONENTS: [f64; 2] = [1.0, 2.0];

/// Growth in the last half of the time and in its last three quarters from which it is exponential: cubes of time at least.
const EXPONENTIAL: [f64; 2] = [8.0, 100.0];

/// The law of an error `e(t)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Growth {
    /// As `t^exponent`.
    Power(f64),
    /// As `exp(rate t)`.
    Exponential(f64),
}

impl Growth {
    /// From errors at equal intervals of `horizon`, the last at its end.
    pub(crate) fn fit(errors: &[f64], horizon: f64) -> Self {
        let count = errors.len();
        let [quarter, half] = [4, 2].map(|part| greatest(&errors[..count / part]));
        let whole = greatest(errors);
        let [late, later] = EXPONENTIAL;
        if whole > late * half && whole > later * quarter {
            return Self::Exponential(libm::log(whole / quarter) / (0.75 * horizon));
        }
        Self::power(errors)
    }

    /// The same, known to be a power.
    pub(super) fn power(errors: &[f64]) -> Self {
        let half = greatest(&errors[..errors.len() / 2]);
        let [least, most] = EXPONENTS;
        Self::Power(libm::log2(greatest(errors) / half).clamp(least, most))
    }

    /// What an error at `horizon` is multiplied by until `duration`.
    pub(crate) fn factor(self, horizon: f64, duration: f64) -> f64 {
        match self {
            Self::Power(exponent) => libm::pow(duration / horizon, exponent),
            Self::Exponential(rate) => libm::exp(rate * (duration - horizon)),
        }
    }
}

/// Above 0.
fn greatest(errors: &[f64]) -> f64 {
    errors.iter().copied().fold(f64::MIN_POSITIVE, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fit(error: impl Fn(f64) -> f64) -> Growth {
        let errors: Vec<_> = (1..=8).map(|i| error(f64::from(i))).collect();
        Growth::fit(&errors, 8.0)
    }

    #[test]
    fn powers_and_exponentials_are_told_apart() {
        assert_eq!(fit(|t| 3e-9 * t), Growth::Power(1.0));
        assert_eq!(fit(|t| 3e-9 * t * t), Growth::Power(2.0));
        let Growth::Exponential(rate) = fit(|t| 1e-9 * (1.5 * t).exp()) else {
            panic!("an exponential");
        };
        assert!((rate - 1.5).abs() < 1e-12);
        let law = Growth::Exponential(rate);
        assert!((law.factor(8.0, 10.0) / 3_f64.exp() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_bounded_error_is_taken_to_grow_linearly_and_a_steep_start_quadratically() {
        assert_eq!(fit(f64::sin), Growth::Power(1.0));
        assert_eq!(fit(|t| t.powi(3)), Growth::Power(2.0));
        assert_eq!(Growth::Power(2.0).factor(8.0, 80.0), 100.0);
    }
}
