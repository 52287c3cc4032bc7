use lgvi_dynamics::{BodyState, RigidBody};
use nalgebra::SVector;

use crate::Scene;

impl Scene {
    /// By how much the planned body's state `end` misses the target, in the order `[x, γ, R, Π]`, where what is free is
    /// not missed; `None` without a maneuver.
    ///
    /// Of an orbit it is the difference of the eccentricity vectors times the distance, and that of the angular momenta
    /// over the distance; of a spin axis the least rotation that points it.
    pub fn miss(&self, end: &BodyState) -> Option<SVector<f64, 12>> {
        let nominal = &self.bodies[self.maneuver.as_ref()?.body].body;
        self.miss_of(nominal, end)
    }

    /// The same of a body that takes the planned one's place: it misses the momenta that it would have at the target's
    /// velocities.
    pub fn miss_of(&self, body: &RigidBody, end: &BodyState) -> Option<SVector<f64, 12>> {
        let maneuver = self.maneuver.as_ref()?;
        let nominal = &self.bodies[maneuver.body].body;
        let heavier = body.mass() / nominal.mass();
        let other = body.inertia() != nominal.inertia();
        let (own, inverse) = (body.inertia(), nominal.inertia().inverse());
        let mut seen = *end;
        seen.linear_momentum /= heavier;
        if other {
            seen.angular_momentum =
                nominal.inertia().matrix() * (own.inverse() * end.angular_momentum);
        }
        let mut miss = maneuver.target.miss(&seen);
        let mut linear = miss.fixed_rows_mut::<3>(3);
        linear *= heavier;
        if other {
            let mut angular = miss.fixed_rows_mut::<3>(9);
            let momentum = own.matrix() * (inverse * &angular);
            angular.copy_from(&momentum);
        }
        Some(miss)
    }
}
