use lgvi_dynamics::{BodyState, RigidBody};
use nalgebra::SVector;

use crate::Scene;

impl Scene {
    /// Returns the terminal error of the planned body's state `end` in the order `[x, γ, R, Π]`, with zeros for free
    /// components, or `None` without a maneuver.
    ///
    /// For an orbit, the entries are the difference of the eccentricity vectors times the distance, and the difference
    /// of the angular momenta divided by the distance. For a spin axis, the entry is the smallest rotation that aligns
    /// it.
    pub fn miss(&self, end: &BodyState) -> Option<SVector<f64, 12>> {
        let nominal = &self.bodies[self.maneuver.as_ref()?.body].body;
        self.miss_of(nominal, end)
    }

    /// Returns the terminal errors of all planned bodies in the `states` of all bodies, in the order of
    /// [`Maneuver::planned`](crate::Maneuver::planned).
    pub fn misses(&self, states: &[BodyState]) -> Vec<SVector<f64, 12>> {
        let planned = self.maneuver.iter().flat_map(crate::Maneuver::planned);
        let misses = planned.map(|maneuver| maneuver.target.miss(&states[maneuver.body]));
        misses.collect()
    }

    /// Returns [`Scene::miss`] for a body that replaces the planned one: its momenta are compared with those that it
    /// would have at the target's velocities.
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
