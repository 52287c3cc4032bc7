//! The mass along a plan, and what it costs.

use lgvi_dynamics::thrusters::Thruster;

use crate::{Command, Transfer};

/// The masses of a body whose thrusters use propellant, in steps under the commands `w` of its scaled motion.
pub(super) struct Masses {
    /// At `0 … N`.
    pub(super) ends: Vec<f64>,
    /// In the middle of each step.
    pub(super) middles: Vec<f64>,
    /// `a = h Σ q w/M` of each step.
    parts: Vec<f64>,
}

/// `q`: the mass flows per force of the thrusters of a transfer.
pub(super) fn flows(transfer: &Transfer) -> Command {
    let thrusters = transfer.body.thrusters().into_iter();
    let all = thrusters.flat_map(|thrusters| thrusters.thrusters());
    let mut flows = Command::zeros();
    let each = all.map(|thruster: &Thruster| thruster.exhaust_velocity.recip());
    for (flow, of) in flows.iter_mut().zip(each) {
        *flow = of;
    }
    flows
}

impl Masses {
    /// The masses from that of the transfer's body on. `full` is the mass with all propellant.
    pub(super) fn new(transfer: &Transfer, full: f64, commands: &[Command]) -> Self {
        let flows = flows(transfer);
        let mut mass = transfer.body.mass();
        let mut masses = Self::with_capacity(mass, commands.len());
        for command in commands {
            let part = transfer.h * flows.dot(&open(command)) / full;
            let middle = mass / (1.0 + 0.5 * part);
            mass = middle * (1.0 - 0.5 * part);
            masses.push(part, middle, mass);
        }
        masses
    }

    /// The masses under the forces of the thrusters themselves.
    pub(super) fn under(transfer: &Transfer, forces: &[Command]) -> Self {
        let flows = flows(transfer);
        let mut mass = transfer.body.mass();
        let mut masses = Self::with_capacity(mass, forces.len());
        for force in forces {
            let used = transfer.h * flows.dot(force);
            let middle = mass - 0.5 * used;
            mass -= used;
            masses.push(used / middle, middle, mass);
        }
        masses
    }

    fn with_capacity(mass: f64, steps: usize) -> Self {
        let mut masses = Self {
            ends: Vec::with_capacity(steps + 1),
            middles: Vec::with_capacity(steps),
            parts: Vec::with_capacity(steps),
        };
        masses.ends.push(mass);
        masses
    }

    fn push(&mut self, part: f64, middle: f64, end: f64) {
        self.parts.push(part);
        self.middles.push(middle);
        self.ends.push(end);
    }

    /// The mass that flows out.
    pub(super) fn used(&self) -> f64 {
        self.ends[0] - self.ends[self.ends.len() - 1]
    }

    /// What mass flows in each step cost, in parts of the mass with all propellant: a smaller mass loosens the limits of later
    /// commands `w`. `held` holds `Σ y ∂g/∂w · w` of each step as it would be without this cost.
    ///
    /// With the multipliers y of the limits `g(w/ℓ) ≤ 0`, `ℓ = M/m` in the middle of a step, the derivative of the Lagrangian by
    /// `ln m` there is `s = Σ y ∂g/∂w · w`. From `ln m_{k+½} = ln m_k − ln(1 + a/2)` and `ln m_{k+1} = ln m_k − 2 artanh(a/2)`
    /// follows that by `a`: `−[S/(1 − a²/4) + ½ s/(1 + a/2)]` with the sum S of s over the later steps. It is part of the
    /// condition from which s is found, hence `s = held + a [S/(1 − a²/4) + ½ s/(1 + a/2)]`.
    pub(super) fn costs(&self, held: &[f64]) -> Vec<f64> {
        let mut later = 0.0;
        let mut costs = vec![0.0; held.len()];
        for (k, held) in held.iter().enumerate().rev() {
            let a = self.parts[k];
            let through = later / (1.0 - 0.25 * a * a);
            let own = 0.5 / (1.0 + 0.5 * a);
            let now = (held + a * through) / (1.0 - a * own);
            costs[k] = -(through + own * now);
            later += now;
        }
        costs
    }
}

/// Forces of thrusters, which a solver may leave below 0 by its tolerance.
pub(super) fn open(command: &Command) -> Command {
    command.map(|force| force.max(0.0))
}
