use super::flow::Components;
use crate::{Mobility, RigidBody};

/// Turn (rad), and displacement in radii of gyration, by which a momentum is always allowed to be measured.
const MOTION: f64 = 0.1;

/// Magnitudes against which errors of a body's components over a step are measured.
///
/// Position: `|x| + ℓ` with the radius of gyration `ℓ = √(tr J / 2m)`. Attitude: 1. Linear momentum: `|γ|` plus that by which
/// the body moves by 0.1 ℓ in a given time; angular momentum: `|Π|` plus that by which it turns by 0.1 rad. The norms are
/// the greater of both ends of the step, and of vectors, so that what a component is does not depend on the axes. What
/// is added keeps the rounding of a momentum that is nearly zero from being taken for an error.
pub(super) struct Scale {
    length: f64,
    linear: f64,
    angular: f64,
    mobility: Components,
}

impl Scale {
    pub(super) fn new(body: &RigidBody) -> Self {
        let trace = body.inertia().matrix().trace();
        let length = (0.5 * trace / body.mass()).sqrt();
        let mut mobility = [1.0; 18];
        match body.mobility() {
            Mobility::Free => {}
            Mobility::Pivoted => mobility[..6].fill(0.0),
            Mobility::Fixed | Mobility::Driven(_) => mobility.fill(0.0),
        }
        Self {
            length,
            linear: MOTION * body.mass() * length,
            angular: MOTION * trace / 3.0,
            mobility,
        }
    }

    /// The radius of gyration `ℓ`.
    pub(super) fn length(&self) -> f64 {
        self.length
    }

    /// How many components move.
    pub(super) fn moving(&self) -> f64 {
        self.mobility.iter().sum()
    }

    /// The inverse of each component's magnitude over a step from `y` to `end`, momenta measured by the motion in `time`; 0
    /// where the body does not move.
    #[inline]
    pub(super) fn inverse(&self, y: &Components, end: &Components, time: f64) -> Components {
        let norm = |from: usize| {
            let squared = |y: &Components| (0..3).map(|i| y[from + i] * y[from + i]).sum::<f64>();
            squared(y).max(squared(end)).sqrt()
        };
        let position = 1.0 / (norm(0) + self.length);
        let linear = 1.0 / (norm(3) + self.linear / time);
        let angular = 1.0 / (norm(15) + self.angular / time);
        let mut inverse = self.mobility;
        for i in 0..3 {
            inverse[i] *= position;
            inverse[3 + i] *= linear;
            inverse[15 + i] *= angular;
        }
        inverse
    }
}
