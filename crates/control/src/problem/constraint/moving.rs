use std::any::Any;
use std::sync::Arc;

use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, Vector3};

use super::{ByAttitude, Coordinates, FramePose, Region, StateConstraint};
use crate::problem::ParameterError;

/// A constraint on the pose relative to a frame that moves in a known way: `g(R_fᵀ (x − x_f), R_fᵀ R)`. The motion of the
/// frame is data, so that derivatives are those of `g`, turned.
///
/// # Assumptions and limitations
/// The frame's poses are known at the ends of equal intervals. Between them they are cubics through the four nearest. The
/// derivative of the cost by the final time does not know that the frame moves: a transfer under this constraint has a fixed
/// final time.
#[derive(Clone, Debug)]
pub struct Moving {
    constraint: Arc<dyn StateConstraint>,
    poses: Arc<[FramePose]>,
    interval: f64,
    /// Time from the first pose to the start of the transfer.
    start: f64,
}

/// Part of an interval within which a time is that of a known pose.
const ROUNDING: f64 = 1e-6;

impl Moving {
    /// `constraint` in the frame with these poses, from the start to the end of the transfer, `interval` > 0 apart in time.
    ///
    /// # Errors
    /// Returns an error if there is no pose, if a pose is not finite, or if `interval` is not a positive number.
    pub fn new(
        constraint: impl StateConstraint,
        poses: impl Into<Arc<[FramePose]>>,
        interval: f64,
    ) -> Result<Self, ParameterError> {
        let poses = poses.into();
        let finite = |pose: &FramePose| (pose.origin.sum() + pose.rotation.sum()).is_finite();
        if poses.is_empty() || !poses.iter().all(finite) {
            let expected = "one or more finite poses";
            return Err(ParameterError::new("poses", poses.len(), expected));
        }
        if !(interval.is_finite() && interval > 0.0) {
            return Err(ParameterError::new("interval", interval, "a number > 0"));
        }
        Ok(Self {
            constraint: Arc::new(constraint),
            poses,
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
        let last = self.poses.len() - 1;
        let at = ((self.start + time) / self.interval).clamp(0.0, last as f64);
        let before = at.floor();
        let (index, part) = (before as usize, at - before);
        if part <= ROUNDING {
            return self.poses[index];
        }
        if part >= 1.0 - ROUNDING {
            return self.poses[(index + 1).min(last)];
        }
        FramePose::between(&self.poses, index, part)
    }

    fn placed(&self, pose: FramePose) -> Placed {
        Placed {
            constraint: self.constraint.clone(),
            pose,
        }
    }
}

fn same(one: &Arc<dyn StateConstraint>, other: &Arc<dyn StateConstraint>) -> bool {
    let other: &dyn Any = &**other;
    one.equals(other)
}

impl PartialEq for Moving {
    fn eq(&self, other: &Self) -> bool {
        same(&self.constraint, &other.constraint)
            && self.poses == other.poses
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
        self.placed(self.pose(0.0)).value(state)
    }

    /// Those of `g` at the start.
    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        self.placed(self.pose(0.0)).derivatives(state)
    }

    /// Those of `g` at the start.
    fn by_attitude(&self, state: &BodyState) -> Option<ByAttitude> {
        self.placed(self.pose(0.0)).by_attitude(state)
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
        let last = self.poses[self.poses.len() - 1];
        let start = self.pose(0.0).seen(start);
        let end = end.map(|end| last.seen(end));
        let constraint = self.constraint.between(&start, end.as_ref())?;
        Some(Arc::new(Self {
            constraint,
            ..self.clone()
        }))
    }

    fn at(&self, time: f64) -> Option<Arc<dyn StateConstraint>> {
        Some(Arc::new(self.placed(self.pose(time))))
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
            Coordinates::Position | Coordinates::Pose => {
                let turn = self.pose.rotation;
                (turn * gradient, turn * hessian * turn.transpose())
            }
            // ζ is a rotation in the body frame, whatever frame the attitude is seen from. Momenta are not seen from it.
            _ => (gradient, hessian),
        }
    }

    fn by_attitude(&self, state: &BodyState) -> Option<ByAttitude> {
        let seen = self.constraint.by_attitude(&self.seen(state))?;
        Some(ByAttitude {
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
