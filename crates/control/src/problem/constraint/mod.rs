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
mod coordinates;
mod corridor;
mod ellipsoid;
mod frame;
mod keep_in;
mod limits;
mod line_of_sight;
mod moving;
mod plume;
mod rate;
mod region;
mod set;
mod sight;
mod speed;
mod sphere;
mod wheel_speed;
mod window;

#[cfg(test)]
mod tests;

use std::any::Any;
use std::fmt::Debug;
use std::ops::{Range, RangeInclusive};
use std::sync::Arc;

use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, Vector3};

use crate::problem::parameter::length;
use crate::problem::{Actuation, Comparable, ParameterError};

pub use command::CommandInequality;
pub use cone::KeepOutCone;
pub use coordinates::Coordinates;
pub use corridor::Corridor;
pub use ellipsoid::KeepOutEllipsoid;
pub use frame::{FrameMotion, FramePose};
pub(crate) use frame::{cubic, resampled};
pub use keep_in::KeepInSphere;
pub use limits::{CommandLimit, ComponentLimit, NormLimit};
pub use line_of_sight::LineOfSight;
pub use moving::Moving;
pub use plume::Plume;
pub use rate::AngularRate;
pub use region::Region;
pub(in crate::problem) use set::command_limits;
pub(crate) use set::{InequalitySet, PositionCost, StateInequality};
pub use speed::Speed;
pub use sphere::KeepOutSphere;
pub(crate) use wheel_speed::WheelSpeed;
pub use window::During;
pub(crate) use window::Window;

/// An inequality on the commands of each interval or on the states of a plan.
///
/// # Assumptions and limitations
///
/// State inequalities hold at the ends of steps and between them, along the cubics that steps of the LGVI stand for and along
/// the free motion of Lie–Euler steps; momenta are linear between the ends. Some states are fixed by start and target: the
/// end of the first Lie–Euler step, and the last state of a transfer to a single state. There the inequality is only checked.
#[derive(Clone, Debug)]
pub enum Constraint {
    /// An inequality on the commands of each interval.
    Commands(Arc<dyn CommandConstraint>),
    /// An inequality on the states.
    State(Arc<dyn StateConstraint>),
    /// A constraint whose violation has a price instead of being forbidden, see [`Constraint::priced`].
    Priced(Box<Priced>),
    /// A constraint that holds in some steps only, see [`Constraint::during`].
    During(Box<During>),
}

/// A constraint and the price of its violation.
#[derive(Clone, Debug, PartialEq)]
pub struct Priced {
    constraint: Constraint,
    price: f64,
}

/// A coordinate of a pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// `x`, with derivatives by δx.
    Position,
    /// `R`, with derivatives by ζ.
    Attitude,
}

/// An inequality `g(s) ≤ 0` on some coordinates of a state, in the units of the transfer.
pub trait StateConstraint: Comparable + Debug + Send + Sync {
    /// The kind of constraint, as it is named in scenes and messages.
    fn name(&self) -> &'static str;

    /// The coordinates that `g` depends on.
    fn coordinates(&self) -> Coordinates;

    /// The part of the transfer's duration in which it applies, from 0 at the start to 1 at the end.
    fn applies(&self) -> RangeInclusive<f64> {
        0.0..=1.0
    }

    /// The states that it allows, for those who draw it.
    fn region(&self) -> Option<Region> {
        None
    }

    /// The dimensionless `g`.
    fn value(&self, state: &BodyState) -> f64;

    /// The gradient and the symmetric Hessian of `g` by its coordinates, of two groups of them by the first. `x` moves to `x + δx`, `R` to
    /// `R exp S(ζ)`, and momenta as `x` does.
    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>);

    /// The derivatives that involve the second group of coordinates, if there is one: the attitude of a pose, the momentum of a
    /// translation.
    fn by_second(&self, _state: &BodyState) -> Option<BySecond> {
        None
    }

    /// The displacement (rad of the attitude, also of a pose; of a translation, that of the momentum) that changes `g` by 1, to first order at the boundary.
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

    /// The constraint relative to a frame, if it depends on how the frame moves. Otherwise it is evaluated at the pose as it is seen
    /// from there.
    fn relative_to(&self, _frame: &FrameMotion) -> Option<Arc<dyn StateConstraint>> {
        None
    }

    /// The constraint as it is at a time after the start of the transfer. Returns `None` if it does not change with time.
    fn at(&self, _time: f64) -> Option<Arc<dyn StateConstraint>> {
        None
    }
}

/// The derivatives of an inequality on two groups of coordinates that involve the second, ζ or δγ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BySecond {
    /// The gradient by it.
    pub gradient: Vector3<f64>,
    /// The symmetric Hessian by it.
    pub hessian: Matrix3<f64>,
    /// The second derivatives by δx (rows) and by it (columns).
    pub mixed: Matrix3<f64>,
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

    /// The constraint, soft: a violation is not forbidden but costs `price`, a positive number, times `g` per unit of time: the
    /// sum of `h · price · g` over the violated intervals or ends of steps. Between the ends of steps it is not checked.
    ///
    /// The cost of a plan is that of its commands alone; [`Plan::paid`](crate::Plan::paid) is what its violations cost, and
    /// [`Certificate::priced`](crate::Certificate::priced) the largest of them.
    pub fn priced(self, price: f64) -> Result<Self, ParameterError> {
        let price = length("price", price)?;
        let constraint = match self {
            Self::Priced(priced) => priced.constraint,
            constraint => constraint,
        };
        Ok(Self::Priced(Box::new(Priced { constraint, price })))
    }

    /// The price of a violation per unit of time, or `None` if it is forbidden.
    pub fn price(&self) -> Option<f64> {
        match self {
            Self::Priced(priced) => Some(priced.price),
            _ => None,
        }
    }

    /// The constraint, with its price, of a transfer that starts `steps` steps of length `h` later: one that moves has moved, and
    /// its own steps are as many less. Returns `None` if they are over.
    pub fn later(&self, steps: usize, h: f64) -> Option<Self> {
        match self {
            Self::Commands(_) => Some(self.clone()),
            Self::State(constraint) => {
                let any: &dyn Any = &**constraint;
                Some(match any.downcast_ref::<Moving>() {
                    Some(moving) => Self::state(moving.later(h * steps as f64)),
                    None => self.clone(),
                })
            }
            Self::Priced(priced) => Some(Self::Priced(Box::new(Priced {
                constraint: priced.constraint.later(steps, h)?,
                price: priced.price,
            }))),
            Self::During(during) => {
                let Range { start, end } = during.steps;
                let rest = start.saturating_sub(steps)..end.saturating_sub(steps);
                let constraint = during.constraint.later(steps, h)?;
                (!rest.is_empty()).then(|| {
                    Self::During(Box::new(During {
                        constraint,
                        steps: rest,
                    }))
                })
            }
        }
    }

    /// The constraint itself, without its price and its steps.
    pub fn bare(&self) -> &Self {
        match self {
            Self::Priced(priced) => priced.constraint.bare(),
            Self::During(during) => during.constraint.bare(),
            constraint => constraint,
        }
    }

    /// The kind of constraint, as it is named in scenes and messages.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Priced(priced) => priced.constraint.name(),
            Self::During(during) => during.constraint.name(),
            Self::Commands(constraint) => constraint.name(),
            Self::State(constraint) => constraint.name(),
        }
    }

    /// Returns true if it limits commands, not states.
    pub fn is_on_commands(&self) -> bool {
        matches!(self.bare(), Self::Commands(_))
    }

    /// The coordinate whose motion it limits, or `None` if it limits both.
    pub fn place(&self) -> Option<Place> {
        match self {
            Self::Commands(constraint) => constraint.place(),
            Self::State(constraint) => constraint.coordinates().place(),
            Self::Priced(priced) => priced.constraint.place(),
            Self::During(during) => during.constraint.place(),
        }
    }

    /// The constraint as a `T`, if it is one.
    pub fn downcast_ref<T: 'static>(&self) -> Option<&T> {
        self.any().downcast_ref()
    }

    /// The states that it allows, in the frame that it is defined in, if it says so.
    pub fn region(&self) -> Option<Region> {
        match self.bare() {
            Self::State(constraint) => constraint.region(),
            _ => None,
        }
    }

    /// The states that it allows at a time after the start of the transfer, in the inertial frame; after its end, those at the end.
    pub fn region_at(&self, time: f64) -> Option<Region> {
        let region = self.region()?;
        let moving = self.downcast_ref::<Moving>();
        Some(moving.map_or(region, |moving| region.placed(&moving.motion(time))))
    }

    fn any(&self) -> &dyn Any {
        match self {
            Self::Commands(constraint) => &**constraint,
            Self::State(constraint) => &**constraint,
            Self::Priced(priced) => priced.constraint.any(),
            Self::During(during) => during.constraint.any(),
        }
    }
}

impl PartialEq for Constraint {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Priced(one), Self::Priced(other)) => one == other,
            (Self::During(one), Self::During(other)) => one == other,
            (Self::Priced(_) | Self::During(_), _) | (_, Self::Priced(_) | Self::During(_)) => {
                false
            }
            (Self::Commands(constraint), _) => constraint.equals(other.any()),
            (Self::State(constraint), _) => constraint.equals(other.any()),
        }
    }
}
