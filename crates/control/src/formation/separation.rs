//! The distance between two bodies, along the motions that their steps stand for.

use std::sync::Arc;

use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, Vector3};

use crate::constraint::{Coordinates, KeepOutSphere, StateConstraint};
use crate::discrete::Within;
use crate::problem::ParameterError;
use crate::solver::{Reached, highest};
use crate::{Plan, Transfer};

/// The positions of a body along its plan.
#[derive(Clone, Debug)]
pub(super) struct Path {
    pub(super) ends: Arc<[Vector3<f64>]>,
    within: Arc<[Within]>,
}

impl Path {
    pub(super) fn of(transfer: &Transfer, plan: &Plan) -> Self {
        Self {
            ends: plan.states.iter().map(|state| state.position).collect(),
            within: Within::all(transfer, &plan.states).into(),
        }
    }
}

/// The distance of two bodies in each step.
pub(super) struct Distances<'p>(pub(super) [&'p Path; 2]);

impl Distances<'_> {
    fn steps(&self) -> usize {
        self.0[0].within.len()
    }

    fn squared(&self, step: usize, part: f64) -> f64 {
        let [one, other] = self.0.map(|path| match part {
            0.0 => path.ends[step],
            1.0 => path.ends[step + 1],
            _ => path.within[step].at(part).position,
        });
        (one - other).norm_squared()
    }

    /// The greatest of `a − |x_i − x_j|²` in a step, or a value up to 0.
    fn highest_below(&self, step: usize, a: f64) -> f64 {
        highest([0.0, 1.0], |part| a - self.squared(step, part))
    }

    /// The nearest approach.
    pub(super) fn nearest(&self) -> Approach {
        let approach = |step| {
            let from = self.squared(step, 0.0);
            let rise = self.highest_below(step, from);
            Approach {
                distance: (from - rise).max(0.0).sqrt(),
                step,
            }
        };
        let none = Approach {
            distance: f64::INFINITY,
            step: 0,
        };
        let nearer = |least: Approach, now: Approach| match now.distance < least.distance {
            true => now,
            false => least,
        };
        (0..self.steps()).map(approach).fold(none, nearer)
    }

    /// What `½ (1 − |x_i − x_j|²/d²)` reaches in each step, where the ends `first … N − 1` are planned.
    pub(super) fn reached(&self, separation: f64, first: usize) -> Vec<Reached> {
        let (steps, own) = (self.steps(), separation.powi(2));
        let value = |rest: f64| 0.5 * rest / own;
        let at = |end: usize| match end == steps {
            true => value(own - self.squared(end - 1, 1.0)),
            false => value(own - self.squared(end, 0.0)),
        };
        let is_planned = |end: &usize| (first..steps).contains(end);
        let reached = |step: usize| {
            let ends = [step, step + 1];
            let planned = ends.iter().copied().filter(is_planned).map(at);
            let given = ends.iter().copied().filter(|end| !is_planned(end)).map(at);
            Reached {
                excess: value(self.highest_below(step, own)) - given.fold(0.0, f64::max),
                ends: planned.reduce(f64::max),
            }
        };
        (0..steps).map(reached).collect()
    }
}

/// The nearest approach of two bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Approach {
    pub(super) distance: f64,
    /// The step in which it is.
    pub(super) step: usize,
}

/// Spheres about another body at the ends of steps, which a body stays out of.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Separation {
    h: f64,
    spheres: Arc<[KeepOutSphere]>,
}

impl Separation {
    /// Spheres of these radii about `path` at the states `0 … N`.
    pub(super) fn new(h: f64, path: &Path, radii: &[f64]) -> Result<Self, ParameterError> {
        let ends = path.ends.iter().zip(radii);
        let spheres = ends.map(|(center, radius)| KeepOutSphere::new(*center, *radius));
        Ok(Self {
            h,
            spheres: spheres.collect::<Result<_, _>>()?,
        })
    }
}

impl StateConstraint for Separation {
    fn name(&self) -> &'static str {
        "separation"
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::Position
    }

    fn value(&self, state: &BodyState) -> f64 {
        self.spheres[0].value(state)
    }

    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        self.spheres[0].derivatives(state)
    }

    fn size(&self) -> f64 {
        self.spheres[0].size()
    }

    fn excess(&self, g: f64) -> f64 {
        self.spheres[0].excess(g)
    }

    fn at(&self, time: f64) -> Option<Arc<dyn StateConstraint>> {
        let last = self.spheres.len() - 1;
        let end = (time / self.h).round().clamp(0.0, last as f64);
        Some(Arc::new(self.spheres[end as usize]))
    }
}
