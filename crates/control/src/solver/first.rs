//! Cold starts at the first resolution.

use lgvi_dynamics::{BodyState, RigidBody};

use super::attempt::{Failure, Solver};
use super::class::Class;
use super::error::PlanError;
use super::progress::Phase;
use super::resolution::{resolved, slenderness, with_least_ratio};
use crate::newton::{Closeness, Iterate, Newton, Problem, guess};

/// Ratio of the least moment of inertia to the greatest of the first body of the homotopy, and the factor by which it
/// decreases.
const FIRST_RATIO: f64 = 0.3;
const RATIO_DECREASE: f64 = 0.6;
/// Limit of the turn of the body in a step of the first resolution (rad), by an estimate from both ends.
const TURN: f64 = 0.3;

impl<C> Solver<'_, C> {
    /// Number of intervals of the first resolution: enough that the body turns little in a step.
    pub(super) fn first_intervals(&self) -> usize {
        let transfer = self.transfer;
        let duration = transfer.h * transfer.intervals as f64;
        let goal = self.goal();
        let rate = |state: &BodyState| {
            let spin = state.angular_velocity(&transfer.body).norm();
            match transfer.orbit {
                // What the wheels store makes the body nutate.
                Some(_) => {
                    spin + transfer.body.inertia().inverse().norm() * state.linear_momentum.norm()
                }
                None => spin,
            }
        };
        let swing = 2.0 * lgvi_lie::log(&transfer.initial.attitude.tr_mul(&goal.attitude)).norm();
        let turn = (duration * rate(&transfer.initial).max(rate(&goal))).max(swing);
        let least = (turn / TURN).min(transfer.intervals as f64);
        self.coarse.max(least as usize).min(transfer.intervals)
    }

    /// Solves at the first resolution, from a smooth path or from the free flight bent to the goal, whichever is
    /// cheaper to follow.
    pub(super) fn smooth<const X: usize, const U: usize>(
        &mut self,
        turns: f64,
    ) -> Result<Result<Newton<X, U>, Failure<X, U>>, PlanError>
    where
        C: Class<X, U>,
    {
        let view = resolved(self.transfer, self.first_intervals());
        let steps = self.class.steps(&view)?;
        let problem = self.problem(&view, &steps);
        let goal = self.goal();
        let path = guess::hermite(
            &view.body,
            view.h * view.intervals as f64,
            view.intervals,
            &view.initial,
            &goal,
            turns,
        );
        let smooth = guess::along(&problem, &view.body, &path, &goal);
        let bent = (turns == 0.0).then(|| self.bent()).flatten();
        let bent = bent.and_then(|path| guess::along(&problem, &view.body, &path, &goal).ok());
        let iterate = match (smooth, bent) {
            (Ok(smooth), Some(bent)) if cost(&problem, &smooth) <= cost(&problem, &bent) => smooth,
            (_, Some(bent)) => bent,
            (smooth, None) => {
                smooth.map_err(|(step, source)| PlanError::Dynamics { step, source })?
            }
        };
        Ok(self.level(&problem, iterate, Closeness::Rough, Phase::Coarse))
    }

    /// Solves at the first resolution for a body with similar moments of inertia, then for ever more slender bodies, up to
    /// the body itself.
    /// Returns `None` if the body is not slender.
    pub(super) fn inertia_homotopy<const X: usize, const U: usize>(
        &mut self,
    ) -> Option<Result<Result<Newton<X, U>, Failure<X, U>>, PlanError>>
    where
        C: Class<X, U>,
    {
        let own = slenderness(&self.transfer.body);
        if own >= FIRST_RATIO {
            return None;
        }
        let goal = self.goal();
        let mut least = FIRST_RATIO;
        let mut plan: Option<Newton<X, U>> = None;
        loop {
            let mut view = resolved(self.transfer, self.first_intervals());
            if least > own {
                view.body = with_least_ratio(&view.body, least)?;
                view.initial = spun(&self.transfer.body, &view.body, &view.initial);
            }
            let goal = spun(&self.transfer.body, &view.body, &goal);
            let steps = match self.class.steps(&view) {
                Ok(steps) => steps,
                Err(error) => return Some(Err(error.into())),
            };
            let problem = self.problem(&view, &steps);
            let path = match &plan {
                Some(newton) => newton
                    .iterate
                    .states
                    .iter()
                    .map(|state| (state.position, state.attitude))
                    .collect(),
                None => guess::hermite(
                    &view.body,
                    view.h * view.intervals as f64,
                    view.intervals,
                    &view.initial,
                    &goal,
                    0.0,
                ),
            };
            let mut iterate = guess::along(&problem, &view.body, &path, &goal).ok()?;
            if let Some(newton) = &plan {
                iterate.nu = newton.iterate.nu;
            }
            let closeness = match plan {
                Some(_) => Closeness::Far,
                None => Closeness::Rough,
            };
            match self.level(&problem, iterate, closeness, Phase::Coarse) {
                Ok(newton) if least <= own => return Some(Ok(Ok(newton))),
                Ok(newton) => plan = Some(newton),
                failure => return Some(Ok(failure)),
            }
            least = (least * RATIO_DECREASE).max(own);
        }
    }
}

/// The cost of an iterate's commands.
fn cost<S, E, const X: usize, const U: usize>(
    problem: &Problem<'_, S, E, X, U>,
    iterate: &Iterate<X, U>,
) -> f64 {
    let each = iterate
        .commands
        .iter()
        .map(|w| w.dot(&(problem.weight * w)));
    each.sum()
}

/// `state` of `body` as a state of `other` with the same velocities.
fn spun(body: &RigidBody, other: &RigidBody, state: &BodyState) -> BodyState {
    BodyState {
        angular_momentum: other.inertia().matrix() * state.angular_velocity(body),
        ..*state
    }
}
