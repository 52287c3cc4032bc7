//! Inequalities on commands and states, as smooth functions `g ≤ 0` with two derivatives.
//!
//! Each `g` is dimensionless. To first order it is the excess over a limit relative to that limit, the depth inside a
//! sphere relative to its radius, the angle inside a cone (rad), or the distance outside a corridor relative to its
//! length.
//!
//! Further inequalities implement [`StateConstraint`] or [`CommandConstraint`]. Each [`StateConstraint`] is one
//! inequality; several inequalities at once are several constraints.

mod command;
mod cone;
mod corridor;
mod frame;
mod limits;
mod moving;
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
pub use frame::FramePose;
pub(crate) use frame::cubic;
pub use moving::{InFrame, Moving};
pub(crate) use set::{InequalitySet, StateInequality};
pub use sphere::KeepOutSphere;

/// An inequality on the commands of each interval or on the state at the end of each step.
///
/// # Assumptions and limitations
///
/// State inequalities hold at the ends of steps, not between them. Some states are fixed by start and target: the end
/// of the first Lie–Euler step, and the last state of a transfer to a single state. There the inequality is only
/// checked.
#[derive(Clone, Debug)]
pub enum Constraint {
    /// An inequality on the commands of each interval.
    Commands(Arc<dyn CommandConstraint>),
    /// An inequality on the state at the end of each step.
    State(Arc<dyn StateConstraint>),
}

/// A coordinate of a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// `x`, with derivatives by δx.
    Position,
    /// `R`, with derivatives by ζ.
    Attitude,
}

/// An inequality `g(s) ≤ 0` on position or attitude, in the units of the transfer.
pub trait StateConstraint: Comparable + Debug + Send + Sync {
    /// The kind of constraint, as it is named in scenes and messages.
    fn name(&self) -> &'static str;

    /// The coordinate that `g` depends on.
    fn place(&self) -> Place;

    /// The part of the transfer's duration in which it applies, from 0 at the start to 1 at the end.
    fn applies(&self) -> RangeInclusive<f64> {
        0.0..=1.0
    }

    /// The dimensionless `g`.
    fn value(&self, state: &BodyState) -> f64;

    /// The gradient and the symmetric Hessian of `g` by δx, where `x` moves to `x + δx`, or by ζ, where `R` moves to `R
    /// exp S(ζ)`.
    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>);

    /// The displacement (rad of the attitude) that changes `g` by 1, to first order at the boundary.
    fn size(&self) -> f64;

    /// A factor of `g` that keeps the scale of `g` meaningful near `state`.
    fn scale(&self, _state: &BodyState) -> f64 {
        1.0
    }

    /// The violation that is reported when `g` has this value.
    fn excess(&self, g: f64) -> f64 {
        g
    }

    /// The constraint adapted to a transfer from `start` to `end`, where `end` is `None` if the final position is not
    /// fixed. Returns `None` if the constraint is the same for all transfers.
    fn between(
        &self,
        _start: &Vector3<f64>,
        _end: Option<&Vector3<f64>>,
    ) -> Option<Arc<dyn StateConstraint>> {
        None
    }

    /// The constraint as it is at a time after the start of the transfer. Returns `None` if it does not change with time.
    fn at(&self, _time: f64) -> Option<Arc<dyn StateConstraint>> {
        None
    }
}

/// Inequalities on the commands of an interval.
pub trait CommandConstraint: Comparable + Debug + Send + Sync {
    /// The kind of constraint, as it is named in scenes and messages.
    fn name(&self) -> &'static str;

    /// The inequalities on the commands of an actuation, in the units of the transfer.
    fn inequalities(&self, actuation: &Actuation) -> Vec<CommandInequality>;

    /// The coordinate whose motion it limits, or `None` if it limits both.
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

    /// The kind of constraint, as it is named in scenes and messages.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Commands(constraint) => constraint.name(),
            Self::State(constraint) => constraint.name(),
        }
    }

    /// The coordinate whose motion it limits, or `None` if it limits both.
    pub fn place(&self) -> Option<Place> {
        match self {
            Self::Commands(constraint) => constraint.place(),
            Self::State(constraint) => Some(constraint.place()),
        }
    }

    /// The constraint as a `T`, if it is one.
    pub fn downcast_ref<T: 'static>(&self) -> Option<&T> {
        self.any().downcast_ref()
    }

    /// The constraint as a `T` in the frame that it is defined in, if it is one.
    pub fn in_frame<T: 'static>(&self) -> Option<InFrame<'_, T>> {
        let moving = self.downcast_ref::<Moving>();
        let constraint = match moving {
            Some(moving) => (moving.constraint() as &dyn Any).downcast_ref(),
            None => self.downcast_ref(),
        };
        constraint.map(|constraint| InFrame { constraint, moving })
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
