//! Inequalities on commands and states, as smooth functions `g ≤ 0` with two derivatives.
//!
//! Each is scaled to have no dimension: a limit is exceeded by `g` of itself, a sphere is entered by `g` of its radius, a
//! cone by `g` rad, a corridor left by `g` of its length, all to first order.
//!
//! Other inequalities implement [`StateConstraint`] or [`CommandConstraint`]. Each object is one inequality; several at
//! once are several constraints.

mod command;
mod cone;
mod corridor;
mod limits;
mod set;
mod sphere;

#[cfg(test)]
mod tests;

use std::any::Any;
use std::fmt::Debug;
use std::ops::RangeInclusive;
use std::sync::Arc;

use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, Vector3};

use crate::problem::{Actuation, Comparable};

pub use command::CommandInequality;
pub use cone::KeepOutCone;
pub use corridor::Corridor;
pub use limits::{CommandLimit, ComponentLimit, NormLimit};
pub(crate) use set::{InequalitySet, StateInequality};
pub use sphere::KeepOutSphere;

/// An inequality, imposed on each control interval or on the state at the end of each step.
///
/// # Assumptions and limitations
///
/// States are held to it at the ends of steps, not between them. Where start and target decide a state (the end of the
/// first Lie–Euler step, the last state of a transfer to one state), nothing is left to plan, and the inequality is only
/// checked there.
#[derive(Clone, Debug)]
pub enum Constraint {
    /// On the commands of each interval.
    Commands(Arc<dyn CommandConstraint>),
    /// On the state at the end of each step.
    State(Arc<dyn StateConstraint>),
}

/// One of the two coordinates of a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// `x`, with derivatives by δx.
    Position,
    /// `R`, with derivatives by ζ.
    Attitude,
}

/// An inequality `g(s) ≤ 0` on position or attitude, in the units of the transfer.
pub trait StateConstraint: Comparable + Debug + Send + Sync {
    /// The kind of constraint, as scenes and messages name it.
    fn name(&self) -> &'static str;

    /// The coordinate that `g` depends on.
    fn place(&self) -> Place;

    /// The part of the transfer's time in which it applies, from 0 at the start to 1 at the end.
    fn applies(&self) -> RangeInclusive<f64> {
        0.0..=1.0
    }

    /// `g`, without dimension.
    fn value(&self, state: &BodyState) -> f64;

    /// Gradient and symmetric Hessian of `g` by δx, where `x` moves to `x + δx`, or by ζ, where `R` moves to
    /// `R exp S(ζ)`.
    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>);

    /// The displacement (rad of the attitude) that changes `g` by 1, to first order at the boundary.
    fn size(&self) -> f64;

    /// A factor of `g` near `state` that keeps its meaning there.
    fn scale(&self, _state: &BodyState) -> f64 {
        1.0
    }

    /// The violation that is reported where `g` has this value.
    fn excess(&self, g: f64) -> f64 {
        g
    }

    /// The constraint of a transfer from a position to another, if that is one point; `None` where it is the same for all.
    fn between(
        &self,
        _start: &Vector3<f64>,
        _end: Option<&Vector3<f64>>,
    ) -> Option<Arc<dyn StateConstraint>> {
        None
    }
}

/// Inequalities on the commands of an interval.
pub trait CommandConstraint: Comparable + Debug + Send + Sync {
    /// The kind of constraint, as scenes and messages name it.
    fn name(&self) -> &'static str;

    /// The inequalities that it makes of the commands of an actuation, in the units of the transfer.
    fn inequalities(&self, actuation: &Actuation) -> Vec<CommandInequality>;

    /// The coordinate whose motion it limits; `None` where it limits both.
    fn place(&self) -> Option<Place> {
        None
    }
}

impl Constraint {
    /// A constraint on states.
    pub fn state(constraint: impl StateConstraint) -> Self {
        Self::State(Arc::new(constraint))
    }

    /// A constraint on commands.
    pub fn commands(constraint: impl CommandConstraint) -> Self {
        Self::Commands(Arc::new(constraint))
    }

    /// The kind of constraint, as scenes and messages name it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Commands(constraint) => constraint.name(),
            Self::State(constraint) => constraint.name(),
        }
    }

    /// The coordinate whose motion it limits; `None` where it limits both.
    pub fn place(&self) -> Option<Place> {
        match self {
            Self::Commands(constraint) => constraint.place(),
            Self::State(constraint) => Some(constraint.place()),
        }
    }

    /// The constraint as one of type `T`, if it is.
    pub fn downcast_ref<T: 'static>(&self) -> Option<&T> {
        self.any().downcast_ref()
    }

    fn any(&self) -> &dyn Any {
        match self {
            Self::Commands(constraint) => &**constraint,
            Self::State(constraint) => &**constraint,
        }
    }
}

impl PartialEq for Constraint {
    fn eq(&self, other: &Self) -> bool {
        match self {
            Self::Commands(constraint) => constraint.equals(other.any()),
            Self::State(constraint) => constraint.equals(other.any()),
        }
    }
}
