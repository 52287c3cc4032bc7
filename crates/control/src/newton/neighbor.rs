//! Plans of neighboring transfers by the policies of a plan that is known.

use nalgebra::{SMatrix, SVector};

use super::conditions::{Ending, Unconstrained};
use super::iteration::{Ended, Newton, Standing, Tolerances};
use super::model::Model;
use super::problem::{Iterate, Problem};
use super::trial::{Move, Trial};
use crate::discrete::DiscreteDynamics;
use crate::riccati::{Policy, Scale, pivots};

/// The policies of all stages of an exact and convex model.
#[derive(Clone, PartialEq)]
pub(crate) struct Policies<const X: usize, const U: usize> {
    pub(crate) stages: Vec<Policy<X, U>>,
    /// `ρ`, the weights of the augmentation of the terminal conditions.
    pub(crate) weights: SVector<f64, X>,
    /// The augmentation that made the model convex.
    pub(crate) augmentation: f64,
    /// The Gram matrix M of the cost to go from the first stage.
    gram: SMatrix<f64, X, X>,
}

/// Part of the duration by which a point where convexity ends must be missed, and the least ratio of the pivots of `Q_vv`
/// to those of `h W` if there are few stages.
const MISSED: f64 = 0.05;
const LEAST: f64 = 0.5;

impl<const X: usize, const U: usize> Policies<X, U> {
    /// The policies of a model that is convex with a margin, or `None` if the model has no such margin.
    ///
    /// `P → −∞` where convexity ends. There `P' ≈ −P W⁻¹ P`, so that `m` stages before it the pivots of `Q_vv ≈ h W +
    /// h² P` are `1 − 1/m` times those of `h W`.
    pub(crate) fn with_margin<S, E>(
        problem: &Problem<'_, S, E, X, U>,
        newton: &mut Newton<X, U>,
    ) -> Option<Self> {
        let least = (1.0 - (MISSED * problem.intervals as f64).recip()).max(LEAST);
        let least = least * pivots(&(problem.h * problem.weight))?;
        let stages = &mut newton.model.policies;
        let convex = stages.iter().all(|policy| policy.exceeds(&least));
        convex.then(|| Self {
            stages: std::mem::take(stages),
            weights: newton.model.augmentation,
            augmentation: newton.augmentation,
            gram: newton.model.start.gram,
        })
    }

    /// The policies from stage `first` on.
    pub(crate) fn rest(&self, first: usize) -> Self {
        let mut gram = self.gram;
        // M is a sum over the stages.
        for policy in self.stages.iter().take(first) {
            policy.add_gram(&mut gram, -1.0);
        }
        Self {
            stages: self.stages.iter().skip(first).cloned().collect(),
            gram,
            ..*self
        }
    }

    /// Converts to units in which quantities have these values if they are 1 now.
    pub(crate) fn convert(&mut self, to: &Scale<X, U>) {
        for policy in &mut self.stages {
            policy.convert(to);
        }
        let conditions = to.conditions;
        let squares = conditions.component_mul(&conditions);
        self.weights.component_div_assign(&squares);
        self.weights *= to.cost;
        let pairs = conditions * conditions.transpose() / to.cost;
        self.gram.component_mul_assign(&pairs);
    }
}

impl<const X: usize, const U: usize> Newton<X, U> {
    /// The iteration from a plan whose `policies` are known.
    pub(crate) fn neighboring<S, E>(
        problem: &Problem<'_, S, E, X, U>,
        policies: Policies<X, U>,
        planned: Iterate<X, U>,
    ) -> Self
    where
        S: DiscreteDynamics<X, U>,
    {
        let mut model = Model::with_policies(policies.stages);
        model.inputs = problem.steps.inputs();
        model.augmentation = policies.weights;
        model.start.gram = policies.gram;
        Self {
            augmentation: policies.augmentation,
            ..Self::with_model(model, planned)
        }
    }

    /// Flies the plan from the initial state with the policies, then once more with the multipliers that lead to the end
    /// to first order. Returns `None` if it cannot be flown.
    pub(crate) fn fly_by<S, E>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        standing: &mut Standing,
    ) -> Option<()>
    where
        S: DiscreteDynamics<X, U>,
        E: Ending<X>,
    {
        let mut change = SVector::zeros();
        self.third.states[0] = problem.initial;
        for _ in 0..2 {
            self.spare.states[0] = problem.initial;
            let trial = Trial {
                problem,
                inequalities: &Unconstrained,
                model: &self.model,
                weights: &self.weights,
                length: 1.0,
            };
            standing.trials += 1;
            let conditions = Move::Conditions(change);
            let flown = trial
                .make(conditions, &self.iterate, &mut self.spare)
                .ok()?;
            self.spare.nu += change;
            std::mem::swap(&mut self.iterate, &mut self.spare);
            change = self.model.start.correction(&flown.miss)?;
        }
        let end = &self.iterate.states[problem.intervals];
        end.is_finite().then_some(())
    }

    /// Goes on with the policies after [`Newton::fly_by`]. Returns `None` if this does not converge fast.
    pub(crate) fn settle<S, E>(
        &mut self,
        problem: &Problem<'_, S, E, X, U>,
        tolerances: &Tolerances,
        standing: &mut Standing,
        mut observe: impl FnMut(&Standing) -> bool,
    ) -> Option<Ended>
    where
        S: DiscreteDynamics<X, U>,
        E: Ending<X>,
    {
        let last = standing.iteration + tolerances.iterations;
        let ended = self.follow(
            problem,
            &mut Unconstrained,
            tolerances,
            last,
            standing,
            &mut observe,
        )?;
        if ended == Ended::Converged && !observe(standing) {
            return Some(Ended::Stopped);
        }
        Some(ended)
    }
}
