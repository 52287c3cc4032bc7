use crate::integrator::MethodError;
use crate::simulation::refuse;
use crate::{BodyState, RigidBody};

/// Bounds on the magnitude of a quantity. Zero is excluded if the lower bound is positive.
///
/// The bounds are wide enough for any practical units, and narrow enough that the products formed in a step or in
/// gravity, such as `h/m`, `|Π|²/J` and `J/r⁵`, do not overflow or underflow in a way that matters.
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

/// Bounds on the sum of the principal moments.
const INERTIA: Range = Range {
    quantity: "the trace of the inertia",
    low: 1e-100,
    high: 1e100,
};

/// Bounds on the square of the radius of gyration, up to a factor.
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

/// Returns an error if the step size is outside the range that double precision can handle.
pub(crate) fn check_step(h: f64) -> Result<(), MethodError> {
    if !h.is_normal() {
        return Err(refuse("step", h, "a finite number other than 0"));
    }
    STEP.check(None, h.abs())
}

/// Returns an error if a property of the body or its position is outside the range that double precision can handle.
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
