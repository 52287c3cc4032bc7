use lgvi_dynamics::{BodyState, Load, RigidBody, Simulation};
use lgvi_lie::exp;
use nalgebra::Vector3;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::scene::NamedBody;
use crate::{Commands, Maneuver, Scene};

/// The difference of a flight from its plan: standard deviations, in the scene's units, of the initial states of the
/// maneuvered body and of others, and of the errors of its actuators. The seed determines the values drawn, equally on every
/// machine.
///
/// # Assumptions and limitations
/// - All deviations are normally distributed and independent of each other, axis by axis.
/// - An actuator's error is a factor that stays constant over the flight. Where force and moment are commanded, it acts on the
///   axes in which they are given, which are inertial for the force and body axes for the moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Disturbance {
    /// Seed of the random numbers.
    pub seed: u64,
    /// Standard deviation of the factor on each component of the force.
    pub force_error: f64,
    /// Standard deviation of the factor on each component of the moment.
    pub moment_error: f64,
    /// Standard deviation of the factor on the force of each thruster, or the torque of each wheel, that the maneuver commands.
    pub actuator_error: f64,
    /// Number of these thrusters or wheels.
    pub actuators: usize,
    /// Standard deviations of the initial state of the maneuvered body.
    pub state: StateDeviation,
    /// Standard deviations of the initial states of other bodies, with their indices.
    pub others: Vec<(usize, StateDeviation)>,
}

/// Standard deviations of a state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StateDeviation {
    /// Standard deviation of each component of `x`.
    pub position: f64,
    /// Standard deviation of each component of `ẋ`.
    pub velocity: f64,
    /// Standard deviation of each component of the rotation vector `v` (rad), which changes the attitude to `R exp(v)`.
    pub attitude: f64,
    /// Standard deviation of each component of `Ω`, body frame.
    pub angular_velocity: f64,
}

/// Factors between the intended and the actual control.
#[derive(Clone, Debug, PartialEq)]
pub struct ActuatorErrors {
    /// Factors on the components of the force, inertial frame.
    pub force: Vector3<f64>,
    /// Factors on the components of the moment, body frame.
    pub moment: Vector3<f64>,
    /// Factors, ≥ 0, on the forces of the thrusters, or the torques of the wheels, that the maneuver commands.
    pub actuators: Vec<f64>,
}

impl ActuatorErrors {
    /// No errors of so many thrusters or wheels.
    pub fn none(actuators: usize) -> Self {
        Self {
            force: Vector3::repeat(1.0),
            moment: Vector3::repeat(1.0),
            actuators: vec![1.0; actuators],
        }
    }

    /// Lets the thrusters or wheels that a maneuver commands err in a simulation.
    pub fn set(&self, maneuver: &Maneuver, simulation: &mut Simulation) {
        let (body, factors) = (maneuver.body, &self.actuators);
        match maneuver.commands() {
            Commands::Loads => {}
            Commands::Thrusters => simulation.set_thruster_factors(body, factors),
            Commands::Wheels => simulation.set_wheel_factors(body, factors),
        }
    }

    /// Returns the load that acts if `load` is commanded.
    pub fn apply(&self, load: &Load) -> Load {
        Load {
            force: load.force.component_mul(&self.force),
            moment: load.moment.component_mul(&self.moment),
        }
    }
}

impl Disturbance {
    /// Returns the errors of the actuators.
    pub fn actuator_errors(&self) -> ActuatorErrors {
        let mut rng = Pcg64Mcg::seed_from_u64(self.seed);
        let [.., force, moment] = self.draw_from(&mut rng);
        // Numbers of their own, whatever other bodies deviate.
        let mut rng = Pcg64Mcg::seed_from_u64(!self.seed);
        ActuatorErrors {
            force: force.add_scalar(1.0),
            moment: moment.add_scalar(1.0),
            actuators: factors(self.actuator_error, self.actuators, &mut rng),
        }
    }

    /// Draws three numbers for each standard deviation of the maneuvered body. The underlying normal numbers depend on the seed
    /// only, not on the other deviations.
    #[cfg(test)]
    fn draw(&self) -> [Vector3<f64>; 6] {
        self.draw_from(&mut Pcg64Mcg::seed_from_u64(self.seed))
    }

    fn draw_from(&self, rng: &mut impl Rng) -> [Vector3<f64>; 6] {
        let [position, velocity, attitude, angular_velocity] = self.state.draw(rng);
        let [force, moment] =
            [self.force_error, self.moment_error].map(|deviation| deviation * normals(rng));
        [
            position,
            velocity,
            attitude,
            angular_velocity,
            force,
            moment,
        ]
    }

    /// Adds deviations to the bodies' states. `maneuvered` is the index of the maneuvered body.
    fn disturb(&self, maneuvered: usize, bodies: &[NamedBody], states: &mut [BodyState]) {
        let mut rng = Pcg64Mcg::seed_from_u64(self.seed);
        let [position, velocity, attitude, angular_velocity, ..] = self.draw_from(&mut rng);
        let first = [position, velocity, attitude, angular_velocity];
        let others = self.others.iter();
        let others = others.map(|(body, deviation)| (*body, deviation.draw(&mut rng)));
        for (body, deviations) in std::iter::once((maneuvered, first)).chain(others) {
            states[body] = deviated(&bodies[body].body, &states[body], &deviations);
        }
    }
}

impl StateDeviation {
    fn draw(&self, rng: &mut impl Rng) -> [Vector3<f64>; 4] {
        [
            self.position,
            self.velocity,
            self.attitude,
            self.angular_velocity,
        ]
        .map(|deviation| deviation * normals(rng))
    }
}

/// The state that deviates by these position, velocity, rotation vector and angular velocity.
fn deviated(
    body: &RigidBody,
    nominal: &BodyState,
    [position, velocity, attitude, angular_velocity]: &[Vector3<f64>; 4],
) -> BodyState {
    BodyState {
        position: nominal.position + position,
        linear_momentum: nominal.linear_momentum + body.mass() * velocity,
        attitude: nominal.attitude * exp(attitude),
        angular_momentum: nominal.angular_momentum + body.inertia().matrix() * angular_velocity,
    }
}

impl Scene {
    /// Returns the bodies' states at step 0 of the flight, including the deviations of the disturbance, if any.
    pub fn initial_states(&self) -> Vec<BodyState> {
        let mut states: Vec<_> = self.bodies.iter().map(|body| body.state).collect();
        if let (Some(disturbance), Some(maneuver)) = (&self.disturbance, &self.maneuver) {
            disturbance.disturb(maneuver.body, &self.bodies, &mut states);
        }
        states
    }

    /// Returns the index of the controlled body and the errors of its actuators, or `None` without a disturbance.
    pub fn actuator_errors(&self) -> Option<(usize, ActuatorErrors)> {
        let (disturbance, maneuver) = (self.disturbance.as_ref()?, self.maneuver.as_ref()?);
        Some((maneuver.body, disturbance.actuator_errors()))
    }

    /// Lets the thrusters or wheels that the maneuver commands err as the disturbance says in a simulation of the scene.
    pub fn disturb_actuators(&self, simulation: &mut Simulation) {
        if let (Some((_, errors)), Some(maneuver)) = (self.actuator_errors(), &self.maneuver) {
            errors.set(maneuver, simulation);
        }
    }
}

/// Draws the factors on so many actuators. None acts against its direction.
pub(crate) fn factors(deviation: f64, actuators: usize, rng: &mut impl Rng) -> Vec<f64> {
    let mut factor = || (1.0 + deviation * box_muller(rng)[0]).max(0.0);
    (0..actuators).map(|_| factor()).collect()
}

/// Draws three numbers from the standard normal distribution.
pub(crate) fn normals(rng: &mut impl Rng) -> Vector3<f64> {
    let [x, y] = box_muller(rng);
    let [z, _] = box_muller(rng);
    Vector3::new(x, y, z)
}

/// Draws two numbers from the standard normal distribution by the Box–Muller transform, `√(−2 ln u) (cos 2πv, sin
/// 2πv)`, `u ∈ (0, 1]`.
fn box_muller(rng: &mut impl Rng) -> [f64; 2] {
    let mut uniform = || (rng.next_u64() >> 11) as f64 * (0.5 * f64::EPSILON);
    let radius = (-2.0 * libm::log(1.0 - uniform())).sqrt();
    let angle = std::f64::consts::TAU * uniform();
    [radius * libm::cos(angle), radius * libm::sin(angle)]
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: Disturbance = Disturbance {
        seed: 0,
        force_error: 0.0,
        moment_error: 0.0,
        actuator_error: 0.0,
        actuators: 0,
        state: STILL,
        others: Vec::new(),
    };

    const STILL: StateDeviation = StateDeviation {
        position: 0.0,
        velocity: 0.0,
        attitude: 0.0,
        angular_velocity: 0.0,
    };

    fn initial_state(
        disturbance: &Disturbance,
        body: &RigidBody,
        nominal: &BodyState,
    ) -> BodyState {
        let [position, velocity, attitude, angular_velocity, ..] = disturbance.draw();
        let deviations = [position, velocity, attitude, angular_velocity];
        deviated(body, nominal, &deviations)
    }

    fn nominal() -> (RigidBody, BodyState) {
        let inertia = lgvi_dynamics::Inertia::principal([1.0, 2.0, 2.5]).unwrap();
        let body = RigidBody::new(2.0, inertia, Vec::new()).unwrap();
        let state = BodyState {
            position: Vector3::new(1.0, 2.0, 3.0),
            linear_momentum: Vector3::new(-1.0, 0.5, 0.1),
            attitude: exp(&Vector3::new(0.3, -0.2, 0.9)),
            angular_momentum: Vector3::new(0.1, 0.2, 0.3),
        };
        (body, state)
    }

    /// Checks the mean and variance of 3 × 4000 numbers within 5 standard errors, and likewise that the kurtosis is 3.
    #[test]
    fn deviations_are_standard_normal_over_the_seeds() {
        let sample: Vec<f64> = (0..4000)
            .flat_map(|seed| {
                let disturbance = Disturbance {
                    seed,
                    force_error: 0.01,
                    ..NONE
                };
                let factors = disturbance.actuator_errors().force;
                factors.map(|factor| (factor - 1.0) / 0.01).data.0[0]
            })
            .collect();
        let count = sample.len() as f64;
        let moment = |power| sample.iter().map(|n| n.powi(power)).sum::<f64>() / count;
        let within = |errors: f64| 5.0 * (errors / count).sqrt();
        assert!(moment(1).abs() < within(1.0), "{}", moment(1));
        assert!((moment(2) - 1.0).abs() < within(2.0), "{}", moment(2));
        assert!((moment(4) - 3.0).abs() < within(96.0), "{}", moment(4));
    }

    #[test]
    fn the_seed_decides_and_one_deviation_leaves_the_others_alone() {
        let (body, nominal) = nominal();
        let all = Disturbance {
            seed: 7,
            force_error: 0.01,
            moment_error: 0.02,
            state: StateDeviation {
                position: 0.1,
                velocity: 0.2,
                attitude: 0.3,
                angular_velocity: 0.4,
            },
            ..NONE
        };
        let state = initial_state(&all, &body, &nominal);
        assert_eq!(initial_state(&all, &body, &nominal), state);
        let other = Disturbance {
            seed: 8,
            ..all.clone()
        };
        assert_ne!(initial_state(&other, &body, &nominal), state);
        assert_ne!(other.actuator_errors(), all.actuator_errors());

        let lone = Disturbance {
            seed: 7,
            state: StateDeviation {
                angular_velocity: 0.4,
                ..STILL
            },
            ..NONE
        };
        let turned = initial_state(&lone, &body, &nominal);
        assert_eq!(turned.angular_momentum, state.angular_momentum);
        assert_eq!(turned.position, nominal.position);
        assert_eq!(lone.actuator_errors().force, Vector3::from_element(1.0));
        let none = Disturbance { seed: 7, ..NONE };
        assert_eq!(initial_state(&none, &body, &nominal), nominal);
    }

    /// Doubling the deviation doubles the difference, in the documented units and frames.
    #[test]
    fn deviations_are_those_of_velocity_and_rotation_vector() {
        let (body, nominal) = nominal();
        let of = |factor: f64| Disturbance {
            state: StateDeviation {
                velocity: 0.1 * factor,
                attitude: 0.01 * factor,
                angular_velocity: 0.1 * factor,
                ..STILL
            },
            ..NONE
        };
        let (small, large) = (of(1.0), of(2.0));
        let differences = |disturbance: &Disturbance| {
            let state = initial_state(disturbance, &body, &nominal);
            [
                state.velocity(&body) - nominal.velocity(&body),
                lgvi_lie::log(&nominal.attitude.tr_mul(&state.attitude)),
                state.angular_velocity(&body) - nominal.angular_velocity(&body),
            ]
        };
        let numbers = small.draw();
        let expected = [numbers[1], numbers[2], numbers[3]];
        let doubled = differences(&large);
        for ((found, expected), doubled) in differences(&small).iter().zip(expected).zip(doubled) {
            assert!((found - expected).norm() < 1e-14, "{found} for {expected}");
            assert!((doubled - 2.0 * expected).norm() < 1e-14);
        }
    }

    /// The numbers drawn are the same bits on every machine and in every version. An independent implementation of
    /// PCG64-MCG and Box–Muller in Python gives the same numbers up to the last digit.
    #[test]
    fn a_seed_means_the_same_for_ever() {
        let disturbance = Disturbance {
            seed: 1,
            state: StateDeviation {
                position: 1.0,
                ..STILL
            },
            ..NONE
        };
        let found = disturbance.draw()[0];
        let expected = [1.27971822791747, 1.4993966374080392, -0.16764612222754166];
        assert_eq!(<[f64; 3]>::from(found), expected);
    }

    #[test]
    fn each_actuator_has_a_factor_that_other_deviations_leave_alone() {
        let five = Disturbance {
            seed: 3,
            actuator_error: 0.1,
            actuators: 5,
            ..NONE
        };
        let factors = five.actuator_errors().actuators;
        let three = Disturbance {
            force_error: 0.2,
            actuators: 3,
            ..five.clone()
        };
        assert_eq!(three.actuator_errors().actuators, factors[..3]);
        let large = Disturbance {
            actuator_error: 1e3,
            ..five
        };
        let signs = large.actuator_errors().actuators;
        for (factor, large) in factors.iter().zip(signs) {
            assert_eq!(*factor < 1.0, large == 0.0, "{factor} {large}");
        }
        assert!(factors.iter().any(|factor| *factor < 1.0));
        assert!(factors.iter().all(|factor| *factor != 1.0));
    }

    #[test]
    fn errors_scale_the_axes_of_a_control() {
        let errors = ActuatorErrors {
            force: Vector3::new(1.0, 0.5, 2.0),
            moment: Vector3::new(-1.0, 1.0, 0.0),
            ..ActuatorErrors::none(0)
        };
        let load = Load {
            force: Vector3::new(1.0, 2.0, 3.0),
            moment: Vector3::new(4.0, 5.0, 6.0),
        };
        let acting = errors.apply(&load);
        assert_eq!(acting.force, Vector3::new(1.0, 1.0, 6.0));
        assert_eq!(acting.moment, Vector3::new(-4.0, 5.0, 0.0));
    }
}
