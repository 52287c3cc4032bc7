use std::any::Any;
use std::sync::Arc;

use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, Vector3};

use super::{BySecond, Coordinates, FrameMotion, FramePose, Region, StateConstraint};
use crate::problem::ParameterError;

/// A constraint relative to a frame that moves in a known way. One on the pose is `g(R_fᵀ (x − x_f), R_fᵀ R)`: the motion of the
/// frame is data, so that derivatives are those of `g`, turned. One that depends on how the frame moves says itself what it is
/// there ([`StateConstraint::relative_to`]).
///
/// # Assumptions and limitations
/// The frame's motion is known at the ends of equal intervals. Between them it is cubics through the four nearest. The
/// derivative of the cost by the final time does not know that the frame moves: a transfer under this constraint has a fixed
/// final time.
#[derive(Clone, Debug)]
pub struct Moving {
    constraint: Arc<dyn StateConstraint>,
    motions: Arc<[FrameMotion]>,
    interval: f64,
    /// Time from the first of them to the start of the transfer.
    start: f64,
}

/// Part of an interval within which a time is that of a known pose.
const ROUNDING: f64 = 1e-6;

impl Moving {
    /// `constraint` in the frame that moves like this, from the start to the end of the transfer, `interval` > 0 apart in time.
    /// For a constraint on the pose, a [`FramePose`] is enough.
    ///
    /// # Errors
    /// Returns an error if there is no motion, if one is not finite, or if `interval` is not a positive number.
    pub fn new(
        constraint: impl StateConstraint,
        motions: impl IntoIterator<Item = impl Into<FrameMotion>>,
        interval: f64,
    ) -> Result<Self, ParameterError> {
        let motions: Arc<[FrameMotion]> = motions.into_iter().map(Into::into).collect();
        let first = match motions.first() {
            Some(first) if motions.iter().all(FrameMotion::is_finite) => first,
            _ => {
                let expected = "one or more finite poses";
                return Err(ParameterError::new("poses", motions.len(), expected));
            }
        };
        if !(interval.is_finite() && interval > 0.0) {
            return Err(ParameterError::new("interval", interval, "a number > 0"));
        }
        Ok(Self {
            constraint: match constraint.relative_to(first) {
                Some(relative) => relative,
                None => Arc::new(constraint),
            },
            motions,
            interval,
            start: 0.0,
        })
    }

    /// The constraint of a transfer that starts `time` later.
    pub fn later(&self, time: f64) -> Self {
        Self {
            start: self.start + time,
            ..self.clone()
        }
    }

    /// The constraint in its frame.
    pub fn constraint(&self) -> &dyn StateConstraint {
        &*self.constraint
    }

    /// The pose at a time after the start; before the first and after the last, it is that one.
    pub fn pose(&self, time: f64) -> FramePose {
        self.motion(time).pose
    }

    /// The motion at a time after the start; before the first and after the last, it is that one.
    pub fn motion(&self, time: f64) -> FrameMotion {
        let last = self.motions.len() - 1;
        let at = ((self.start + time) / self.interval).clamp(0.0, last as f64);
        let before = at.floor();
        let (index, part) = (before as usize, at - before);
        if part <= ROUNDING {
            return self.motions[index];
        }
        if part >= 1.0 - ROUNDING {
            return self.motions[(index + 1).min(last)];
        }
        FrameMotion::between(&self.motions, index, part)
    }

    fn placed(&self, time: f64) -> Arc<dyn StateConstraint> {
        let motion = self.motion(time);
        self.constraint.relative_to(&motion).unwrap_or_else(|| {
            Arc::new(Placed {
                constraint: self.constraint.clone(),
                pose: motion.pose,
            })
        })
    }
}

fn same(one: &Arc<dyn StateConstraint>, other: &Arc<dyn StateConstraint>) -> bool {
    let other: &dyn Any = &**other;
    one.equals(other)
}

impl PartialEq for Moving {
    fn eq(&self, other: &Self) -> bool {
        same(&self.constraint, &other.constraint)
            && self.motions == other.motions
            && self.interval == other.interval
            && self.start == other.start
    }
}

impl StateConstraint for Moving {
    fn name(&self) -> &'static str {
        self.constraint.name()
    }

    fn region(&self) -> Option<Region> {
        self.constraint.region()
    }

    fn coordinates(&self) -> Coordinates {
        self.constraint.coordinates()
    }

    /// `g` at the start.
    fn value(&self, state: &BodyState) -> f64 {
        self.placed(0.0).value(state)
    }

    /// Those of `g` at the start.
    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        self.placed(0.0).derivatives(state)
    }

    /// Those of `g` at the start.
    fn by_second(&self, state: &BodyState) -> Option<BySecond> {
        self.placed(0.0).by_second(state)
    }

    fn size(&self) -> f64 {
        self.constraint.size()
    }

    fn excess(&self, g: f64) -> f64 {
        self.constraint.excess(g)
    }

    fn between(
        &self,
        start: &Vector3<f64>,
        end: Option<&Vector3<f64>>,
    ) -> Option<Arc<dyn StateConstraint>> {
        let last = self.motions[self.motions.len() - 1].pose;
        let start = self.pose(0.0).seen(start);
        let end = end.map(|end| last.seen(end));
        let constraint = self.constraint.between(&start, end.as_ref())?;
        Some(Arc::new(Self {
            constraint,
            ..self.clone()
        }))
    }

    fn at(&self, time: f64) -> Option<Arc<dyn StateConstraint>> {
        Some(self.placed(time))
    }
}

/// A constraint in a frame.
#[derive(Clone, Debug)]
struct Placed {
    constraint: Arc<dyn StateConstraint>,
    pose: FramePose,
}

impl Placed {
    /// The state as it is seen from the frame; momenta do not matter.
    fn seen(&self, state: &BodyState) -> BodyState {
        BodyState {
            position: self.pose.seen(&state.position),
            attitude: self.pose.rotation.tr_mul(&state.attitude),
            ..*state
        }
    }
}

impl PartialEq for Placed {
    fn eq(&self, other: &Self) -> bool {
        same(&self.constraint, &other.constraint) && self.pose == other.pose
    }
}

impl StateConstraint for Placed {
    fn name(&self) -> &'static str {
        self.constraint.name()
    }

    fn coordinates(&self) -> Coordinates {
        self.constraint.coordinates()
    }

    fn value(&self, state: &BodyState) -> f64 {
        self.constraint.value(&self.seen(state))
    }

    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        let (gradient, hessian) = self.constraint.derivatives(&self.seen(state));
        match self.coordinates() {
            Coordinates::Position | Coordinates::Pose | Coordinates::Translation => {
                let turn = self.pose.rotation;
                (turn * gradient, turn * hessian * turn.transpose())
            }
            // ζ is a rotation in the body frame, whatever frame the attitude is seen from. Momenta are not seen from it.
            _ => (gradient, hessian),
        }
    }

    fn by_second(&self, state: &BodyState) -> Option<BySecond> {
        let seen = self.constraint.by_second(&self.seen(state))?;
        Some(BySecond {
            mixed: self.pose.rotation * seen.mixed,
            ..seen
        })
    }

    fn size(&self) -> f64 {
        self.constraint.size()
    }

    fn scale(&self, state: &BodyState) -> f64 {
        self.constraint.scale(&self.seen(state))
    }

    fn excess(&self, g: f64) -> f64 {
        self.constraint.excess(g)
    }
}
