//! The mass along a plan, and what it costs.

use super::flows::Flows;
use crate::{Command, Transfer};

/// The masses of a body that uses propellant, in steps under the commands `w` of its scaled motion.
pub(super) struct Masses {
    /// At `0 … N`.
    pub(super) ends: Vec<f64>,
    /// In the middle of each step.
    pub(super) middles: Vec<f64>,
    /// `a = h Σ q w/M` of each step.
    parts: Vec<f64>,
}

impl Masses {
    /// The masses from that of the transfer's body on. `full` is the mass with all propellant.
    pub(super) fn new(transfer: &Transfer, full: f64, commands: &[Command]) -> Self {
        let flows = Flows::of(transfer);
        let part = |command| flows.rate(command) * (transfer.h / full);
        let parts = commands.iter().map(part);
        Self::of_parts(transfer.body.mass(), parts.collect())
    }

    /// The masses under the forces themselves.
    pub(super) fn under(transfer: &Transfer, forces: &[Command]) -> Self {
        let flows = Flows::of(transfer);
        let mut mass = transfer.body.mass();
        let part = |force: &Command| {
            let used = transfer.h * flows.rate(force);
            let part = used / (mass - 0.5 * used);
            mass -= used;
            part
        };
        let parts = forces.iter().map(part).collect();
        Self::of_parts(transfer.body.mass(), parts)
    }

    fn of_parts(mut mass: f64, parts: Vec<f64>) -> Self {
        let mut ends = vec![mass];
        let mut middles = Vec::with_capacity(parts.len());
        for part in &parts {
            let middle = mass / (1.0 + 0.5 * part);
            mass = middle * (1.0 - 0.5 * part);
            middles.push(middle);
            ends.push(mass);
        }
        Self {
            ends,
            middles,
            parts,
        }
    }

    /// Whether there is a body left.
    pub(super) fn are_positive(&self) -> bool {
        self.ends.iter().all(|mass| *mass > 0.0)
    }

    /// The mass that flows out.
    pub(super) fn used(&self) -> f64 {
        self.ends[0] - self.ends[self.ends.len() - 1]
    }

    /// What mass flows in each step cost, in parts of the mass with all propellant: a smaller mass loosens the limits of later
    /// commands `w`, and drag slows it down more. `held` holds `Σ y ∂g/∂w · w` of each step as it would be without this cost,
    /// `drags` the derivatives of the Lagrangian by `ln m` through the drag.
    ///
    /// With the multipliers y of the limits `g(w/ℓ) ≤ 0`, `ℓ = M/m` in the middle of a step, the derivative of the Lagrangian by
    /// `ln m` there is `s = Σ y ∂g/∂w · w ≥ 0`, and that through the drag. From `ln m_{k+½} = ln m_k − ln(1 + a/2)` and
    /// `ln m_{k+1} = ln m_k − 2 artanh(a/2)` follows that by `a`: `−[S/(1 − a²/4) + ½ σ/(1 + a/2)]` with the sum σ of both in the
    /// step and the sum S of σ over the later steps. It is part of the condition from which s is found, hence
    /// `s = held + a [S/(1 − a²/4) + ½ σ/(1 + a/2)]`.
    pub(super) fn costs(&self, held: &[f64], drags: &[f64]) -> Vec<f64> {
        let mut later = 0.0;
        let mut costs = vec![0.0; held.len()];
        for (k, (held, drag)) in held.iter().zip(drags).enumerate().rev() {
            let a = self.parts[k];
            let through = later / (1.0 - 0.25 * a * a);
            let own = 0.5 / (1.0 + 0.5 * a);
            let both = (held + drag + a * through) / (1.0 - a * own);
            let now = both.max(*drag);
            costs[k] = -(through + own * now);
            later += now;
        }
        costs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The derivatives of `Σ y (w/ℓ − 1) + d ln m` through the masses alone, by differences. The flow per command is 0.3.
    #[test]
    fn costs_are_derivatives_through_the_masses() {
        let multipliers = [0.7, 0.0, 1.9, 0.4, 1.1];
        let drags = [0.2, -0.3, 0.05, 0.4, -0.1];
        let commands = [0.9, 0.2, 1.3, 0.0, 0.6];
        let (flow, full) = (0.3, 2.0);
        let masses = |commands: &[f64]| {
            let parts = commands.iter().map(|w| flow * w / full).collect();
            Masses::of_parts(1.8, parts)
        };
        let through = |moved: &[f64]| -> f64 {
            let middles = masses(moved).middles;
            let each = multipliers.iter().zip(commands).zip(&middles).zip(drags);
            each.map(|(((y, w), middle), drag)| y * (w * middle / full - 1.0) + drag * middle.ln())
                .sum()
        };
        let now = masses(&commands);
        let slopes: Vec<f64> = (0..5)
            .map(|k| {
                let step = 1e-5;
                let [more, less] = [step, -step].map(|step| {
                    let mut moved = commands;
                    moved[k] += step;
                    through(&moved)
                });
                (more - less) / (2.0 * step)
            })
            .collect();
        let held: Vec<f64> = (0..5)
            .map(|k| {
                let share = now.middles[k] / full;
                commands[k] * (multipliers[k] * share + slopes[k])
            })
            .collect();
        let costs = now.costs(&held, &drags);
        for (cost, slope) in costs.iter().zip(&slopes) {
            let error = cost * flow / full - slope;
            assert!(error.abs() < 1e-10, "{cost} for {slope}: {error:e}");
        }
        assert!(costs[0] < costs[4] && costs[4] < 0.0, "{costs:?}");
    }

    #[test]
    fn masses_of_scaled_commands_are_those_of_forces() {
        let (flow, full) = (0.3, 2.0);
        let commands = [0.9, 0.2, 1.3, 0.0, 0.6];
        let parts = commands.iter().map(|w| flow * w / full).collect();
        let masses = Masses::of_parts(1.8, parts);
        let mut mass = 1.8;
        for (k, w) in commands.iter().enumerate() {
            let force = w * masses.middles[k] / full;
            assert!((masses.middles[k] - (mass - 0.5 * flow * force)).abs() < 1e-15);
            mass -= flow * force;
            assert!((masses.ends[k + 1] - mass).abs() < 1e-15);
        }
        assert!((masses.used() - (1.8 - mass)).abs() < 1e-15);
    }
}
