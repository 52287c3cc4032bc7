use super::flow::Components;
use crate::{Mobility, RigidBody};

/// Rotation (rad), and displacement in radii of gyration, whose momentum is the minimum scale of momenta.
const MOTION: f64 = 0.1;

/// Magnitudes by which the errors of a body's components over a step are scaled.
///
/// - Position: `|x| + ℓ` with the radius of gyration `ℓ = √(tr J / 2m)`.
/// - Attitude: 1.
/// - Linear momentum: `|γ|` plus the momentum that moves the body by 0.1 ℓ in a given time.
/// - Angular momentum: `|Π|` plus the momentum that rotates the body by 0.1 rad in that time.
///
/// Each norm is the larger of its values at both ends of the step. Norms of vectors make the scale independent of the
/// axes. The added terms prevent the rounding of a nearly zero momentum from being treated as an error.
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

    /// The number of moving components.
    pub(super) fn moving(&self) -> f64 {
        self.mobility.iter().sum()
    }

    /// The inverse of each component's magnitude over a step from `y` to `end`, or 0 where the body does not move.
    /// `time` is the time scale for momenta.
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
