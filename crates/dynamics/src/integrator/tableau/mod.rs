//! Coefficients of explicit Runge–Kutta methods.

mod dormand_prince;
mod fehlberg;
#[cfg(test)]
mod order_conditions;

pub(super) use dormand_prince::DORMAND_PRINCE;
pub(super) use fehlberg::FEHLBERG;

/// Nonzero coefficients of stages, each with the index of the stage from 0.
pub(super) type Row = &'static [(usize, f64)];

/// A stage `k_i = f(t + c_i h, y + h Σ_j a_ij k_j)`.
pub(super) struct Stage {
    /// `c_i`.
    pub(super) node: f64,
    /// `a_ij`.
    pub(super) row: Row,
}

const fn stage(node: f64, row: Row) -> Stage {
    Stage { node, row }
}

/// An explicit Runge–Kutta method.
pub(super) struct Tableau {
    pub(super) stages: &'static [Stage],
    /// `b_i`.
    pub(super) weights: Row,
}

/// A method of eighth order with an error estimate and a continuous extension of seventh order.
///
/// The stages of the method are followed by one that is the derivative at the end of the step, then by those of
/// `extra`.
pub(super) struct Pair {
    pub(super) tableau: Tableau,
    /// Weights of the error estimate.
    pub(super) error: Row,
    /// Weights of a coarser estimate that damps the error estimate, or empty if there is none.
    pub(super) damping: Row,
    /// Additional stages for the continuous extension.
    pub(super) extra: &'static [Stage],
    /// The terms of the extension beyond the cubic Hermite polynomial: `h θ²(1 − θ)² (d₀ + θ (d₁ + (1 − θ) (d₂ + θ
    /// d₃)))`, where each `d` is a weighted sum of the stages.
    pub(super) dense: [Row; 4],
}

/// The explicit midpoint rule.
pub(super) const EXPLICIT_MIDPOINT: Tableau = Tableau {
    stages: &[stage(0.0, &[]), stage(0.5, &[(0, 0.5)])],
    weights: &[(1, 1.0)],
};

/// The classical method of fourth order.
pub(super) const CLASSICAL: Tableau = Tableau {
    stages: &[
        stage(0.0, &[]),
        stage(0.5, &[(0, 0.5)]),
        stage(0.5, &[(1, 0.5)]),
        stage(1.0, &[(2, 1.0)]),
    ],
    weights: &[
        (0, 1.0 / 6.0),
        (1, 1.0 / 3.0),
        (2, 1.0 / 3.0),
        (3, 1.0 / 6.0),
    ],
};
