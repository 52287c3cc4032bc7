use lgvi_dynamics::{BodyState, Load, RigidBody};
use lgvi_lie::exp;
use nalgebra::Vector3;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::Scene;

/// What sets a flight apart from its plan: standard deviations, in the scene's units, of the maneuverd body's initial state
/// and of its actuators' errors. The seed decides what they come to, the same on every machine.
///
/// # Assumptions and limitations
/// - All deviations are normally distributed and independent of each other, axis by axis.
/// - An actuator's error is a factor that stays the same over the flight; it acts on the axes in which the control is given,
///   inertial ones for the force and those of the body for the moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disturbance {
    /// What decides.
    pub seed: u64,
    /// Of the factor of each component of the force.
    pub force_error: f64,
    /// Of the factor of each component of the moment.
    pub moment_error: f64,
    /// Of each component of `x`.
    pub position: f64,
    /// Of each component of `ẋ`.
    pub velocity: f64,
    /// Of each component of the rotation vector `v` (rad), by which the attitude is `R exp(v)`.
    pub attitude: f64,
    /// Of each component of `Ω`, body frame.
    pub angular_velocity: f64,
}

/// Factors by which a control acts other than it is meant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActuatorErrors {
    /// Of the force's components, inertial frame.
    pub force: Vector3<f64>,
    /// Of the moment's components, body frame.
    pub moment: Vector3<f64>,
}

impl ActuatorErrors {
    /// What acts where `load` is meant.
    pub fn apply(&self, load: &Load) -> Load {
        Load {
            force: load.force.component_mul(&self.force),
            moment: load.moment.component_mul(&self.moment),
        }
    }
}

impl Disturbance {
    /// The errors of the actuators.
    pub fn actuator_errors(&self) -> ActuatorErrors {
        let [.., force, moment] = self.draw();
        ActuatorErrors {
            force: force.add_scalar(1.0),
            moment: moment.add_scalar(1.0),
        }
    }

    /// The state in which `body` starts instead of its nominal one.
    pub fn initial_state(&self, body: &RigidBody, nominal: &BodyState) -> BodyState {
        let [position, velocity, attitude, angular_velocity, ..] = self.draw();
        BodyState {
            position: nominal.position + position,
            linear_momentum: nominal.linear_momentum + body.mass() * velocity,
            attitude: nominal.attitude * exp(&attitude),
            angular_momentum: nominal.angular_momentum + body.inertia().matrix() * angular_velocity,
        }
    }

    /// What the seed makes of the standard deviations: three numbers of each, the same ones whatever the others are.
    fn draw(&self) -> [Vector3<f64>; 6] {
        let mut rng = Pcg64Mcg::seed_from_u64(self.seed);
        [
            self.position,
            self.velocity,
            self.attitude,
            self.angular_velocity,
            self.force_error,
            self.moment_error,
        ]
        .map(|deviation| deviation * normals(&mut rng))
    }
}

impl Scene {
    /// The bodies' states at step 0 as they are flown: with the deviations of the disturbance if there is one.
    pub fn initial_states(&self) -> Vec<BodyState> {
        let mut states: Vec<_> = self.bodies.iter().map(|body| body.state).collect();
        if let (Some(disturbance), Some(maneuver)) = (&self.disturbance, &self.maneuver) {
            let body = &self.bodies[maneuver.body].body;
            let state = &mut states[maneuver.body];
            *state = disturbance.initial_state(body, state);
        }
        states
    }

    /// Which body's controls act other than they are meant, and by how much; `None` without a disturbance.
    pub fn actuator_errors(&self) -> Option<(usize, ActuatorErrors)> {
        let (disturbance, maneuver) = (self.disturbance.as_ref()?, self.maneuver.as_ref()?);
        Some((maneuver.body, disturbance.actuator_errors()))
    }
}

/// Three numbers of the standard normal distribution.
pub(crate) fn normals(rng: &mut impl Rng) -> Vector3<f64> {
    let [x, y] = box_muller(rng);
    let [z, _] = box_muller(rng);
    Vector3::new(x, y, z)
}

/// Two numbers of the standard normal distribution by Box and Muller, `√(−2 ln u) (cos 2πv, sin 2πv)`, `u ∈ (0, 1]`.
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
        position: 0.0,
        velocity: 0.0,
        attitude: 0.0,
        angular_velocity: 0.0,
    };

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

    /// A sample of 3 × 4000 numbers: mean and variance within 5 of their standard errors, and so the kurtosis 3.
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
            position: 0.1,
            velocity: 0.2,
            attitude: 0.3,
            angular_velocity: 0.4,
        };
        let state = all.initial_state(&body, &nominal);
        assert_eq!(all.initial_state(&body, &nominal), state);
        let other = Disturbance { seed: 8, ..all };
        assert_ne!(other.initial_state(&body, &nominal), state);
        assert_ne!(other.actuator_errors(), all.actuator_errors());

        let lone = Disturbance {
            angular_velocity: 0.4,
            ..Disturbance { seed: 7, ..NONE }
        };
        let turned = lone.initial_state(&body, &nominal);
        assert_eq!(turned.angular_momentum, state.angular_momentum);
        assert_eq!(turned.position, nominal.position);
        assert_eq!(lone.actuator_errors().force, Vector3::from_element(1.0));
        let none = Disturbance { seed: 7, ..NONE };
        assert_eq!(none.initial_state(&body, &nominal), nominal);
    }

    /// Twice the deviation is twice the difference, in the units and frames that are said.
    #[test]
    fn deviations_are_those_of_velocity_and_rotation_vector() {
        let (body, nominal) = nominal();
        let small = Disturbance {
            velocity: 0.1,
            attitude: 0.01,
            angular_velocity: 0.1,
            ..NONE
        };
        let large = Disturbance {
            velocity: 0.2,
            attitude: 0.02,
            angular_velocity: 0.2,
            ..NONE
        };
        let differences = |disturbance: Disturbance| {
            let state = disturbance.initial_state(&body, &nominal);
            [
                state.velocity(&body) - nominal.velocity(&body),
                lgvi_lie::log(&nominal.attitude.tr_mul(&state.attitude)),
                state.angular_velocity(&body) - nominal.angular_velocity(&body),
            ]
        };
        let numbers = small.draw();
        let expected = [numbers[1], numbers[2], numbers[3]];
        let doubled = differences(large);
        for ((found, expected), doubled) in differences(small).iter().zip(expected).zip(doubled) {
            assert!((found - expected).norm() < 1e-14, "{found} for {expected}");
            assert!((doubled - 2.0 * expected).norm() < 1e-14);
        }
    }

    /// The same bits on every machine and in every version: numbers that PCG64-MCG and Box–Muller, written anew in Python,
    /// give as well, to the last digit but one.
    #[test]
    fn a_seed_means_the_same_for_ever() {
        let disturbance = Disturbance {
            seed: 1,
            position: 1.0,
            ..NONE
        };
        let found = disturbance.draw()[0];
        let expected = [1.27971822791747, 1.4993966374080392, -0.16764612222754166];
        assert_eq!(<[f64; 3]>::from(found), expected);
    }

    #[test]
    fn errors_scale_the_axes_of_a_control() {
        let errors = ActuatorErrors {
            force: Vector3::new(1.0, 0.5, 2.0),
            moment: Vector3::new(-1.0, 1.0, 0.0),
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
