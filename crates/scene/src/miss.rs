use lgvi_control::Terminal;
use lgvi_dynamics::{BodyState, RigidBody};
use nalgebra::SVector;

use crate::{Maneuver, Scene};

impl Scene {
    /// Returns the terminal error of the planned body's state `end` in the order `[x, γ, R, Π]`, with zeros for free
    /// components, or `None` without a maneuver.
    ///
    /// For an orbit, the entries are the difference of the eccentricity vectors times the distance, and the difference
    /// of the angular momenta divided by the distance. For a spin axis, the entry is the smallest rotation that aligns
    /// it.
    pub fn miss(&self, end: &BodyState) -> Option<SVector<f64, 12>> {
        let maneuver = self.maneuver.as_ref()?;
        let nominal = &self.bodies[maneuver.body].body;
        self.miss_of(maneuver, &maneuver.target, nominal, end)
    }

    /// Returns [`Scene::miss`] at the end of a flight, of the planned one among `bodies`, which may replace those of the scene,
    /// beside the others in their `states`.
    ///
    /// A target relative to another body is where that body is; there is none if that is nowhere, such as in orbital axes of a
    /// body at the center. Momenta are compared with those that the replacement would have at the target's velocities.
    pub fn miss_among(
        &self,
        bodies: &[RigidBody],
        states: &[BodyState],
        end: &BodyState,
    ) -> Option<SVector<f64, 12>> {
        self.miss_in(self.maneuver.as_ref()?, bodies, states, end)
    }

    /// Returns the terminal errors of all planned bodies at the end of a flight, as [`Scene::miss_among`] does, in the order of
    /// [`Maneuver::planned`].
    pub fn misses(
        &self,
        bodies: &[RigidBody],
        states: &[BodyState],
    ) -> Vec<Option<SVector<f64, 12>>> {
        let planned = self.maneuver.iter().flat_map(Maneuver::planned);
        let miss = |part: &Maneuver| self.miss_in(part, bodies, states, &states[part.body]);
        planned.map(miss).collect()
    }

    fn miss_in(
        &self,
        planned: &Maneuver,
        bodies: &[RigidBody],
        states: &[BodyState],
        end: &BodyState,
    ) -> Option<SVector<f64, 12>> {
        let relative = self.target_among(planned, bodies, states).ok()?;
        let target = relative.as_ref().unwrap_or(&planned.target);
        self.miss_of(planned, target, &bodies[planned.body], end)
    }

    fn miss_of(
        &self,
        planned: &Maneuver,
        target: &Terminal,
        body: &RigidBody,
        end: &BodyState,
    ) -> Option<SVector<f64, 12>> {
        let nominal = &self.bodies[planned.body].body;
        let heavier = body.mass() / nominal.mass();
        let other = body.inertia() != nominal.inertia();
        let (own, inverse) = (body.inertia(), nominal.inertia().inverse());
        let mut seen = *end;
        seen.linear_momentum /= heavier;
        if other {
            seen.angular_momentum =
                nominal.inertia().matrix() * (own.inverse() * end.angular_momentum);
        }
        let mut miss = target.miss(&seen);
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
