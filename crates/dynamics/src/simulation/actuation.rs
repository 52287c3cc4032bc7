//! Steps in which wheels and thrusters act.

use nalgebra::Vector3;

use super::Simulation;
use crate::thrusters::{Condition, Firing};
use crate::wheels::WheelState;
use crate::{ActuatorStates, BodyState, Load, RigidBody, StepError, StepReport};

/// What a step begins with.
#[derive(Default)]
pub(super) struct Actuation {
    bodies: Vec<Begun>,
    wheels: Vec<WheelState>,
    activity: Activity,
}

/// What actuators do in a step.
#[derive(Clone, Copy, Default)]
struct Activity {
    /// They change momenta.
    acts: bool,
    /// They change masses.
    flows: bool,
}

/// A body at the beginning of a step.
#[derive(Default)]
struct Begun {
    linear_momentum: Vector3<f64>,
    angular_momentum: Vector3<f64>,
    thrusters: Condition,
    firing: Firing,
}

impl Begun {
    /// Notes a body, and makes the first half of what its actuators do. Adds what they do to `activity`.
    fn begin(
        &mut self,
        body: &mut RigidBody,
        state: &mut BodyState,
        h: f64,
        wheels: &mut Vec<WheelState>,
        activity: &mut Activity,
    ) {
        self.linear_momentum = state.linear_momentum;
        self.angular_momentum = state.angular_momentum;
        self.firing = Firing::default();
        let rate = state.angular_velocity(body);
        if let Some(thrusters) = body.thrusters_mut() {
            self.thrusters.clone_from(thrusters.condition());
            self.firing = thrusters.begin_step(h);
        }
        if self.firing.acts() {
            activity.acts = true;
            activity.flows |= self.firing.flows();
            body.begin_thrust(state, &self.firing, 0.5 * h);
        }
        let inverse = *body.inertia().inverse();
        if let Some(own) = body.wheels_mut() {
            wheels.extend_from_slice(own.states());
            state.angular_momentum += own.begin_step(&rate, &inverse, h);
            activity.acts |= own.states().iter().any(|wheel| wheel.torque != 0.0);
        }
    }

    /// Makes the second half.
    fn end(&self, body: &mut RigidBody, state: &mut BodyState, h: f64) {
        if let Some(wheels) = body.wheels_mut() {
            state.angular_momentum += wheels.end_step(h);
        }
        if self.firing.acts() {
            body.end_thrust(state, &self.firing, 0.5 * h);
        }
        let rate = state.angular_velocity(body);
        if let Some(wheels) = body.wheels_mut() {
            wheels.turn(&rate, h);
        }
    }

    /// Undoes the first half.
    fn undo(&self, body: &mut RigidBody, state: &mut BodyState) {
        state.linear_momentum = self.linear_momentum;
        state.angular_momentum = self.angular_momentum;
        if body.thrusters().is_some() {
            body.restore_thrusters(&self.thrusters);
        }
    }
}

impl Simulation {
    /// Makes one step in which the impulses of wheels and thrusters act in halves at both ends.
    #[cold]
    #[inline(never)]
    pub(super) fn advance_actuated(&mut self, controls: &[Load]) -> Result<StepReport, StepError> {
        let h = self.h;
        let mut begin = self.actuation.take().unwrap_or_default();
        let last = std::mem::take(&mut begin.activity);
        begin.wheels.clear();
        begin.bodies.resize_with(self.states.len(), Begun::default);
        let bodies = self.system.bodies_mut().iter_mut();
        for ((body, state), begun) in bodies.zip(&mut self.states).zip(&mut begin.bodies) {
            begun.begin(body, state, h, &mut begin.wheels, &mut begin.activity);
        }
        let acts = last.acts || begin.activity.acts;
        let flows = last.flows || begin.activity.flows;
        if flows {
            self.system.take_masses();
        }
        // An error control goes on from the end of its last own step, which is another one if impulses act. Loads that are kept
        // from the last step are those of other masses.
        if flows || acts && self.integrator.cuts_steps() {
            self.integrator.start(&mut self.system, &self.states);
        }
        let made = self.advance_once(controls);
        let bodies = self.system.bodies_mut().iter_mut();
        let each = bodies.zip(&mut self.states).zip(&begin.bodies);
        for ((body, state), begun) in each {
            match made {
                Ok(_) => begun.end(body, state, h),
                Err(_) => begun.undo(body, state),
            }
        }
        if made.is_err() {
            self.system.set_wheel_states(&begin.wheels);
        }
        if flows {
            self.system.take_masses();
        }
        self.actuation = Some(begin);
        made
    }

    /// Sets the states of wheels and thrusters.
    pub fn set_actuator_states(&mut self, states: &ActuatorStates) {
        self.system.set_actuator_states(states);
        self.integrator.start(&mut self.system, &self.states);
    }

    /// Sets the torques that the motors of a body's wheels are asked for from the next step on, one per wheel. Without
    /// wheels it does nothing.
    pub fn set_wheel_commands(&mut self, body: usize, torques: &[f64]) {
        if let Some(wheels) = self.system.bodies_mut()[body].wheels_mut() {
            wheels.set_commands(torques);
        }
    }

    /// Sets the factors by which the motors of a body's wheels exert other torques than they are asked for, one per wheel. Without
    /// wheels it does nothing.
    pub fn set_wheel_factors(&mut self, body: usize, factors: &[f64]) {
        if let Some(wheels) = self.system.bodies_mut()[body].wheels_mut() {
            wheels.set_factors(factors);
        }
    }

    /// Sets the factors, ≥ 0, by which a body's thrusters exert other forces than they are told to, one per thruster. Without
    /// thrusters it does nothing.
    pub fn set_thruster_factors(&mut self, body: usize, factors: &[f64]) {
        if let Some(thrusters) = self.system.bodies_mut()[body].thrusters_mut() {
            thrusters.set_factors(factors);
        }
    }

    /// Asks a body's engine for the force of a load from the next step on. Returns what is left of the load to
    /// [advance](Self::advance) with: all of it without an engine.
    pub fn command(&mut self, body: usize, load: Load) -> Load {
        let thrusters = self.system.bodies_mut()[body].thrusters_mut();
        match thrusters.filter(|thrusters| thrusters.engine().is_some()) {
            Some(thrusters) => {
                thrusters.set_engine_command(load.force);
                Load {
                    force: Vector3::zeros(),
                    ..load
                }
            }
            None => load,
        }
    }

    /// Sets the mean forces that a body's thrusters are asked for from the next step on, one per thruster. Without thrusters
    /// it does nothing.
    pub fn set_thruster_commands(&mut self, body: usize, thrust: &[f64]) {
        if let Some(thrusters) = self.system.bodies_mut()[body].thrusters_mut() {
            thrusters.set_commands(thrust);
        }
    }
}
