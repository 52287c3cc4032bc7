//! Sets of states in which a transfer may end, as conditions `c = 0` with two derivatives.
//!
//! Further conditions implement [`TerminalCondition`].

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

/// Conditions on position and linear momentum, or on attitude and angular momentum, at the end of a transfer, in the
/// units of the transfer.
pub trait TerminalCondition: Comparable + Debug + Send + Sync {
    /// The name of the condition in messages, such as "a spin axis".
    fn name(&self) -> &'static str;

    /// The coordinate that is restricted, together with its momentum.
    fn place(&self) -> Place;

    /// The quantity of each row of the residual. Conditions with three rows of [`Row::Pose`] must fix a single pose.
    fn rows(&self) -> [Row; 6];

    /// `c`, which is zero in the set; rows without a condition are zero in `c` and in its derivatives.
    fn residual(&self, end: &BodyState) -> SVector<f64, 6>;

    /// First derivatives of `c` by `[δx, δγ]`, where `x` moves to `x + δx`, or by `[ζ, δΠ]`, where `R` moves to `R exp
    /// S(ζ)`.
    fn jacobian(&self, end: &BodyState) -> SMatrix<f64, 6, 6>;

    /// The symmetric second derivatives of `ν · c` by the same variations.
    fn curvature(&self, end: &BodyState, nu: &SVector<f64, 6>) -> SMatrix<f64, 6, 6>;

    /// Moves pose and momentum of `state` into the set, for an initial guess. Returns `false` for each of the two that
    /// is left unchanged.
    fn aim(&self, _state: &mut BodyState) -> [bool; 2] {
        [false; 2]
    }

    /// The amount by which `end` misses the set, in the units of pose and momentum.
    fn miss(&self, end: &BodyState) -> SVector<f64, 6> {
        self.residual(end)
    }
}

impl dyn TerminalCondition {
    /// The condition as a `T`, if it is one.
    pub fn downcast_ref<T: 'static>(&self) -> Option<&T> {
        (self as &dyn Any).downcast_ref()
    }
}

/// The quantity of a row of a terminal condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Row {
    /// No condition.
    None,
    /// A dimensionless number or an angle.
    Number,
    /// A quantity in the units of the pose: a length, or radians.
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

    /// Adds a condition, which replaces any other condition on the same half.
    pub fn with(mut self, condition: impl TerminalCondition) -> Self {
        let half = half(condition.place());
        self.conditions[half] = Some(Arc::new(condition));
        self
    }

    /// Removes the condition on a half.
    pub fn without(mut self, place: Place) -> Self {
        self.conditions[half(place)] = None;
        self
    }

    /// The condition on position and linear momentum, or on attitude and angular momentum.
    pub fn condition(&self, place: Place) -> Option<&dyn TerminalCondition> {
        self.conditions[half(place)].as_deref()
    }

    /// The only state of the set, or `None` if the set has several.
    pub fn state(&self) -> Option<BodyState> {
        TerminalSet::from(self).state()
    }

    /// The amount by which `end` misses the set: `[x, γ, R, Π]`, zero where there is no condition.
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
