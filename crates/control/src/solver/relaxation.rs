//! Gradual imposition of the inequalities, for cases where imposing them at once fails.

use super::attempt::Solver;
use super::class::Class;
use super::error::PlanError;
use crate::Plan;
use crate::newton::Newton;

/// The part of the slack that a first attempt keeps, and the largest part that is tried before giving up.
const PARTS: [f64; 2] = [0.5, 0.95];
/// Part of the first slack below which the slack is set to zero.
const LITTLE: f64 = 0.02;
/// Maximum number of attempts.
const ATTEMPTS: u32 = 24;
/// Divisor of the maximum number of Newton steps, for each attempt.
const PATIENCE: u32 = 4;

impl<C> Solver<'_, C> {
    /// Goes from the plan without inequalities to one with all of them, by plans with decreasing slack. The slack is
    /// the same for all inequalities, so that the greatest violation is lowered. If no plan without slack is found,
    /// returns the violation of the plan with the least slack, or `failure` if there is none.
    pub(super) fn by_relaxation<const X: usize, const U: usize>(
        &mut self,
        free: Newton<X, U>,
        failure: PlanError,
    ) -> Result<Plan, PlanError>
    where
        C: Class<X, U>,
    {
        let set = &self.transfer.inequalities;
        let steps = self.class.steps(self.transfer)?;
        let problem = self.problem(self.transfer, &steps);
        let barrier = self.barrier(&problem, &free.iterate, set);
        let Some(worst) = barrier.worst(&free.iterate.states[1..], &free.iterate.commands) else {
            return Err(failure);
        };
        let patience = self.tolerances.iterations;
        self.tolerances.iterations = patience.div_ceil(PATIENCE);
        let mut slack = worst.amount;
        let mut part = PARTS[0];
        let mut best = None;
        let mut start = Some(free);
        let mut reached = failure;
        for _ in 0..ATTEMPTS {
            let next = if part * slack > LITTLE * worst.amount {
                part * slack
            } else {
                0.0
            };
            let relaxed = set.relaxed(next);
            let found = match (&best, start.take()) {
                (Some(plan), _) => match self.known(plan)? {
                    Some((newton, forces)) => self.impose(newton, Some(&forces), &relaxed),
                    None => break,
                },
                (None, Some(free)) => {
                    let again = Newton::new(self.transfer.intervals, free.iterate.clone());
                    start = Some(again);
                    self.impose(free, None, &relaxed)
                }
                (None, None) => break,
            };
            match found {
                Ok(plan) if next == 0.0 => {
                    self.tolerances.iterations = patience;
                    return Ok(plan);
                }
                Ok(plan) => {
                    let commands = plan.commands.iter().map(|w| self.class.narrowed(w));
                    let commands: Vec<_> = commands.collect();
                    if let Some(violation) = barrier.worst(&plan.states[1..], &commands) {
                        reached = violation.into();
                    }
                    best = Some(plan);
                    slack = next;
                    part = PARTS[0];
                }
                Err(stopped @ PlanError::Stopped { .. }) => return Err(stopped),
                Err(_) => {
                    part = part.sqrt();
                    if part > PARTS[1] {
                        break;
                    }
                }
            }
        }
        self.tolerances.iterations = patience;
        Err(reached)
    }
}
