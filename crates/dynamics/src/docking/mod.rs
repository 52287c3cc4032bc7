//! Docking: two bodies become one rigid body when their ports meet.
//!
//! The two bodies of a [`Docking`] join at the beginning of the first step at which its conditions hold, in the relative
//! pose that they have then. The joined body has the sum of the masses, the common center of mass, and the inertia by
//! the parallel-axis theorem. Its momenta are the sums of those of the parts, about any point: a perfectly inelastic
//! contact. With the parts' states before (`γ_i`, `Π_i`) and after (`γ_i'`, `Π_i'`), the loss of kinetic energy is the
//! kinetic energy of the change,
//!
//! `½ Σ |γ_i − γ_i'|²/m_i + (Π_i − Π_i')·J_i⁻¹ (Π_i − Π_i')`,
//!
//! because the joined motion is the projection of the motion before, orthogonal in the kinetic energy.
//!
//! A joined body is integrated by the method of the simulation. Gravity acts on its parts, but not between them.
//! [`Simulation::states`](crate::Simulation::states) remain those of the single bodies: parts move as the joined body
//! carries them. The load on a part is converted to one on the joined body at the beginning of a step. A joined body can
//! dock again. Bodies never separate, unless [`Simulation::set_states`](crate::Simulation::set_states) sets new states.
//!
//! # Assumptions and limitations
//! Conditions are checked at the beginnings of steps only. Ports that pass each other within a step do not meet.

mod assembly;
mod dockings;
mod gravity;

use nalgebra::Vector3;

use crate::{BodyState, RigidBody};

pub(crate) use dockings::Dockings;

/// A docking port of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Port {
    /// Index of the body, from 0.
    pub body: usize,
    /// Position `ρ` from the origin of the body, body frame.
    pub position: Vector3<f64>,
    /// Outward axis, a unit vector, body frame.
    pub axis: Vector3<f64>,
}

/// Two ports, and the conditions under which their bodies join.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Docking {
    /// The ports, on two different free bodies.
    pub ports: [Port; 2],
    /// Largest distance between the ports.
    pub distance: f64,
    /// Largest angle between one axis and the opposite of the other (rad).
    pub angle: f64,
    /// Largest relative speed of the ports, infinite if it does not matter.
    pub speed: f64,
    /// Largest relative angular velocity of the bodies, infinite if it does not matter.
    pub rate: f64,
}

/// A docking that has taken place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Docked {
    /// Index of the docking, from 0.
    pub docking: usize,
    /// Number of steps made before.
    pub step: u64,
    /// Loss of kinetic energy, ≥ 0.
    pub energy_loss: f64,
}

/// A port in the inertial frame.
struct Placed {
    position: Vector3<f64>,
    axis: Vector3<f64>,
    velocity: Vector3<f64>,
    angular_velocity: Vector3<f64>,
}

impl Port {
    fn placed(&self, bodies: &[RigidBody], states: &[BodyState]) -> Placed {
        let (body, state) = (&bodies[self.body], &states[self.body]);
        let r = &state.attitude;
        let angular_velocity = state.angular_velocity(body);
        let turning = angular_velocity.cross(&self.position);
        Placed {
            position: state.position + r * self.position,
            axis: r * self.axis,
            velocity: state.velocity(body) + r * turning,
            angular_velocity: r * angular_velocity,
        }
    }
}

impl Docking {
    /// Returns true if the conditions hold.
    fn captures(&self, bodies: &[RigidBody], states: &[BodyState]) -> bool {
        let [one, other] = self.ports.map(|port| port.placed(bodies, states));
        let (sine, cosine) = (
            one.axis.cross(&other.axis).norm(),
            -one.axis.dot(&other.axis),
        );
        (one.position - other.position).norm() <= self.distance
            && libm::atan2(sine, cosine) <= self.angle
            && (one.velocity - other.velocity).norm() <= self.speed
            && (one.angular_velocity - other.angular_velocity).norm() <= self.rate
    }
}
