/// The smoothed exact penalty of an inequality `g ≤ 0`: `ψ(g) = min ρ t − β ln t − β ln(t − g)` over `t > max(g, 0)`.
/// This is the barrier problem of `ρ max(g, 0)` with optimal elastic variable t and slack `s = t − g`.
///
/// ψ is smooth and convex at every `g`, feasible or not, and tends to `ρ max(g, 0)` as β → 0. Its derivative is the
/// multiplier `y = β/s`, between 0 and ρ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Penalty {
    /// β, the barrier parameter.
    pub(super) beta: f64,
    /// ρ, the penalty per unit of violation.
    pub(super) rho: f64,
}

/// The optimal slacks at a value of `g`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slacks {
    /// `s`, the slack of `g ≤ t`.
    pub(super) inner: f64,
    /// `t`, the slack of `0 ≤ t`.
    pub(super) elastic: f64,
}

impl Penalty {
    /// The penalty of an inequality whose violation has this price, if it has one.
    pub(super) fn of(&self, price: Option<f64>) -> Self {
        Self {
            rho: price.unwrap_or(self.rho),
            ..*self
        }
    }

    /// `s` and `t`: the roots of `β/t + β/(t − g) = ρ`, each computed without cancellation.
    pub(super) fn slacks(&self, g: f64) -> Slacks {
        let width = 2.0 * self.beta / self.rho;
        let root = (g * g + width * width).sqrt();
        let larger = 0.5 * (g.abs() + width + root);
        let smaller = 0.5 * (width + width * width / (root + g.abs()));
        if g > 0.0 {
            Slacks {
                inner: smaller,
                elastic: larger,
            }
        } else {
            Slacks {
                inner: larger,
                elastic: smaller,
            }
        }
    }

    /// `ψ(g)`.
    pub(super) fn value(&self, g: f64) -> f64 {
        let Slacks { inner, elastic } = self.slacks(g);
        self.rho * elastic - self.beta * (libm::log(elastic) + libm::log(inner))
    }

    /// An initial multiplier for `g = value`, computed as if the slack were at least `slack`.
    pub(super) fn start(&self, value: f64, slack: f64) -> f64 {
        (self.beta / slack.max(-value)).min(0.5 * self.rho)
    }

    /// The multiplier `y`, limited so that `y` and `ρ − y` differ from their values at these slacks by a factor of at
    /// most `range`.
    pub(super) fn settled(&self, y: f64, slacks: &Slacks, range: f64) -> f64 {
        let (least, most) = (
            self.beta / (range * slacks.inner),
            range * self.beta / slacks.inner,
        );
        let (above, below) = (
            self.beta / (range * slacks.elastic),
            range * self.beta / slacks.elastic,
        );
        let y = y.max(least).min(most);
        let rest = self.rho - y;
        let kept = rest.max(above).min(below);
        // If y is far below ρ, the difference would cancel.
        if kept == rest { y } else { self.rho - kept }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slacks_minimize_and_the_multiplier_is_the_derivative() {
        for beta in [1e-12, 1e-3, 10.0] {
            for rho in [1e-2, 3.0, 1e5] {
                let penalty = Penalty { beta, rho };
                for g in [-10.0, -1e-3, -1e-9, 0.0, 1e-9, 1e-3, 10.0] {
                    let Slacks { inner, elastic } = penalty.slacks(g);
                    assert!(inner > 0.0 && elastic > 0.0);
                    assert!((elastic - inner - g).abs() <= 1e-15 * elastic.max(inner));
                    let balance = beta / inner + beta / elastic;
                    assert!((balance / rho - 1.0).abs() < 1e-14, "{balance} for {rho}");
                }
            }
        }
        let penalty = Penalty {
            beta: 0.1,
            rho: 3.0,
        };
        for g in [-2.0, -0.1, 0.0, 0.3, 4.0] {
            let step = 1e-5;
            let slope = (penalty.value(g + step) - penalty.value(g - step)) / (2.0 * step);
            assert!((slope - 0.1 / penalty.slacks(g).inner).abs() < 1e-9);
            assert!(penalty.value(g) >= 3.0 * f64::max(g, 0.0) - 0.5);
        }
    }
}
