use super::penalty::{Penalty, Slacks};

/// An inequality at one interval: its multiplier, and its contributions to the model of the current iterate.
///
/// With optimal slacks for `g`, the Newton equations of `y s = β` and `(ρ − y) t = β` reduce to `dy = β/s − y + ω
/// ∂g·dz` with `ω = y/(s + y t/(ρ − y))`. The row therefore adds `(β/s) ∂g` to the gradient and `y ∂²g + ω ∂g ∂gᵀ` to
/// the Hessian. This gives a descent direction of the penalty for every y.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Row {
    /// `y`
    pub(super) multiplier: f64,
    /// `g`
    pub(super) value: f64,
    /// `β/s`
    pub(super) primal: f64,
    /// `ω`
    pub(super) weight: f64,
    /// The greater of `|y s − β|` and `|(ρ − y) t − β|`.
    pub(super) gap: f64,
    /// `y s`
    pub(super) product: f64,
    /// `dy`
    pub(super) change: f64,
}

/// Largest factor between a multiplier and `β/s`.
const RANGE: f64 = 1e6;

impl Row {
    /// The multiplier at `g = value`.
    pub(super) fn multiplier_at(&self, penalty: &Penalty, value: f64) -> f64 {
        penalty.settled(self.multiplier, &penalty.slacks(value), RANGE)
    }

    /// Computes the row's contributions for the iterate's `value` of `g`.
    pub(super) fn model(&mut self, penalty: &Penalty, value: f64) {
        let slacks = penalty.slacks(value);
        let Slacks { inner, elastic } = slacks;
        let y = penalty.settled(self.multiplier, &slacks, RANGE);
        let rest = penalty.rho - y;
        *self = Self {
            multiplier: y,
            value,
            primal: penalty.beta / inner,
            weight: y / (inner + elastic * (y / rest)),
            gap: (y * inner - penalty.beta)
                .abs()
                .max((rest * elastic - penalty.beta).abs()),
            product: y * inner,
            change: 0.0,
        };
    }

    /// Computes the change of the multiplier for `slope = ∂g·dz`.
    pub(super) fn direct(&mut self, slope: f64) {
        self.change = self.primal - self.multiplier + self.weight * slope;
    }

    /// The longest step, at most 1, along which `g` with this slope covers at most the part `boundary` of its slack. A violation
    /// does not limit the step.
    pub(super) fn room(&self, penalty: &Penalty, slope: f64, boundary: f64) -> f64 {
        if self.value < 0.0 && slope > 0.0 {
            (boundary * penalty.beta / (self.primal * slope)).min(1.0)
        } else {
            1.0
        }
    }

    /// The longest step of the multiplier, at most 1, that covers at most the part `boundary` of the distance to 0 or
    /// ρ.
    pub(super) fn reach(&self, penalty: &Penalty, boundary: f64) -> f64 {
        let room = if self.change < 0.0 {
            self.multiplier
        } else {
            penalty.rho - self.multiplier
        };
        let reach = boundary * room / self.change.abs();
        // A change of 0 gives ∞ or, on the boundary, NaN.
        if reach < 1.0 { reach } else { 1.0 }
    }
}
