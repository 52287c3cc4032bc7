use super::penalty::Penalty;
use super::row::Row;
use crate::newton::Satisfied;

/// What an accepted plan satisfies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BarrierTolerances {
    /// Largest violation of an inequality.
    pub(crate) violation: f64,
    /// Largest product of slack and multiplier, in parts of the cost.
    pub(crate) complementarity: f64,
    /// What the barrier may cost at the end, β times the number of inequalities, in parts of the cost.
    pub(crate) gap: f64,
}

impl Default for BarrierTolerances {
    fn default() -> Self {
        Self {
            violation: 1e-9,
            complementarity: 1e-9,
            gap: 1e-8,
        }
    }
}

/// How far the subproblem of the present β and ρ is solved, over all inequalities.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Measure {
    /// Largest deviation of `y s` and `(ρ − y) t` from β.
    pub(super) gap: f64,
    /// Largest multiplier.
    pub(super) multiplier: f64,
    /// Largest `g`; 0 where none is violated.
    pub(super) violation: f64,
    /// Largest `y s`.
    pub(super) product: f64,
}

impl Measure {
    pub(super) fn take(&mut self, row: &Row) {
        self.gap = self.gap.max(row.gap);
        self.multiplier = self.multiplier.max(row.multiplier);
        self.violation = self.violation.max(row.value);
        self.product = self.product.max(row.product);
    }
}

/// How β falls and ρ rises (Fiacco and McCormick).
#[derive(Clone, Debug)]
pub(super) struct Schedule {
    pub(super) penalty: Penalty,
    pub(super) tolerances: BarrierTolerances,
    /// The size of the cost.
    cost: f64,
    /// An inequality's share of it.
    share: f64,
    /// The last β and the highest ρ.
    last: f64,
    highest: f64,
    /// Whether the subproblem was solved when last looked at.
    solved: bool,
    /// How often in a row it was as good as rounding may leave it.
    rough: u32,
}

/// β at the start, in parts of an inequality's share of the cost.
const FIRST: f64 = 0.1;
/// ρ at the start and at most, in parts of the cost.
const PRICES: [f64; 2] = [1e2, 1e6];
/// How near to ρ a multiplier may come before ρ rises to the highest.
const NEAR: f64 = 0.1;
/// How near to the highest ρ one is where inequalities cannot be satisfied.
const HOPELESS: f64 = 0.9;
/// Errors to which subproblems are solved, relative: from the last to the first.
const ERRORS: [f64; 2] = [1e-8, 0.1];

/// Where products of slack and multiplier are this near to β, stationarity this near to 0, and that so many times in a
/// row, only rounding is left: `g` of rounding ε puts `y² ε/β` into the multipliers.
const ROUGH_GAP: f64 = 1e-3;
const ROUGH_ERROR: f64 = 1e-5;
const ROUGH_TIMES: u32 = 4;

impl Schedule {
    /// For `rows` inequalities under a cost of this size.
    pub(super) fn new(cost: f64, rows: usize, tolerances: BarrierTolerances) -> Self {
        let share = cost / rows.max(1) as f64;
        Self {
            penalty: Penalty {
                beta: FIRST * share,
                rho: PRICES[0] * cost,
            },
            tolerances,
            cost,
            share,
            last: (tolerances.gap * share).min(0.5 * tolerances.complementarity * cost),
            highest: PRICES[1] * cost,
            solved: false,
            rough: 0,
        }
    }

    /// Starts at a smaller β, in parts of an inequality's share of the cost.
    pub(super) fn start_at(&mut self, part: f64) {
        self.penalty.beta = (part * self.share).max(self.last);
    }

    /// Lowers β or raises ρ where the subproblem is solved, its stationarity and violations to `error`; `false` where
    /// nothing changed.
    pub(super) fn tighten(&mut self, error: f64, now: &Measure) -> bool {
        let Penalty { beta, rho } = self.penalty;
        let part = beta / self.share;
        let rough = now.gap <= ROUGH_GAP * beta && error <= ROUGH_ERROR;
        self.rough = if rough { self.rough + 1 } else { 0 };
        self.solved = now.gap <= beta && error <= part.clamp(ERRORS[0], ERRORS[1])
            || self.rough > ROUGH_TIMES;
        if !self.solved {
            return false;
        }
        if now.multiplier > NEAR * rho && rho < self.highest {
            self.penalty.rho = self.highest;
            return true;
        }
        if beta > self.last && !self.hopeless(now) {
            self.rough = 0;
            self.penalty.beta = (self.share * (0.2 * part).min(part * part.sqrt())).max(self.last);
            return true;
        }
        false
    }

    /// What has become of the inequalities.
    pub(super) fn satisfied(&self, now: &Measure) -> Satisfied {
        let within = now.violation <= self.tolerances.violation
            && self.complementarity(now) <= self.tolerances.complementarity;
        if self.solved && self.hopeless(now) {
            Satisfied::Never
        } else if within && self.penalty.beta <= self.last {
            if self.rough > ROUGH_TIMES {
                Satisfied::ToRounding
            } else {
                Satisfied::Yes
            }
        } else {
            Satisfied::NotYet
        }
    }

    /// The largest product of slack and multiplier in parts of the cost.
    pub(super) fn complementarity(&self, now: &Measure) -> f64 {
        now.product / self.cost
    }

    /// Whether a violation remains at the highest price.
    fn hopeless(&self, now: &Measure) -> bool {
        now.violation > self.tolerances.violation && now.multiplier > HOPELESS * self.highest
    }
}
