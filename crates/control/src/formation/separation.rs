//! The distance between two bodies, along the motions that their steps stand for.

use std::sync::Arc;

use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, Vector3};

use crate::constraint::{Coordinates, KeepOutSphere, StateConstraint};
use crate::discrete::Within;
use crate::problem::ParameterError;
use crate::solver::highest;
use crate::{Plan, Transfer};

/// The part of a step within which a time is that of its end.
const ROUNDING: f64 = 1e-6;

/// The positions of a body along its plan.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Path {
    h: f64,
    pub(super) ends: Arc<[Vector3<f64>]>,
    within: Arc<[Within]>,
}

impl Path {
    pub(super) fn of(transfer: &Transfer, plan: &Plan) -> Self {
        Self {
            h: plan.h,
            ends: plan.states.iter().map(|state| state.position).collect(),
            within: Within::all(transfer, &plan.states).into(),
        }
    }

    fn at(&self, time: f64) -> Vector3<f64> {
        let last = self.within.len();
        let at = (time / self.h).clamp(0.0, last as f64);
        let (nearest, before) = (at.round(), at.floor());
        if (at - nearest).abs() <= ROUNDING {
            return self.ends[nearest as usize];
        }
        self.within[before as usize].at(at - before).position
    }
}

/// The nearest approach of two bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Approach {
    pub(super) distance: f64,
    /// The step in which it is.
    pub(super) step: usize,
}

impl Approach {
    pub(super) fn of([one, other]: [&Path; 2]) -> Self {
        let steps = one.within.iter().zip(&*other.within).enumerate();
        let nearest = steps.map(|(step, (one, other))| {
            let squared = |part| (one.at(part).position - other.at(part).position).norm_squared();
            // Relative to the start of the step, which does not count as 0 for `highest`.
            let from = squared(0.0);
            let rise = highest([0.0, 1.0], |part| from - squared(part));
            let distance = (from - rise).max(0.0).sqrt();
            Self { distance, step }
        });
        let none = Self {
            distance: f64::INFINITY,
            step: 0,
        };
        nearest.fold(none, |least, now| match now.distance < least.distance {
            true => now,
            false => least,
        })
    }
}

/// A sphere about another body that a body stays out of.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Separation {
    path: Path,
    radius: f64,
    /// The sphere at the start.
    first: KeepOutSphere,
}

impl Separation {
    pub(super) fn new(path: &Path, radius: f64) -> Result<Self, ParameterError> {
        Ok(Self {
            path: path.clone(),
            radius,
            first: KeepOutSphere::new(path.ends[0], radius)?,
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
        self.first.value(state)
    }

    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        self.first.derivatives(state)
    }

    fn size(&self) -> f64 {
        self.radius
    }

    fn excess(&self, g: f64) -> f64 {
        self.first.excess(g)
    }

    fn at(&self, time: f64) -> Option<Arc<dyn StateConstraint>> {
        let sphere = KeepOutSphere::new(self.path.at(time), self.radius).ok()?;
        Some(Arc::new(sphere))
    }
}
