use nalgebra::Vector3;

use super::{ThrusterError, Thrusters};

/// An engine at the center of mass that turns to every direction at once: it exerts the force that is asked for, and no moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Engine {
    /// Largest force, > 0; infinity if it has no limit.
    pub thrust: f64,
    /// Effective exhaust velocity `c`, finite and > 0.
    pub exhaust_velocity: f64,
}

impl Engine {
    fn check(&self) -> Result<(), ThrusterError> {
        let finite = self.exhaust_velocity.is_finite() && self.exhaust_velocity > 0.0;
        for (quantity, value, valid, expected) in [
            ("thrust", self.thrust, self.thrust > 0.0, "a number > 0"),
            (
                "exhaust velocity",
                self.exhaust_velocity,
                finite,
                "a finite number > 0",
            ),
        ] {
            if !valid {
                return Err(ThrusterError::Engine {
                    quantity,
                    value,
                    expected,
                });
            }
        }
        Ok(())
    }

    /// The force nearest to one that is asked for.
    pub(super) fn within_limit(&self, force: Vector3<f64>) -> Vector3<f64> {
        let norm = force.norm();
        if norm > self.thrust {
            force * (self.thrust / norm)
        } else {
            force
        }
    }
}

impl Thrusters {
    /// These thrusters and an engine that uses the same propellant.
    ///
    /// # Errors
    /// Returns an error if a number is out of the range that [`Engine`] states.
    pub fn with_engine(self, engine: Engine) -> Result<Self, ThrusterError> {
        engine.check()?;
        Ok(Self {
            engine: Some(engine),
            ..self
        })
    }

    /// The engine.
    pub fn engine(&self) -> Option<&Engine> {
        self.engine.as_ref()
    }

    /// Sets the force that the engine is asked for from the next step on, inertial frame.
    pub(crate) fn set_engine_command(&mut self, force: Vector3<f64>) {
        self.condition.engine_command = force;
    }

    /// The force of the engine in the last step, inertial frame.
    pub fn engine_force(&self) -> Vector3<f64> {
        self.condition.engine_force
    }
}
