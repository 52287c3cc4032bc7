use lgvi_dynamics::{BodyError, BodyState, RigidBody, System};
use lgvi_lie::exp;
use nalgebra::Vector3;
use rand_core::SeedableRng;
use rand_pcg::Pcg64Mcg;

use crate::disturbance::{factors, normals};
use crate::{ActuatorErrors, NamedBody, Scene};

/// Standard deviations of the samples of an ensemble, in the scene's units. Seed and index determine the values of a
/// sample, equally on every machine and independently of the other samples.
///
/// # Assumptions and limitations
/// - All deviations are independent of each other, axis by axis. State and actuators deviate normally, mass and inertia
///   log-normally: by a factor `exp(σn)`, n normal.
/// - A deviation of the mass scales inertia and points with it. A deviation of the inertia stretches the body along its
///   axes: each moment `∫ρ_i² dm` is multiplied by its own factor, so that the result is the inertia of a rigid body.
///   Points keep their positions.
/// - An actuator's error is a factor that stays constant over the flight, as in a [`Disturbance`](crate::Disturbance).
#[derive(Clone, Debug, PartialEq)]
pub struct Ensemble {
    /// Number of samples.
    pub samples: u64,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Standard deviation of the factor on each component of the maneuver's force.
    pub force_error: f64,
    /// Standard deviation of the factor on each component of the maneuver's moment.
    pub moment_error: f64,
    /// Standard deviation of the factor on the force of each thruster, or the torque of each wheel, that the maneuver commands.
    pub actuator_error: f64,
    /// Number of these thrusters or wheels.
    pub actuators: usize,
    /// Standard deviations of the bodies, one entry per body.
    pub spreads: Vec<Spread>,
}

/// Standard deviations of one body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// Standard deviation of each component of `x`.
    pub position: f64,
    /// Standard deviation of each component of `ẋ`.
    pub velocity: f64,
    /// Standard deviation of each component of the rotation vector `v` (rad), which changes the attitude to `R exp(v)`.
    pub attitude: f64,
    /// Standard deviation of each component of `Ω`, body frame.
    pub angular_velocity: f64,
    /// Standard deviation of the logarithm of the mass.
    pub mass: f64,
    /// Standard deviation of the logarithm of each moment `∫ρ_i² dm`.
    pub inertia: f64,
}

/// Deviations of one body in a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// `δx`.
    pub position: Vector3<f64>,
    /// `δẋ`.
    pub velocity: Vector3<f64>,
    /// `v` (rad).
    pub attitude: Vector3<f64>,
    /// `δΩ`.
    pub angular_velocity: Vector3<f64>,
    /// Logarithm of the factor on the mass.
    pub mass: f64,
    /// Logarithms of the factors on `∫ρ_i² dm`.
    pub inertia: Vector3<f64>,
}

/// One sample of an ensemble.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Deviations from the nominal scene, one entry per body.
    pub deviations: Vec<Deviation>,
    /// Errors of the maneuver's actuators.
    pub actuators: ActuatorErrors,
}

impl Ensemble {
    /// Returns the sample with this index.
    pub fn sample(&self, index: u64) -> Sample {
        let mut rng =
            Pcg64Mcg::seed_from_u64(mixed(self.seed).wrapping_add(index.wrapping_mul(GOLDEN)));
        // Draws the same normal numbers whatever the standard deviations are.
        let actuators = [self.force_error, self.moment_error]
            .map(|deviation| (deviation * normals(&mut rng)).add_scalar(1.0));
        let deviations = self.spreads.iter().map(|spread| Deviation {
            position: spread.position * normals(&mut rng),
            velocity: spread.velocity * normals(&mut rng),
            attitude: spread.attitude * normals(&mut rng),
            angular_velocity: spread.angular_velocity * normals(&mut rng),
            mass: spread.mass * normals(&mut rng).x,
            inertia: spread.inertia * normals(&mut rng),
        });
        let deviations = deviations.collect();
        let [force, moment] = actuators;
        Sample {
            deviations,
            actuators: ActuatorErrors {
                force,
                moment,
                actuators: factors(self.actuator_error, self.actuators, &mut rng),
            },
        }
    }
}

impl Sample {
    /// Returns the bodies of `scene` in this sample with their gravity, and their states at step 0.
    ///
    /// # Errors
    /// Returns an error if the deviations make a body's mass or inertia invalid.
    pub fn system(&self, scene: &Scene) -> Result<(System, Vec<BodyState>), BodyError> {
        let each = scene.bodies.iter().zip(&self.deviations);
        let each = each.map(|(nominal, deviation)| deviation.apply(nominal));
        let (bodies, states) = each.collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
        Ok((System::new(bodies, scene.gravity.of_system()), states))
    }
}

impl Deviation {
    /// Returns the body and its state. Velocities without a deviation keep their nominal values, and quantities without
    /// a deviation keep their bits.
    fn apply(&self, nominal: &NamedBody) -> Result<(RigidBody, BodyState), BodyError> {
        let NamedBody { body, state, .. } = nominal;
        let mut body = body.clone();
        let mut state = *state;
        if self.mass != 0.0 {
            let factor = libm::exp(self.mass);
            body = body.scaled(factor)?;
            state.linear_momentum *= factor;
            state.angular_momentum *= factor;
        }
        if self.inertia != Vector3::zeros() {
            let stretch = self.inertia.map(|logarithm| libm::exp(0.5 * logarithm));
            let angular_velocity = state.angular_velocity(&body);
            let inertia = body.inertia().stretched(&stretch)?;
            state.angular_momentum = inertia.matrix() * angular_velocity;
            body = body.with_inertia(inertia)?;
        }
        state.position += self.position;
        state.linear_momentum += body.mass() * self.velocity;
        if self.attitude != Vector3::zeros() {
            state.attitude *= exp(&self.attitude);
        }
        state.angular_momentum += body.inertia().matrix() * self.angular_velocity;
        if let Some(wheels) = nominal.body.wheels() {
            let [before, after] = [
                nominal.state.angular_velocity(&nominal.body),
                state.angular_velocity(&body),
            ];
            let count = wheels.wheels().len();
            let speeds: Vec<_> = (0..count).map(|k| wheels.speed(k, &before)).collect();
            if let Some(wheels) = body.wheels_mut() {
                wheels.set_speeds(&speeds, &after);
            }
        }
        Ok((body, state))
    }
}

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// Mixes the bits of a seed, so that similar seeds give unrelated samples. This is the final mixing function of
/// SplitMix64 (G. L. Steele, D. Lea, C. H. Flood, *Fast splittable pseudorandom number generators*, OOPSLA 2014).
fn mixed(seed: u64) -> u64 {
    let z = seed.wrapping_add(GOLDEN);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
