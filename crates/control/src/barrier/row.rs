use super::penalty::{Penalty, Slacks};

/// An inequality at one interval: its multiplier, and what the model of the present iterate makes of it.
///
/// With the slacks at their best for `g`, the Newton equations of `y s = β` and `(ρ − y) t = β` leave
/// `dy = β/s − y + ω ∂g·dz` with `ω = y/(s + y t/(ρ − y))`, so that the row adds `(β/s) ∂g` to the gradient and
/// `y ∂²g + ω ∂g ∂gᵀ` to the Hessian: a descent direction of the penalty whatever y is.
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
    /// `|y s − β|`, or that of the other side of the interval.
    pub(super) gap: f64,
    /// `y s`
    pub(super) product: f64,
    /// `dy`
    pub(super) change: f64,
}

/// How many times more or less than `β/s` a multiplier may be.
const RANGE: f64 = 1e6;

impl Row {
    /// The multiplier where `g` is `value`.
    pub(super) fn multiplier_at(&self, penalty: &Penalty, value: f64) -> f64 {
        penalty.settled(self.multiplier, &penalty.slacks(value), RANGE)
    }

    /// Takes the iterate's `value` of `g`.
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

    /// Takes `∂g·dz`.
    pub(super) fn direct(&mut self, slope: f64) {
        self.change = self.primal - self.multiplier + self.weight * slope;
    }

    /// The longest step of the multiplier, at most 1, that goes no more than the share `boundary` of the way to 0 or ρ.
    pub(super) fn reach(&self, penalty: &Penalty, boundary: f64) -> f64 {
        let room = if self.change < 0.0 {
            self.multiplier
        } else {
            penalty.rho - self.multiplier
        };
        let reach = boundary * room / self.change.abs();
        // A change of 0 has reach ∞ or, on the boundary, none.
        if reach < 1.0 { reach } else { 1.0 }
    }
}
