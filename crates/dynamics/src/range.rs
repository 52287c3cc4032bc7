use crate::integrator::MethodError;
use crate::simulation::refuse;
use crate::{BodyState, RigidBody};

/// Bounds of a quantity's size, zero left out where it may be zero. They are so wide that no unit in use leaves them, and so
/// narrow that no product of theirs that a step or gravity forms under- or overflows and matters: `h/m`, `|Π|²/J`, `J/r⁵`.
struct Range {
    quantity: &'static str,
    low: f64,
    high: f64,
}

const STEP: Range = Range {
    quantity: "the length of the step",
    low: 1e-30,
    high: 1e30,
};

const MASS: Range = Range {
    quantity: "the mass",
    low: 1e-60,
    high: 1e60,
};

/// The sum of the principal moments.
const INERTIA: Range = Range {
    quantity: "the trace of the inertia",
    low: 1e-100,
    high: 1e100,
};

/// The square of the radius of gyration, but for a factor.
const EXTENT: Range = Range {
    quantity: "the trace of the inertia over the mass",
    low: 1e-60,
    high: 1e60,
};

const POSITION: Range = Range {
    quantity: "the distance from the origin",
    low: 0.0,
    high: 1e30,
};

const POINT: Range = Range {
    quantity: "the distance of a point from its body's origin",
    ..POSITION
};

impl Range {
    fn check(&self, body: Option<usize>, value: f64) -> Result<(), MethodError> {
        if (self.low..=self.high).contains(&value) {
            return Ok(());
        }
        Err(MethodError::Range {
            body,
            quantity: self.quantity,
            value,
            low: self.low,
            high: self.high,
        })
    }
}

/// Whether a step has a length that numbers of double precision can work with.
pub(crate) fn check_step(h: f64) -> Result<(), MethodError> {
    if !h.is_normal() {
        return Err(refuse("step", h, "a finite number other than 0"));
    }
    STEP.check(None, h.abs())
}

/// The same of a body and its place.
pub(crate) fn check_body(
    index: usize,
    body: &RigidBody,
    state: &BodyState,
) -> Result<(), MethodError> {
    let index = Some(index);
    MASS.check(index, body.mass())?;
    let trace = body.inertia().matrix().trace();
    INERTIA.check(index, trace)?;
    EXTENT.check(index, trace / body.mass())?;
    POSITION.check(index, state.position.norm())?;
    let mut points = body.points().iter();
    points.try_for_each(|point| POINT.check(index, point.position.norm()))
}
