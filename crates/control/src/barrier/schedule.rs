use super::penalty::Penalty;
use crate::newton::Satisfied;

/// What an accepted plan satisfies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BarrierTolerances {
    /// Largest violation of an inequality.
    pub(crate) violation: f64,
    /// Largest product of slack and multiplier.
    pub(crate) complementarity: f64,
    /// What the barrier may cost at the end, `β` times the number of inequalities, in parts of the cost.
    pub(crate) gap: f64,
}

impl Default for BarrierTolerances {
    fn default() -> Self {
        Self {
            violation: 1e-9,
            complementarity: 1e-9,
            gap: 1e-9,
        }
    }
}

/// How β falls and ρ rises (Fiacco and McCormick).
#[derive(Clone, Debug)]
pub(super) struct Schedule {
    pub(super) penalty: Penalty,
    tolerances: BarrierTolerances,
    /// The size of the cost, and that of an inequality's share in it.
    scale: f64,
    share: f64,
    /// The last β.
    last: f64,
    solved: bool,
}

/// β at the start, in parts of an inequality's share of the cost.
const FIRST: f64 = 0.1;
/// ρ at the start and at most, in parts of the cost.
const PRICES: [f64; 2] = [1e2, 1e5];
/// How near to the highest ρ a multiplier is where inequalities cannot be satisfied.
const HOPELESS: f64 = 0.9;
/// How near to ρ a multiplier may come before ρ rises, and by how much.
const NEAR: f64 = 0.1;
const RISE: f64 = 1e3;

impl Schedule {
    /// For `rows` inequalities under a cost of the size `scale`.
    pub(super) fn new(scale: f64, rows: usize, tolerances: BarrierTolerances) -> Self {
        let share = scale / rows.max(1) as f64;
        let env = |name: &str, default: f64| std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default);
        let rho = env("RHO", PRICES[0]) * scale;
        Self {
            penalty: Penalty {
                beta: (env("FIRST", FIRST) * share).max(env("WIDTH", 0.0) * rho),
                rho,
            },
            last: (tolerances.gap * share).min(0.1 * tolerances.complementarity),
            tolerances,
            scale,
            share,
            solved: false,
        }
    }

    /// Changes β or ρ where the subproblem is solved: to `error`, its complementarity to `gap`, with multipliers up to
    /// `largest` and violations up to `violation`.
    pub(super) fn tighten(&mut self, error: f64, gap: f64, largest: f64, violation: f64) -> bool {
        let Penalty { beta, rho } = self.penalty;
        let part = beta / self.share;
        if std::env::var("LGVI_DEBUG").is_ok() { eprintln!("  part {part:.2e} gap/beta {:.2e} error {error:.2e} largest/rho {:.2e} violation {violation:.2e}", gap/beta, largest/rho); }
        self.solved = gap <= beta && error <= part.clamp(1e-8, 0.1);
        if !self.solved {
            return false;
        }
        let most = PRICES[1] * self.scale;
        let near: f64 = std::env::var("NEAR").ok().and_then(|v| v.parse().ok()).unwrap_or(NEAR);if largest > near * rho && rho < most {
            self.penalty.rho = (std::env::var("RISE").ok().and_then(|v| v.parse().ok()).unwrap_or(RISE) * rho).min(most);
            return true;
        }
        if beta > self.last && !(violation > self.tolerances.violation && rho == most) {
            let next = f64::min(0.2 * part, part * part.sqrt());
            self.penalty.beta = f64::max(self.last, self.share * next);
            return true;
        }
        false
    }

    /// Of a point with these largest violations, products and multipliers.
    pub(super) fn satisfied(&self, violation: f64, product: f64, largest: f64) -> Satisfied {
        let within = violation <= self.tolerances.violation
            && product <= self.tolerances.complementarity;
        let dear = self.penalty.rho >= PRICES[1] * self.scale;
        if self.solved && dear && violation > self.tolerances.violation && largest > HOPELESS * self.penalty.rho {
            Satisfied::Never
        } else if within && self.penalty.beta <= self.last {
            Satisfied::Yes
        } else {
            Satisfied::NotYet
        }
    }
}
