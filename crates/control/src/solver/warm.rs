//! Warm starts from the plan of a similar transfer.

use lgvi_dynamics::Load;
use nalgebra::SVector;

use super::attempt::{Failure, Solver};
use super::class::Class;
use super::error::PlanError;
use super::neighboring::Neighbor;
use super::progress::Phase;
use crate::Plan;
use crate::discrete::DiscreteDynamics;
use crate::newton::{Closeness, Iterate, Newton, Problem, guess};

impl<C> Solver<'_, C> {
    pub(super) fn warm<const X: usize, const U: usize>(
        &mut self,
        plan: &Plan,
    ) -> Result<Result<Newton<X, U>, Failure<X, U>>, PlanError>
    where
        C: Class<X, U>,
    {
        let steps = self.class.steps(self.transfer)?;
        let problem = self.problem(self.transfer, &steps);
        let newton = match self.neighboring(plan)? {
            Some(Neighbor::Plan(newton)) => return Ok(Ok(*newton)),
            Some(Neighbor::Guess(newton)) => *newton,
            None => {
                let mut iterate = self.resampled(plan)?;
                self.corrected(&problem, plan, &mut iterate);
                Newton::new(problem.intervals, iterate)
            }
        };
        let augmentation = newton.augmentation;
        let guess = Closeness::Close { augmentation };
        Ok(self.iterated(&problem, newton, guess, Phase::Fine))
    }

    /// A plan as an iterate, resampled to the transfer's intervals.
    pub(super) fn resampled<const X: usize, const U: usize>(
        &self,
        plan: &Plan,
    ) -> Result<Iterate<X, U>, PlanError>
    where
        C: Class<X, U>,
    {
        let nu = match plan.multipliers.last() {
            Some(last) => last.fixed_rows::<X>(C::FIRST).into_owned(),
            None => SVector::zeros(),
        };
        let iterate = Iterate {
            states: plan.states.clone(),
            commands: plan
                .commands
                .iter()
                .map(|w| self.class.narrowed(w))
                .collect(),
            nu,
        };
        let steps = self.class.steps(self.transfer)?;
        let mut iterate = guess::resampled(&steps, self.transfer.intervals, &iterate);
        iterate.states[0] = self.transfer.initial;
        Ok(iterate)
    }

    /// Flies a plan over the same intervals with its feedback, from the transfer's initial state. The iterate is left
    /// unchanged if the intervals differ or the flight fails.
    fn corrected<S, const X: usize, const U: usize>(
        &self,
        problem: &Problem<'_, S, C::Ending, X, U>,
        plan: &Plan,
        iterate: &mut Iterate<X, U>,
    ) where
        S: DiscreteDynamics<X, U>,
        C: Class<X, U>,
    {
        let lengths = [
            plan.feedback.len(),
            plan.commands.len(),
            plan.states.len().saturating_sub(1),
        ];
        if lengths != [problem.intervals; 3] {
            return;
        }
        let actuation = &self.transfer.actuation;
        let mut flown = iterate.clone();
        for k in 0..problem.intervals {
            let off = problem.steps.difference(&plan.states[k], &flown.states[k]);
            let gain = plan.feedback[k].fixed_columns::<X>(C::FIRST);
            let load = gain * off;
            let load = Load {
                force: load.fixed_rows::<3>(0).into_owned(),
                moment: load.fixed_rows::<3>(3).into_owned(),
            };
            flown.commands[k] -= self.class.narrowed(&actuation.command(&load));
            match problem.steps.next(k, &flown.states[k], &flown.commands[k]) {
                Ok(next) if next.is_finite() => flown.states[k + 1] = next,
                _ => return,
            }
        }
        *iterate = flown;
    }
}
