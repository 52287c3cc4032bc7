//! Constraints that hold with a probability.

use lgvi_dynamics::{BodyError, RigidBody};
use nalgebra::{Dyn, OMatrix, U12, Vector3};

use super::parameter::ParameterError;
use super::{Transfer, Vector12};

/// Number of independent sources of uncertainty of the initial state. Those of the actuators and of the body follow.
pub(crate) const OF_STATE: usize = 12;

/// Those of the body: its mass and three moments.
pub(crate) const OF_BODY: usize = 4;

/// Deviations `[δx, δγ, ζ, δΠ]` of a state for a deviation of one standard deviation of each source. Momenta are those of the nominal
/// body at the velocities.
pub(crate) type Deviations = OMatrix<f64, U12, Dyn>;

/// What is uncertain about a flight: standard deviations of independent normal deviations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Uncertainty {
    /// Of each component of the initial position.
    pub position: f64,
    /// Of each component of the initial velocity.
    pub velocity: f64,
    /// Of each component of the rotation vector `v` (rad) by which the initial attitude deviates, `R exp(v)`.
    pub attitude: f64,
    /// Of each component of the initial angular velocity, body frame.
    pub angular_velocity: f64,
    /// Of the constant relative error of each component of the force.
    pub force_error: f64,
    /// Of the constant relative error of each component of the moment.
    pub moment_error: f64,
    /// Of the constant relative error of each command, where commands are of thrusters or wheels.
    pub actuator_error: f64,
    /// Of the logarithm of the mass. Inertia and points scale with it.
    pub mass: f64,
    /// Of the logarithm of each moment `∫ρ_i² dm` about the axes of the body.
    pub inertia: f64,
    /// True if the flight applies the feedback of its plan.
    pub feedback: bool,
}

/// The probability with which constraints on states hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chances {
    pub(crate) uncertainty: Uncertainty,
    confidence: f64,
}

impl Chances {
    /// Each constraint on states without a price holds at each step with at least this probability, to first order in the
    /// deviations.
    ///
    /// # Errors
    /// Returns an error if the confidence is not at least 1/2 and below 1, or if a standard deviation is negative or not finite.
    pub fn new(uncertainty: Uncertainty, confidence: f64) -> Result<Self, ParameterError> {
        if !(0.5..1.0).contains(&confidence) {
            let expected = "a probability from 0.5 to below 1";
            return Err(ParameterError::new("confidence", confidence, expected));
        }
        for (name, deviation) in [
            ("position", uncertainty.position),
            ("velocity", uncertainty.velocity),
            ("attitude", uncertainty.attitude),
            ("angular_velocity", uncertainty.angular_velocity),
            ("force_error", uncertainty.force_error),
            ("moment_error", uncertainty.moment_error),
            ("actuator_error", uncertainty.actuator_error),
            ("mass", uncertainty.mass),
            ("inertia", uncertainty.inertia),
        ] {
            if !(deviation >= 0.0 && deviation.is_finite()) {
                return Err(ParameterError::new(name, deviation, "a finite number >= 0"));
            }
        }
        Ok(Self {
            uncertainty,
            confidence,
        })
    }

    /// The number of standard deviations below which a normal deviation stays with the probability.
    pub(crate) fn quantile(&self) -> f64 {
        // The probability of more than `x` standard deviations falls from 1/2 at 0 to 0 at 40.
        let above = |x: f64| 0.5 * libm::erfc(x * std::f64::consts::FRAC_1_SQRT_2);
        let [mut low, mut high] = [0.0, 40.0];
        for _ in 0..64 {
            let middle = 0.5 * (low + high);
            if above(middle) > 1.0 - self.confidence {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }
}

impl Uncertainty {
    /// The body whose source deviates by `size` standard deviations: its mass, or one of its moments.
    ///
    /// # Errors
    /// Returns an error if it is no rigid body.
    pub(crate) fn deviated(
        &self,
        body: &RigidBody,
        source: usize,
        size: f64,
    ) -> Result<RigidBody, BodyError> {
        match source.checked_sub(1) {
            None => body.scaled((size * self.mass).exp()),
            Some(axis) => {
                let mut stretch = Vector3::repeat(1.0);
                stretch[axis] = (0.5 * size * self.inertia).exp();
                let inertia = body.inertia().stretched(&stretch)?;
                body.clone().with_inertia(inertia)
            }
        }
    }

    /// The standard deviation of a source of the body.
    pub(crate) fn of_body(&self, source: usize) -> f64 {
        if source == 0 { self.mass } else { self.inertia }
    }

    /// The deviations of the initial state of a body under so many actuators.
    pub(crate) fn initial(&self, body: &RigidBody, actuators: usize) -> Deviations {
        let inertia = body.inertia().matrix();
        let mut all = Deviations::zeros(OF_STATE + actuators + OF_BODY);
        for axis in 0..3 {
            let unit = Vector3::ith(axis, 1.0);
            for (half, deviation) in [
                self.position * unit,
                body.mass() * self.velocity * unit,
                self.attitude * unit,
                inertia * (self.angular_velocity * unit),
            ]
            .into_iter()
            .enumerate()
            {
                let mut own = Vector12::zeros();
                own.fixed_rows_mut::<3>(3 * half).copy_from(&deviation);
                all.set_column(3 * half + axis, &own);
            }
        }
        all
    }
}

impl Transfer {
    /// The transfer whose constraints on states hold with a probability. [`Transfer::with_constraints`] comes first.
    pub fn with_chances(self, chances: Chances) -> Self {
        Self {
            chances: Some(chances),
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_normal_distribution() {
        // Abramowitz and Stegun, table 26.5 and 26.6.
        for (confidence, quantile) in [
            (0.5, 0.0),
            (0.841_344_746_068_543, 1.0),
            (0.975, 1.959_963_984_540_054),
            (0.99, 2.326_347_874_040_841),
            (0.999, 3.090_232_306_167_813),
        ] {
            let chances = Chances::new(Uncertainty::default(), confidence).unwrap();
            let error = chances.quantile() - quantile;
            assert!(error.abs() < 1e-12, "{confidence}: {error:e}");
        }
        for confidence in [0.0, 0.49, 1.0, -1.0, f64::NAN] {
            assert!(Chances::new(Uncertainty::default(), confidence).is_err());
        }
        let backwards = Uncertainty {
            velocity: -1.0,
            ..Uncertainty::default()
        };
        let refused = Chances::new(backwards, 0.9).unwrap_err();
        assert_eq!(refused.name, "velocity");
    }
}
