//! The pairs of bodies that keep apart, and the margins by which they do so between the ends of steps.

use super::bodies::Bodies;
use super::error::FormationError;
use super::separation::Distances;
use crate::solver::{BETWEEN, Margin, Reached};
use crate::units::ROUNDING;
use crate::{Dynamics, PlanError, Transfer};

/// Distance, in parts of the separation, up to which two bodies count as near.
const NEAR: f64 = 2.0;

/// A pair that keeps apart.
#[derive(Clone, Debug)]
pub(super) struct Near {
    /// Places in the order; the second body owns the inequality.
    pub(super) places: [usize; 2],
    /// The first end of a step whose position is planned.
    first: usize,
    /// By how much the inequality is tightened at the ends of each step.
    margins: Vec<Margin>,
}

impl Near {
    /// The radius `R` of the sphere at the states `0 … N`: with a margin `m`, `½ (1 − r²/d²) ≤ −m` is `r² ≥ R² = d² (1 + 2 m)`.
    pub(super) fn radii(&self, separation: f64) -> Vec<f64> {
        let steps = self.margins.len();
        let at = |end: usize| match (self.first..steps).contains(&end) {
            true => self.margins[end - 1].amount.max(self.margins[end].amount),
            false => 0.0,
        };
        let radius = |end| separation * (1.0 + 2.0 * at(end)).sqrt();
        (0..=steps).map(radius).collect()
    }
}

impl Bodies<'_> {
    /// The first end of a step whose position is planned for all bodies: the first Lie–Euler step is given by the start.
    fn first(&self) -> usize {
        let given = |transfer: &Transfer| transfer.dynamics == Dynamics::LieEuler;
        1 + usize::from(self.transfers.iter().any(given))
    }

    /// What the separation of a pair reaches in each step.
    fn reached(&self, places: [usize; 2]) -> Vec<Reached> {
        let paths = places.map(|place| &self.paths[self.order[place]]);
        Distances(paths).reached(self.separation, self.first())
    }

    /// By how much the inequality of the separation may be exceeded.
    fn tolerance(&self) -> f64 {
        let ends = self.paths.iter().flat_map(|path| path.ends.iter());
        let size = ends.map(|end| end.amax()).fold(0.0, f64::max);
        BETWEEN.max(ROUNDING * size / self.separation)
    }

    /// Adjusts the margins of steps in which bodies come too near; whether there are any.
    ///
    /// # Errors
    /// Returns an error if bodies come too near only in steps whose ends are given by start and target.
    pub(super) fn adjust(&mut self, hurry: f64) -> Result<bool, FormationError> {
        let at_ends = |transfer: &Transfer| transfer.inequalities.only_at_ends;
        if self.transfers.iter().any(at_ends) {
            return Ok(false);
        }
        let tolerance = self.tolerance();
        let mut near = std::mem::take(&mut self.near);
        let (mut adjusted, mut given) = (false, false);
        for Near {
            places, margins, ..
        } in &mut near
        {
            for (margin, reached) in margins.iter_mut().zip(self.reached(*places)) {
                if reached.excess <= tolerance {
                    continue;
                }
                if reached.ends.is_some() {
                    margin.adjust(&reached, 0.5 * tolerance, hurry);
                    adjusted = true;
                } else {
                    given = true;
                }
            }
        }
        self.near = near;
        match given && !adjusted {
            true => Err(self.too_near()),
            false => Ok(adjusted),
        }
    }

    /// The error of bodies that still come too near to each other within a step.
    pub(super) fn too_near(&self) -> FormationError {
        let steps = self.near.iter().flat_map(|near| {
            let steps = self.reached(near.places).into_iter().enumerate();
            steps.map(|(step, reached)| (near.places, step, reached.excess))
        });
        let worst = steps.max_by(|one, other| one.2.total_cmp(&other.2));
        let (places, step, excess) = worst.unwrap_or(([0, 1], 0, 0.0));
        FormationError::Apart {
            bodies: places.map(|place| self.order[place]),
            source: Box::new(PlanError::Between {
                constraint: 0,
                step,
                violation: 1.0 - (1.0 - 2.0 * excess).max(0.0).sqrt(),
                best: None,
            }),
        }
    }

    /// Gives the pairs that come near to each other an inequality; whether there are any new ones.
    pub(super) fn grow(&mut self) -> bool {
        let new: Vec<_> = self.others(NEAR).collect();
        let margins = vec![Margin::default(); self.intervals()];
        let first = self.first();
        let near = new.iter().map(|places| Near {
            places: *places,
            first,
            margins: margins.clone(),
        });
        self.near.extend(near);
        self.near.sort_by_key(|near| near.places);
        !new.is_empty()
    }

    /// Whether a pair without an inequality is too near.
    pub(super) fn is_unseen(&self) -> bool {
        self.others(1.0).next().is_some()
    }

    /// The pairs without an inequality that come nearer to each other than so many separations.
    fn others(&self, separations: f64) -> impl Iterator<Item = [usize; 2]> {
        let places = 0..self.order.len();
        let pairs = places.flat_map(|place| (0..place).map(move |other| [other, place]));
        pairs.filter(move |pair| {
            let paths = pair.map(|place| &self.paths[self.order[place]]);
            self.near.iter().all(|near| near.places != *pair)
                && Distances(paths).nearest().distance < separations * self.separation
        })
    }
}
