use lgvi_dynamics::Load;

use crate::Command;

/// What a plan makes of the transfer that is solved.
pub(super) struct Along {
    /// `ln(m/M)` in the middle of each step.
    pub(super) masses: Vec<f64>,
    /// The cost of mass flows in each step.
    pub(super) costs: Vec<f64>,
    /// The derivatives of the mass flow by the commands, in parts of the mass with all propellant.
    pub(super) flows: Vec<Command>,
    /// Loads beside those of the commands.
    pub(super) loads: Vec<[Load; 2]>,
    /// The largest cost that prices and inequalities hold against a mass flow.
    pub(super) size: f64,
}

impl Along {
    /// The changes of the masses, and of the costs relative to their size.
    pub(super) fn changes(&self, to: &Self) -> [f64; 2] {
        let masses = self.masses.iter().zip(&to.masses);
        let cost = |k: usize| {
            let [before, after] = [self, to].map(|along| along.costs[k] * along.flows[k]);
            (after - before).norm() / to.flows[k].norm().max(f64::MIN_POSITIVE)
        };
        [
            masses.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max),
            (0..to.costs.len()).map(cost).fold(0.0, f64::max) / to.size,
        ]
    }

    /// The masses and the costs in units of `size`.
    pub(super) fn vector(&self, size: f64) -> Vec<f64> {
        let costs = self.costs.iter().map(|cost| cost / size);
        self.masses.iter().copied().chain(costs).collect()
    }

    /// The same with other masses and costs.
    pub(super) fn at(self, vector: &[f64]) -> Self {
        let (masses, costs) = vector.split_at(self.masses.len());
        Self {
            masses: masses.to_vec(),
            costs: costs.iter().map(|cost| cost * self.size).collect(),
            ..self
        }
    }
}
