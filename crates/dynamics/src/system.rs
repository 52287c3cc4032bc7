use crate::gravity::{CloseApproach, Gravity};
use crate::{BodyState, Load, Mobility, RigidBody};

/// Bodies and the gravity that acts on them.
pub struct System {
    bodies: Vec<RigidBody>,
    gravity: Vec<Box<dyn Gravity>>,
    /// Whether anything has an extent that another could enter.
    extents: bool,
}

impl System {
    /// Bodies under the sum of the given gravities; none means free bodies.
    pub fn new(bodies: Vec<RigidBody>, gravity: Vec<Box<dyn Gravity>>) -> Self {
        let extents = gravity.iter().any(|gravity| gravity.has_extents(&bodies));
        Self {
            bodies,
            gravity,
            extents,
        }
    }

    /// The bodies, in the order of their states.
    pub fn bodies(&self) -> &[RigidBody] {
        &self.bodies
    }

    /// Sets `loads` (one a body) to what gravity exerts in `states`.
    pub fn loads(&mut self, states: &[BodyState], loads: &mut [Load]) {
        for load in loads.iter_mut() {
            *load = Load::default();
        }
        for gravity in &mut self.gravity {
            gravity.add_loads(&self.bodies, states, loads);
        }
    }

    /// The potential `U` of all gravity in `states`.
    pub fn potential(&self, states: &[BodyState]) -> f64 {
        self.gravity
            .iter()
            .map(|gravity| gravity.potential(&self.bodies, states))
            .sum()
    }

    /// Whether the bodies are outside each other's radii.
    pub fn check_clearance(&self, states: &[BodyState]) -> Result<(), CloseApproach> {
        if self.extents {
            for gravity in &self.gravity {
                gravity.check_clearance(&self.bodies, states)?;
            }
        }
        Ok(())
    }

    /// What [`System::loads`] costs, in multiples of a point of mass in a central field, roughly.
    pub fn cost(&self) -> f64 {
        let gravity = self.gravity.iter();
        gravity.map(|gravity| gravity.cost(&self.bodies)).sum()
    }

    /// Whether gravity acts at all.
    pub fn is_free(&self) -> bool {
        self.gravity.is_empty()
    }

    /// Puts the bodies that are held or driven on their way: their momenta in `states` are those of their motion.
    pub fn constrain(&self, states: &mut [BodyState]) {
        for (body, state) in self.bodies.iter().zip(states) {
            match body.mobility() {
                Mobility::Free => {}
                Mobility::Pivoted => state.linear_momentum.fill(0.0),
                Mobility::Fixed => {
                    state.linear_momentum.fill(0.0);
                    state.angular_momentum.fill(0.0);
                }
                Mobility::Driven(drive) => {
                    *state = drive.state(body, state.position, state.attitude);
                }
            }
        }
    }
}
