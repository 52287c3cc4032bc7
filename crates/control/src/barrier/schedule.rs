use super::penalty::Penalty;
use super::row::Row;
use crate::newton::Satisfied;

/// Tolerances of an accepted plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BarrierTolerances {
    /// Largest violation of an inequality.
    pub(crate) violation: f64,
    /// Largest product of slack and multiplier, relative to the cost.
    pub(crate) complementarity: f64,
    /// Largest cost of the barrier at the end, β times the number of inequalities, relative to the cost. More where
    /// rounding errors of the inequalities do not allow it.
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

/// Errors of the subproblem with the current β and ρ, over all inequalities.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Measure {
    /// Largest deviation of `y s` and `(ρ − y) t` from β.
    pub(super) gap: f64,
    /// Largest multiplier of an inequality without a price.
    pub(super) multiplier: f64,
    /// Largest `g` without a price, or 0 if no inequality is violated.
    pub(super) violation: f64,
    /// Largest `g` with a price, or 0.
    pub(super) priced: f64,
    /// Sum of what all `g > 0` with a price cost.
    pub(super) paid: f64,
    /// Largest `y s`, and their sum.
    pub(super) product: f64,
    pub(super) products: f64,
    /// Largest rounding error of `y s`.
    pub(super) noise: f64,
}

impl Measure {
    /// Adds a row whose `g` has this rounding error, and whose violation has a price or is forbidden.
    pub(super) fn take(&mut self, row: &Row, price: Option<f64>, rounding: f64) {
        self.gap = self.gap.max(row.gap);
        if let Some(price) = price {
            self.priced = self.priced.max(row.value);
            self.paid += price * row.value.max(0.0);
        } else {
            self.multiplier = self.multiplier.max(row.multiplier);
            self.violation = self.violation.max(row.value);
        }
        self.product = self.product.max(row.product);
        self.products += row.product;
        self.noise = self.noise.max(row.multiplier * rounding);
    }
}

/// The schedule by which β decreases and ρ increases (Fiacco and McCormick).
#[derive(Clone, Debug)]
pub(super) struct Schedule {
    pub(super) penalty: Penalty,
    pub(super) tolerances: BarrierTolerances,
    /// The size of the cost.
    cost: f64,
    /// The share of the cost per inequality.
    share: f64,
    /// The smallest β, rounding errors aside, and the highest ρ.
    last: f64,
    highest: f64,
    /// True if the subproblem was solved at the last check.
    solved: bool,
    /// Number of consecutive checks at which the subproblem was solved as well as rounding may allow.
    rough: u32,
}

/// Initial β, relative to the share of the cost per inequality.
const FIRST: f64 = 0.1;
/// Initial β of a smooth start, relative to the share of the cost per inequality. It leads to cheaper switching structures.
const SMOOTH: f64 = 3.0;
/// Highest β that a smooth start raises it to, relative to the cost of a command that is at its limit for a step.
const SMOOTHEST: f64 = 0.2;
/// Initial and highest ρ, relative to the cost.
const PRICES: [f64; 2] = [1e2, 1e6];
/// Part of ρ at which a multiplier raises ρ to its highest value.
const NEAR: f64 = 0.1;
/// Part of the highest ρ above which a multiplier shows that the inequalities cannot be satisfied.
const HOPELESS: f64 = 0.9;
/// Relative errors to which the last and the first subproblem are solved.
const ERRORS: [f64; 2] = [1e-8, 0.1];
/// Least β, relative to the rounding error of the products of slack and multiplier, and the highest that it may be for that
/// reason, relative to the share of the cost per inequality.
const CLEAR: f64 = 10.0;
const COARSEST: f64 = 1e-5;

/// Relative error of the products of slack and multiplier, stationarity, and number of consecutive checks for which
/// only rounding errors are left. A rounding error ε of `g` changes the multipliers by `y² ε/β`.
const ROUGH_GAP: f64 = 1e-3;
const ROUGH_ERROR: f64 = 1e-5;
const ROUGH_TIMES: u32 = 4;

impl Schedule {
    /// The schedule for `rows` inequalities and a cost of this size.
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

    /// Starts at a larger β where a command that is at its limit for a step costs at least `at_limit`.
    pub(super) fn start_smoothly(&mut self, at_limit: f64) {
        let beta = (SMOOTH * self.share).min(SMOOTHEST * at_limit);
        self.penalty.beta = self.penalty.beta.max(beta);
    }

    /// Starts at a smaller β, relative to the share of the cost per inequality.
    pub(super) fn start_at(&mut self, part: f64) {
        self.penalty.beta = (part * self.share).max(self.last);
    }

    /// Lowers β or raises ρ if the subproblem is solved, where `error` is its largest stationarity and violation.
    /// Returns `false` if nothing changed.
    pub(super) fn tighten(&mut self, error: f64, now: &Measure) -> bool {
        let Penalty { beta, rho } = self.penalty;
        let part = beta / self.share;
        let noise = ROUGH_GAP * beta + 2.0 * now.noise;
        let rough = now.gap <= noise && error <= ROUGH_ERROR;
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
        let last = self.last(now);
        if beta > last && !self.hopeless(now) {
            self.rough = 0;
            self.penalty.beta = (self.share * (0.2 * part).min(part * part.sqrt())).max(last);
            return true;
        }
        false
    }

    /// The state of the inequalities.
    pub(super) fn satisfied(&self, now: &Measure) -> Satisfied {
        let clear = 2.0 * self.last(now) / self.cost;
        let within = now.violation <= self.tolerances.violation
            && self.complementarity(now) <= self.tolerances.complementarity.max(clear);
        if self.solved && self.hopeless(now) {
            Satisfied::Never
        } else if within && self.penalty.beta <= self.last(now) {
            if self.rough > ROUGH_TIMES {
                Satisfied::ToRounding
            } else {
                Satisfied::Yes
            }
        } else {
            Satisfied::NotYet
        }
    }

    /// The largest product of slack and multiplier, relative to the cost.
    pub(super) fn complementarity(&self, now: &Measure) -> f64 {
        now.product / self.cost
    }

    /// The β of the last subproblem.
    fn last(&self, now: &Measure) -> f64 {
        let clear = (CLEAR * now.noise).min(COARSEST * self.share);
        self.last.max(clear)
    }

    /// True if a violation remains with the highest ρ.
    fn hopeless(&self, now: &Measure) -> bool {
        now.violation > self.tolerances.violation && now.multiplier > HOPELESS * self.highest
    }
}
