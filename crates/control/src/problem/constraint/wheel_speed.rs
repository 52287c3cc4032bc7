use nalgebra::{SVector, Vector3};

use crate::Command;
use crate::units::Units;

/// A limit on the speed `p` to which a motor takes its wheel within a step, `|p| ≤ limit`. `p = ω + h (1/I + a·J⁻¹a) u` is the speed
/// at the end of the step if the body turned by the reaction to this torque alone, which is what motors go by.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct WheelSpeed {
    /// The index of the constraint.
    pub(crate) index: usize,
    /// `∂ω/∂q`, `∂ω/∂s` and `∂ω/∂Π`
    by_momenta: [Vector3<f64>; 3],
    /// `(1/I + a·J⁻¹a) u` of unit commands.
    per_time: Command,
    limit: f64,
    /// The allowed violation.
    slack: f64,
}

impl WheelSpeed {
    /// The limit on a speed with these derivatives by the exchanged and the stored momenta, the body's own, and by a command
    /// that is held for a unit of time.
    pub(crate) fn new(
        index: usize,
        by_momenta: [Vector3<f64>; 3],
        per_time: Command,
        limit: f64,
    ) -> Self {
        Self {
            index,
            by_momenta,
            per_time,
            limit,
            slack: 0.0,
        }
    }

    pub(in crate::problem) fn in_units(&self, units: &Units) -> Self {
        let sizes = [
            units.place(),
            units.linear_momentum(),
            units.angular_momentum(),
        ];
        Self {
            by_momenta: std::array::from_fn(|i| sizes[i] * self.by_momenta[i]),
            per_time: units.time() * self.per_time.component_mul(units.commands()),
            ..self.clone()
        }
    }

    pub(in crate::problem) fn relaxed(&self, slack: f64) -> Self {
        Self {
            slack: self.slack + slack,
            ..self.clone()
        }
    }

    /// The allowed violation, in parts of the limit.
    pub(crate) fn slack(&self) -> f64 {
        self.slack
    }

    /// The derivatives of `p/limit` by `[x, γ, ζ, Π]` at the start of a step of length `h` and by its command.
    pub(crate) fn slopes(&self, h: f64) -> (SVector<f64, 12>, Command) {
        let [exchanged, stored, own] = self.by_momenta;
        let mut by_state = SVector::<f64, 12>::zeros();
        for (at, by) in [(0, exchanged), (3, stored), (9, own)] {
            by_state
                .fixed_rows_mut::<3>(at)
                .copy_from(&(by / self.limit));
        }
        (by_state, (h / self.limit) * self.per_time)
    }
}
