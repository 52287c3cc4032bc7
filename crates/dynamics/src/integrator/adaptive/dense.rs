use super::super::flow::Components;
use super::super::stages::{Stages, advance};
use super::super::tableau::Pair;

/// The continuous extension of a step, a polynomial of seventh degree in `θ` whose value and derivative are continuous
/// at both ends: `y + θ (r₀ + (1 − θ) (r₁ + θ (r₂ + (1 − θ) (r₃ + θ (r₄ + (1 − θ) (r₅ + θ r₆))))))`.
pub(super) struct Dense {
    /// `r₀ … r₆` of each body.
    coefficients: Vec<[Components; 7]>,
    known: bool,
}

impl Dense {
    pub(super) fn new(bodies: usize) -> Self {
        Self {
            coefficients: vec![[[0.0; 18]; 7]; bodies],
            known: false,
        }
    }

    /// Invalidates the coefficients.
    pub(super) fn clear(&mut self) {
        self.known = false;
    }

    /// Returns true if the coefficients belong to the current step.
    pub(super) fn is_known(&self) -> bool {
        self.known
    }

    /// Computes the coefficients for the step `h` from `y` to `end`. All stages must have been evaluated.
    pub(super) fn set(
        &mut self,
        pair: &Pair,
        stages: &Stages,
        [y, end]: [&[Components]; 2],
        h: f64,
    ) {
        let first = stages.derivative(0);
        let last = stages.derivative(pair.tableau.stages.len());
        for (body, r) in self.coefficients.iter_mut().enumerate() {
            for i in 0..18 {
                r[0][i] = end[body][i] - y[body][i];
                r[1][i] = h * first[body][i] - r[0][i];
                r[2][i] = r[0][i] - h * last[body][i] - r[1][i];
            }
            for (r, row) in r[3..].iter_mut().zip(pair.dense) {
                stages.sum(body, row, r);
                r.iter_mut().for_each(|r| *r *= h);
            }
        }
        self.known = true;
    }

    /// Sets `at` to the components of a body at `θ`, for a step that began at `y`.
    pub(super) fn evaluate(&self, body: usize, y: &Components, theta: f64, at: &mut Components) {
        let r = &self.coefficients[body];
        *at = r[6];
        for (index, r) in r[..6].iter().enumerate().rev() {
            let factor = if index % 2 == 0 { 1.0 - theta } else { theta };
            advance(r, factor, at);
        }
        advance(y, theta, at);
    }
}
