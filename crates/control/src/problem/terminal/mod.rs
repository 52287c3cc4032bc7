//! Sets of states in which a transfer may end, as conditions `c = 0` with two derivatives.
//!
//! Other conditions implement [`TerminalCondition`].

mod attitude;
mod direction;
mod orbit;
mod position;
mod set;
mod spin_axis;

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;

use lgvi_dynamics::BodyState;
use nalgebra::{SMatrix, SVector};

pub use attitude::FinalAttitude;
pub use orbit::KeplerOrbit;
pub use position::FinalPosition;
pub(crate) use set::{HalfSet, TerminalSet};
pub use spin_axis::SpinAxis;

use super::{Comparable, ParameterError, Place};

/// Conditions on position and linear momentum, or on attitude and angular momentum, at the end of a transfer, in its
/// units.
pub trait TerminalCondition: Comparable + Debug + Send + Sync {
    /// What the condition asks for, such as "a spin axis", for messages.
    fn name(&self) -> &'static str;

    /// The coordinate that, with its momentum, it is a condition on.
    fn place(&self) -> Place;

    /// The quantity of each row of the residual. Conditions of which three are a [`Row::Pose`] leave one pose only.
    fn rows(&self) -> [Row; 6];

    /// `c`, which is zero in the set; rows without a condition are zero, here and in the derivatives.
    fn residual(&self, end: &BodyState) -> SVector<f64, 6>;

    /// First derivatives of `c` by `[δx, δγ]`, where `x` moves to `x + δx`, or by `[ζ, δΠ]`, where `R` moves to
    /// `R exp S(ζ)`.
    fn jacobian(&self, end: &BodyState) -> SMatrix<f64, 6, 6>;

    /// Second derivatives of `ν · c` by the same, symmetric.
    fn curvature(&self, end: &BodyState, nu: &SVector<f64, 6>) -> SMatrix<f64, 6, 6>;

    /// Moves pose and momentum of `state` into the set, for a first guess; `false` for each of them that is left as it is.
    fn aim(&self, _state: &mut BodyState) -> [bool; 2] {
        [false; 2]
    }

    /// By how much `end` misses the set, in the units of pose and momentum.
    fn miss(&self, end: &BodyState) -> SVector<f64, 6> {
        self.residual(end)
    }
}

impl dyn TerminalCondition {
    /// The condition as one of type `T`, if it is.
    pub fn downcast_ref<T: 'static>(&self) -> Option<&T> {
        (self as &dyn Any).downcast_ref()
    }
}

/// The quantity of a row of terminal conditions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Row {
    /// No condition.
    None,
    /// A number without dimension, or an angle.
    Number,
    /// Measured as the pose is: a length, or radians.
    Pose,
    /// A linear or angular momentum.
    Momentum,
}

/// The set of states in which a transfer may end.
#[derive(Clone, Debug)]
pub struct Terminal {
    conditions: [Option<Arc<dyn TerminalCondition>>; 2],
}

impl Terminal {
    /// All states.
    pub const FREE: Self = Self {
        conditions: [None, None],
    };

    /// The states that meet the condition too, in the place of any other on the same half.
    pub fn with(mut self, condition: impl TerminalCondition) -> Self {
        let half = half(condition.place());
        self.conditions[half] = Some(Arc::new(condition));
        self
    }

    /// The set without conditions on a half.
    pub fn without(mut self, place: Place) -> Self {
        self.conditions[half(place)] = None;
        self
    }

    /// The condition on position and linear momentum, or on attitude and angular momentum.
    pub fn condition(&self, place: Place) -> Option<&dyn TerminalCondition> {
        self.conditions[half(place)].as_deref()
    }

    /// The only state of the set; `None` where there are more.
    pub fn state(&self) -> Option<BodyState> {
        TerminalSet::from(self).state()
    }

    /// By how much `end` misses the set: `[x, γ, R, Π]`, where what is free is not missed.
    pub fn miss(&self, end: &BodyState) -> SVector<f64, 12> {
        let mut miss = SVector::<f64, 12>::zeros();
        for (half, condition) in self.conditions.iter().enumerate() {
            if let Some(condition) = condition {
                miss.fixed_rows_mut::<6>(6 * half)
                    .copy_from(&condition.miss(end));
            }
        }
        miss
    }
}

impl PartialEq for Terminal {
    fn eq(&self, other: &Self) -> bool {
        let mut halves = self.conditions.iter().zip(&other.conditions);
        halves.all(|halves| match halves {
            (Some(a), Some(b)) => a.equals(&**b),
            (a, b) => a.is_none() && b.is_none(),
        })
    }
}

impl TryFrom<BodyState> for Terminal {
    type Error = ParameterError;

    fn try_from(state: BodyState) -> Result<Self, ParameterError> {
        let position = FinalPosition::new(state.position, Some(state.linear_momentum))?;
        let attitude = FinalAttitude::new(state.attitude, Some(state.angular_momentum))?;
        Ok(Self::FREE.with(position).with(attitude))
    }
}

fn half(place: Place) -> usize {
    match place {
        Place::Position => 0,
        Place::Attitude => 1,
    }
}
