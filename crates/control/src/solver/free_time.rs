//! Newton's method with the step size as one more unknown.

use std::ops::ControlFlow;

use super::attempt::Solver;
use super::class::Class;
use super::error::PlanError;
use super::progress::Phase;
use crate::barrier::{Barrier, BarrierTolerances};
use crate::newton::{
    AUGMENTATIONS, Beside, Ended, Inequalities, Iterate, ModelError, ModelSettings, Newton,
    Satisfied,
};
use crate::{Plan, Transfer};

/// The price of time, and how exactly the time is found.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TimePrice {
    /// The cost per unit of the final time.
    pub(crate) rate: f64,
    /// What the barrier of all inequalities costs at the end, in parts of the cost.
    pub(crate) gap: f64,
}

/// The path of the least cost of a plan and its time.
#[derive(Clone, Debug)]
pub(crate) struct TimedPath {
    /// States, commands and multipliers alone.
    pub(crate) plan: Plan,
    /// A lower bound of the cost, if the path is known to be a minimum.
    pub(crate) bound: Option<f64>,
}

/// Change of the step size for differences, in parts of it.
const DIFFERENCE: f64 = 1e-4;
/// The most that the step size changes in one step, in parts of it.
const MOST: f64 = 0.3;
/// Largest violation and stationarity at the end.
const VIOLATION: f64 = 1e-9;
const STATIONARITY: f64 = 1e-6;
/// The most that a change of the step size may still save at the end, in parts of the gap.
const SAVED: f64 = 1e-3;

impl<C> Solver<'_, C> {
    /// Minimizes the cost of the plan and of its time, from a plan.
    pub(super) fn with_free_time<const X: usize, const U: usize>(
        mut self,
        plan: &Plan,
        price: &TimePrice,
    ) -> Result<TimedPath, PlanError>
    where
        C: Class<X, U>,
    {
        let intervals = self.transfer.intervals;
        let mut newton = Newton::new(intervals, self.resampled(plan)?);
        let rate = price.rate * intervals as f64;
        let mut h = self.transfer.h;
        let cost = plan.cost + rate * h;
        let tolerances = BarrierTolerances {
            gap: price.gap,
            ..self.barrier_tolerances()
        };
        let mut barrier = self.barrier_of_cost(&self.transfer.inequalities, cost, tolerances);
        let Iterate {
            states, commands, ..
        } = &newton.iterate;
        barrier.start(&states[1..], commands, false);
        let mut settings = ModelSettings {
            curvature: 1.0,
            augmentation: AUGMENTATIONS[0],
            damping: 0.0,
            gains: None,
        };
        let last = self.standing.iteration + self.tolerances.iterations;
        let ended = loop {
            match self.free_step(&mut newton, &mut barrier, &mut settings, price, h)? {
                ControlFlow::Continue(_) if self.standing.iteration >= last => {
                    break Ended::Capped;
                }
                ControlFlow::Continue(next) => h = next,
                ControlFlow::Break(ended) => break ended,
            }
        };
        let Some(products) = barrier.products().filter(|_| ended == Ended::Converged) else {
            let error = self.unsolved(ended, &newton.iterate)?;
            // Its plan is that of another step size.
            return Err(error.with_plan(|_| None));
        };
        // The iteration converges without damping only.
        let is_minimum = settings.curvature == 1.0;
        let slack = products + newton.model.violated(&newton.iterate.nu);
        let bound = self.standing.cost + rate * h - slack;
        let mut plan = self.assembled(newton.iterate);
        plan.cost *= h / plan.h;
        plan.h = h;
        for (wide, own) in plan.multipliers.iter_mut().zip(&newton.model.costates) {
            wide.fixed_rows_mut::<X>(C::FIRST).copy_from(own);
        }
        Ok(TimedPath {
            plan,
            bound: is_minimum.then_some(bound),
        })
    }

    /// One step from an iterate with steps of the size `h`.
    fn free_step<const X: usize, const U: usize>(
        &mut self,
        newton: &mut Newton<X, U>,
        barrier: &mut Barrier<X, U>,
        settings: &mut ModelSettings,
        price: &TimePrice,
        h: f64,
    ) -> Result<ControlFlow<Ended, f64>, PlanError>
    where
        C: Class<X, U>,
    {
        let rate = price.rate * self.transfer.intervals as f64;
        let sized = |h: f64| Transfer {
            h,
            ..self.transfer.clone()
        };
        let by = h * DIFFERENCE;
        let [view, shorter, longer] = [h, h - by, h + by].map(sized);
        let steps = self.class.steps(&view)?;
        let sides = [self.class.steps(&shorter)?, self.class.steps(&longer)?];
        let mut problem = self.problem(&view, &steps);
        problem.beside = Some(Beside {
            steps: [&sides[0], &sides[1]],
            by,
            attitude: C::OFFSETS[1],
        });
        let mut standing = self.standing;
        let (change, nu) = loop {
            if let Err(error) = newton.model_convex(&problem, barrier, settings) {
                return Ok(ControlFlow::Break(Ended::Failed(error)));
            }
            let Some((reduced, nu)) = newton.model.reduced() else {
                return Ok(ControlFlow::Break(Ended::Failed(ModelError::Dependent)));
            };
            newton.measure(&problem, &mut standing);
            let [slope, curvature] = [reduced[0] + rate, reduced[1]];
            let off = slope.abs() / rate;
            if barrier.tighten(standing.violation.max(standing.stationarity).max(off)) {
                continue;
            }
            self.standing = standing;
            if !(self.observe)(&standing.progress(Phase::Constrained)) {
                return Ok(ControlFlow::Break(Ended::Stopped));
            }
            let most = MOST * h;
            let change = if curvature > 0.0 {
                (-slope / curvature).clamp(-most, most)
            } else {
                -most.copysign(slope)
            };
            let saved = (slope * change).abs() / (rate * h);
            let met = standing.violation <= VIOLATION
                && standing.stationarity <= STATIONARITY
                && saved <= SAVED * price.gap
                && curvature > 0.0
                && barrier.products().is_some();
            match barrier.satisfied() {
                Satisfied::Yes | Satisfied::ToRounding if met => {
                    if settings.damping == 0.0 {
                        return Ok(ControlFlow::Break(Ended::Converged));
                    }
                    // Only a model without damping tells whether this is a minimum.
                    settings.damping = 0.0;
                    continue;
                }
                Satisfied::Never => return Ok(ControlFlow::Break(Ended::Infeasible)),
                _ => (),
            }
            break (change, nu[0] + change * nu[1]);
        };
        let from = newton.iterate.clone();
        barrier.set_step_size(h, change);
        newton.direct_with_step_size((change, h), nu, barrier);
        standing.iteration += 1;
        let mut next = h;
        // Commands go as `1/h²`, so that their cost goes as `1/h³`.
        let beside = [rate * h, change * (rate - 3.0 * standing.cost / h)];
        let stepped = newton.search_by(
            &problem,
            barrier,
            &mut standing,
            beside,
            |newton, barrier, standing, [length, wanted]| {
                next = h + length * change;
                let view = sized(next);
                let Ok(steps) = self.class.steps(&view) else {
                    return false;
                };
                barrier.set_step_size(next, change);
                newton.iterate = from.retimed(h / next);
                let wanted = wanted - rate * next;
                let problem = self.problem(&view, &steps);
                newton.step(&problem, barrier, length, wanted, standing)
            },
        );
        self.standing = standing;
        if stepped {
            settings.curvature = 1.0;
            settings.damp_after(&standing);
            return Ok(ControlFlow::Continue(next));
        }
        newton.iterate = from;
        barrier.set_step_size(h, 0.0);
        Ok(if settings.damp_more() {
            ControlFlow::Continue(h)
        } else {
            ControlFlow::Break(Ended::Stuck)
        })
    }
}

#[cfg(test)]
mod tests;
