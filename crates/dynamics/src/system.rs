use crate::gravity::Gravity;
use crate::{BodyState, Load, RigidBody};

/// Bodies and the gravity that acts on them.
pub struct System {
    bodies: Vec<RigidBody>,
    gravity: Vec<Box<dyn Gravity>>,
}

impl System {
    /// Bodies under the sum of the given gravities; none means free bodies.
    pub fn new(bodies: Vec<RigidBody>, gravity: Vec<Box<dyn Gravity>>) -> Self {
        Self { bodies, gravity }
    }

    /// The bodies, in the order of their states.
    pub fn bodies(&self) -> &[RigidBody] {
        &self.bodies
    }

    /// Sets `loads` (one a body) to what gravity exerts in `states`.
    pub fn loads(&mut self, states: &[BodyState], loads: &mut [Load]) {
        loads.fill(Load::default());
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
}
