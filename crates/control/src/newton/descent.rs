//! Descent along a direction of negative curvature, from a stationary point that is not a minimum.

use nalgebra::SVector;

use super::conditions::{Ending, Inequalities};
use super::iteration::Newton;
use super::model::{ModelError, ModelSettings};
use super::problem::{Iterate, Problem};
use super::search::CORRECTIONS;
use super::trial::{Merit, Move, Trial};
use crate::discrete::DiscreteDynamics;

/// Augmentations for which the Hessian is tested. The larger the augmentation, the closer the direction stays to the
/// terminal conditions.
const AUGMENTATIONS: [f64; 3] = [1e7, 1e5, 1e3];
/// The model whose policies keep trial points near their path and meet the conditions.
const POLICIES: ModelSettings = ModelSettings {
    curvature: 0.0,
    augmentation: 10.0,
    damping: 0.0,
    gains: None,
};
/// Trial lengths, as powers of two times the length at which the direction alone costs as much as the plan.
const LENGTHS: std::ops::RangeInclusive<i32> = -10..=3;
/// Relative difference of merits below which they differ by rounding only.
const ROUNDING: f64 = 1e-10;

impl<const X: usize, const U: usize> Newton<X, U> {
    /// Goes from a stationary iterate without defects to a point of lower merit along a direction of negative
    /// curvature. Returns `None` if the Hessian has no such direction or if none lowers the merit.
    pub(crate) fn downhill<S, E, Q>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        inequalities: &mut Q,
    ) -> Option<Iterate<X, U>>
    where
        S: DiscreteDynamics<X, U>,
        E: Ending<X>,
        Q: Inequalities<X, U>,
    {
        self.weights.defects.fill(0.0);
        self.weights.miss = 2.0 * self.iterate.nu.abs();
        AUGMENTATIONS.into_iter().find_map(|augmentation| {
            let settings = ModelSettings {
                curvature: 1.0,
                augmentation,
                ..POLICIES
            };
            let found = self
                .model
                .solve(problem, inequalities, &self.iterate, settings);
            let Err(ModelError::NotConvex { stage }) = found else {
                return None;
            };
            self.take_direction_from(stage);
            self.model
                .solve(problem, inequalities, &self.iterate, POLICIES)
                .ok()?;
            self.lowest(problem, inequalities)
        })
    }

    /// Sets the direction: it starts at `stage` with the command along which the model is not convex, and continues
    /// with the policies of the later stages.
    fn take_direction_from(&mut self, stage: usize) {
        let (model, direction) = (&self.model, &mut self.direction);
        direction.nu = self.iterate.nu;
        direction.states.fill(SVector::zeros());
        direction.commands.fill(SVector::zeros());
        let mut z = SVector::zeros();
        for k in stage..direction.commands.len() {
            let policy = &model.policies[k];
            let v = if k == stage {
                policy.constant
            } else {
                policy.state.tr_mul(&z)
            };
            z = model.dynamics[k].forward(&model.inputs, &z, &v);
            direction.commands[k] = v;
            direction.states[k + 1] = z;
        }
    }

    /// Returns the trial point of least merit along the direction, on either side, or `None` if no trial has a lower
    /// merit than the iterate.
    fn lowest<S, E, Q>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        inequalities: &Q,
    ) -> Option<Iterate<X, U>>
    where
        S: DiscreteDynamics<X, U>,
        E: Ending<X>,
        Q: Inequalities<X, U>,
    {
        let here = self.along(0.0, problem, inequalities)?;
        let weight = problem.h * problem.weight;
        let commands = self.direction.commands.iter();
        let size: f64 = commands.map(|v| 0.5 * v.dot(&(weight * v))).sum();
        let unit = (here.cost / size).sqrt();
        let mut least = here.total() - ROUNDING * here.total().abs();
        let mut lowest = None;
        for sign in [1.0, -1.0] {
            let mut falls = false;
            for power in LENGTHS {
                let length = sign * unit * f64::from(power).exp2();
                match self.along(length, problem, inequalities) {
                    Some(merit) if merit.total() < least => {
                        least = merit.total();
                        lowest = Some(self.spare.clone());
                        falls = true;
                    }
                    _ if falls => break,
                    _ => (),
                }
            }
        }
        lowest
    }

    /// Moves the iterate by `length` along the direction, corrects it back to the terminal conditions and stores it as
    /// the spare iterate. Returns its merit.
    fn along<S, E, Q>(
        &mut self,
        length: f64,
        problem: &Problem<'_, S, E, X, U>,
        inequalities: &Q,
    ) -> Option<Merit<X>>
    where
        S: DiscreteDynamics<X, U>,
        E: Ending<X>,
        Q: Inequalities<X, U>,
    {
        let trial = Trial {
            problem,
            inequalities,
            model: &self.model,
            weights: &self.weights,
            length: 1.0,
        };
        let flown = Move::Flown(&self.direction, length);
        let mut merit = trial.make(flown, &self.iterate, &mut self.spare).ok()?;
        for _ in 0..CORRECTIONS {
            let Some(nu) = self.model.start.correction(&merit.miss) else {
                break;
            };
            match trial.make(Move::Conditions(nu), &self.spare, &mut self.third) {
                Ok(corrected) if corrected.miss.norm() < merit.miss.norm() => merit = corrected,
                _ => break,
            }
            std::mem::swap(&mut self.spare, &mut self.third);
        }
        merit.total().is_finite().then_some(merit)
    }
}
