//! Where the flight's loop reads its sensors.

use std::sync::atomic::Ordering;

use lgvi_dynamics::StepReport;
use lgvi_middleware::node::NodeError;

use crate::node::link::Wait;
use crate::node::run::Propagator;

impl Propagator {
    /// Makes a step of a flight with sensors, and hands what they have read to the ROS side.
    pub(crate) fn advance_sensing(&mut self) -> Result<StepReport, NodeError> {
        self.sensors.depart(&self.flight);
        let report = self.flight.advance();
        let report = report.map_err(|error| self.step_failed(&error))?;
        self.sensors.arrive(&self.flight);
        let step = self.flight.step();
        let always = step == self.scene.steps || self.stepping.is_some() || self.is_answered(step);
        let wait = if always {
            Wait::Always
        } else {
            Wait::AsConfigured
        };
        self.hand_over_readings(wait)?;
        Ok(report)
    }

    /// Reads the sensors at the present step, which has not been arrived at by a step just now.
    pub(crate) fn sense_again(&mut self) -> Result<(), NodeError> {
        if self.sensors.is_empty() {
            return Ok(());
        }
        self.sensors.read(&self.flight);
        self.hand_over_readings(Wait::Always)
    }

    /// Hands what the sensors have read to the ROS side.
    fn hand_over_readings(&mut self, wait: Wait) -> Result<(), NodeError> {
        while let Some(reading) = self.sensors.take() {
            if !reading.truth.is_finite() {
                let sensor = &self.scene.sensors[reading.sensor];
                let body = &self.scene.bodies[sensor.body].name;
                let message = format!(
                    "step {}: what {} on {body} measures is not finite",
                    reading.step, sensor.name
                );
                return Err(NodeError::Runtime(message));
            }
            if !self.link.sense(reading, wait) {
                self.monitor.skipped.fetch_add(1, Ordering::Relaxed);
            }
        }
        Ok(())
    }
}
