//! How the flight's loop publishes states.

use std::sync::atomic::Ordering;

use lgvi_common::body_sample;
use lgvi_middleware::node::NodeError;

use super::Propagator;
use crate::node::link::Wait;
use crate::node::messages::state_header;

impl Propagator {
    /// Publishes the present state where its turn has come, or in any case.
    pub(crate) fn publish(&mut self, wait: Wait) -> Result<(), NodeError> {
        let step = self.flight.step();
        let answered = self.is_answered(step);
        let always = step == self.scene.steps || wait == Wait::Always;
        if always || answered || step.is_multiple_of(self.rates.state_every) {
            self.sample()?;
        }
        // Who reads it in shared memory needs it nowhere else.
        let answered = answered && !self.commanding.is_in_memory();
        let always = always || answered;
        if always || step.is_multiple_of(self.rates.ros_every) {
            self.hand_over(if answered { Wait::Always } else { wait });
        }
        if answered {
            self.link.wake();
        }
        Ok(())
    }

    /// Sends the present state over shared memory.
    pub(crate) fn sample(&mut self) -> Result<(), NodeError> {
        let step = self.flight.step();
        let header = state_header(&self.scene, step, self.samples);
        let (states, units) = (self.flight.states(), &self.scene.units);
        let bodies = self.names.iter().zip(states);
        self.outgoing.clear();
        self.outgoing
            .extend(bodies.map(|(&name, state)| body_sample(name, state, units)));
        if let Some(sample) = self.outgoing.iter().find(|sample| !sample.is_finite()) {
            let name = sample.name;
            let message = format!("step {step} of {name}: the state is not finite in SI");
            return Err(NodeError::Runtime(message));
        }
        self.states.send(header, &self.outgoing)?;
        self.samples += 1;
        self.sampled = Some(step);
        self.monitor
            .refused
            .store(self.states.lost(), Ordering::Relaxed);
        Ok(())
    }

    /// Hands the present state to the ROS side.
    pub(crate) fn hand_over(&mut self, wait: Wait) {
        let step = self.flight.step();
        if self.link.publish(&self.flight, wait) {
            self.handed = Some(step);
        } else {
            self.monitor.skipped.fetch_add(1, Ordering::Relaxed);
        }
    }
}
