//! The states of the wheels and thrusters of all bodies.

use super::System;
use crate::RigidBody;
use crate::thrusters::ThrusterState;
use crate::wheels::WheelState;

/// What the wheels and thrusters of a system are in, apart from pulses on their way.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ActuatorStates {
    /// The states of all wheels, body by body.
    pub wheels: Vec<WheelState>,
    /// The mass of the propellant that is left, for each body with thrusters.
    pub propellants: Vec<f64>,
    /// The states of all thrusters, body by body.
    pub thrusters: Vec<ThrusterState>,
}

impl ActuatorStates {
    /// Those of a system.
    pub fn of(system: &System) -> Self {
        let mut states = Self::default();
        states.take(system);
        states
    }

    /// Takes those of a system.
    pub fn take(&mut self, system: &System) {
        self.wheels.clear();
        self.wheels.extend(system.wheel_states());
        self.propellants.clear();
        self.thrusters.clear();
        for thrusters in system.bodies.iter().filter_map(RigidBody::thrusters) {
            self.propellants.push(thrusters.propellant_left());
            self.thrusters.extend_from_slice(thrusters.states());
        }
    }
}

impl System {
    fn wheel_states(&self) -> impl Iterator<Item = WheelState> {
        let each = self.bodies.iter().filter_map(RigidBody::wheels);
        each.flat_map(|wheels| wheels.states().iter().copied())
    }

    /// Sets the states of wheels and thrusters; of more than there are, the rest is ignored.
    pub fn set_actuator_states(&mut self, states: &ActuatorStates) {
        self.set_wheel_states(&states.wheels);
        let mut all = states.thrusters.as_slice();
        let each = self.bodies.iter_mut();
        let each = each.filter(|body| body.thrusters().is_some());
        for (body, &left) in each.zip(&states.propellants) {
            body.set_propellant(left);
            if let Some(thrusters) = body.thrusters_mut()
                && let Some((own, others)) = all.split_at_checked(thrusters.states().len())
            {
                thrusters.set_states(own);
                all = others;
            }
        }
        self.take_masses();
    }

    pub(crate) fn set_wheel_states(&mut self, mut states: &[WheelState]) {
        for wheels in self.bodies.iter_mut().filter_map(RigidBody::wheels_mut) {
            let Some((own, others)) = states.split_at_checked(wheels.states().len()) else {
                return;
            };
            wheels.set_states(own);
            states = others;
        }
    }

    /// Takes the present masses of the bodies, where gravity has noted them.
    pub(crate) fn take_masses(&mut self) {
        if self.levels.is_some() {
            let each = self.gravity.iter_mut();
            for separable in each.filter_map(|gravity| gravity.separable()) {
                separable.prepare(&self.bodies);
            }
        }
        let bodies = &self.bodies;
        let mass = |body: usize| bodies[body].attracted_mass();
        for kept in self.selection.kept.iter_mut().flatten().flatten() {
            kept.masses = mass(kept.body);
            if kept.other != kept.body {
                kept.masses *= mass(kept.other);
            }
        }
    }
}
