//! Random maneuvers for tests of the planner. The same seed and index give the same transfer on every machine.
//!
//! In the units used, lengths, times, masses and, in orbit, `GM` are of the order of 1.
//!
//! **Bodies.** The mass is log-uniform in 0.5 … 2. Bodies of rest-to-rest maneuvers have a radius of gyration
//! log-uniform in 0.1 … 0.5. The ratios of their second moments of mass to the greatest one are log-uniform in 0.008 …
//! 1, and in 0.008 … 0.03 for one third of the bodies. Inertias therefore satisfy the triangle inequality, and many are
//! as slender as 1 : 30. For one half of the bodies, the body frame is not the principal one. Gravity acts at the
//! center of mass or, if it has a gradient, on six points. Bodies in orbit are dumbbells or three pairs of points on
//! axes of unequal length. Dumbbells have a length of 0.05 … 0.4 and spheres with radii of 0.1 … 0.5 times the length
//! (ratio of axial to transverse inertia 0.016 … 0.29).
//!
//! **Weights.** All weights are diagonal. Those of forces are log-uniform in 0.3 … 3. Those of moments are log-uniform
//! in 0.03 … 3, divided by the square of the body's radius of gyration `ρ = √(tr J / 2m)`, because thrusters at the
//! radius of gyration convert a force to a moment (in the paper's examples the weight is 0.036/ρ²). With weights
//! independent of the body's size, turning a small body would contribute 10⁻⁸ of the cost, and its plan would be
//! dominated by rounding errors.
//!
//! **Rest to rest.** Attitudes are uniform on SO(3) at both ends, distances log-uniform in 0.1 … 5, durations
//! log-uniform in 1 … 10. There is no gravity, a uniform field of up to 0.1, or the field of an attractor so far away
//! that a circular orbit at that distance would turn by 0.05 … 0.5 rad in the duration.
//!
//! **Orbit to orbit.** Kepler elements are drawn for both ends: semi-major axis log-uniform in 1 … 2.5, eccentricity
//! uniform in 0 … 0.5, plane, periapsis and mean anomaly uniform (half of the orbits are retrograde). Attitude and spin
//! either follow the orbit (body x along the velocity, z along the orbit's normal, one turn per revolution), or the
//! attitude is uniform on SO(3) with a spin of up to one mean motion about any axis. Durations are 0.1 … 0.7 of the
//! shorter period.
//!
//! The ends are drawn again while the path of least effort without gravity, a cubic in time, comes closer to the
//! attractor than half of the smaller periapsis distance. This excludes paths forced through the attractor, though a
//! plan may still fly by closely.
//!
//! The number of steps is 50 to 200 in both classes.

mod orbit;
mod phased;
mod rest;
mod thrusted;
mod uncertain;
mod varied;
mod wheeled;

use lgvi_control::{Actuation, ActuationError, ParameterError, Transfer, TransferError};
use lgvi_dynamics::gravity::{Field, Sources};
use lgvi_dynamics::thrusters::ThrusterError;
use lgvi_dynamics::wheels::WheelError;
use lgvi_dynamics::{BodyError, BodyState, InertiaError, PointMass, RigidBody};
use nalgebra::{Matrix3, Vector3};
use thiserror::Error;

use crate::random::Random;
pub use phased::{Phased, phased};
pub use thrusted::{Thrusted, thrusted};
pub use uncertain::{Uncertain, uncertain};
pub use varied::{Family, Varied, varied};
pub use wheeled::{Wheeled, wheeled};

/// The seed of the published success rates.
pub const SEED: u64 = 1;

/// The class of a maneuver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// From rest to rest.
    RestToRest,
    /// From one orbit to another.
    OrbitToOrbit,
}

impl Class {
    /// All classes.
    pub const ALL: [Self; 2] = [Self::RestToRest, Self::OrbitToOrbit];

    /// Returns the name of the class.
    pub fn name(self) -> &'static str {
        match self {
            Self::RestToRest => "rest to rest",
            Self::OrbitToOrbit => "orbit to orbit",
        }
    }
}

/// A random maneuver.
#[derive(Clone)]
pub struct Maneuver {
    /// The class.
    pub class: Class,
    /// The controlled body.
    pub body: RigidBody,
    /// The gravitational field.
    pub field: Sources,
    /// The optimal control problem.
    pub transfer: Transfer,
}

/// The reason that a maneuver cannot be created. The random numbers drawn never cause an error.
#[derive(Debug, Error)]
pub enum ManeuverError {
    /// The inertia is invalid.
    #[error(transparent)]
    Inertia(#[from] InertiaError),
    /// The body is invalid.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// The thrusters are invalid.
    #[error(transparent)]
    Thrusters(#[from] ThrusterError),
    /// The wheels are invalid.
    #[error(transparent)]
    Wheels(#[from] WheelError),
    /// The weights are invalid.
    #[error(transparent)]
    Actuation(#[from] ActuationError),
    /// The transfer is invalid.
    #[error(transparent)]
    Transfer(#[from] TransferError),
    /// A constraint is invalid.
    #[error(transparent)]
    Constraint(#[from] ParameterError),
}

/// Returns maneuver `index` of `seed`. Even indices are rest to rest, odd ones orbit to orbit.
pub fn maneuver(seed: u64, index: u64) -> Result<Maneuver, ManeuverError> {
    let mut random = Random::new(seed, index);
    let intervals = 50 + random.below(151);
    if index.is_multiple_of(2) {
        rest::to_rest(&mut random, intervals)
    } else {
        orbit::to_orbit(&mut random, intervals)
    }
}

fn finish(
    random: &mut Random,
    class: Class,
    body: RigidBody,
    gravity: Vec<Box<dyn Field>>,
    h: f64,
    intervals: usize,
    [initial, target]: [BodyState; 2],
) -> Result<Maneuver, ManeuverError> {
    let field = Sources::new(gravity);
    let mut weight = |least: f64| {
        Matrix3::from_diagonal(&Vector3::from_fn(|_, _| random.log_uniform(least, 3.0)))
    };
    // Thrusters at the radius of gyration convert a force to a moment.
    let squared_radius = 0.5 * body.inertia().matrix().trace() / body.mass();
    let actuation = Actuation::full(&weight(0.3), &(weight(0.03) / squared_radius))?;
    Ok(Maneuver {
        class,
        transfer: Transfer::new(
            body.clone(),
            field.clone(),
            h,
            intervals,
            initial,
            target,
            actuation,
        )?,
        body,
        field,
    })
}

/// Returns three pairs of equal points. The mean squares of their coordinates along the columns of `frame` are
/// `spread`.
fn pairs(mass: f64, frame: &Matrix3<f64>, spread: &Vector3<f64>) -> Vec<PointMass> {
    let arms = (0..3).map(|axis| frame.column(axis) * (3.0 * spread[axis]).sqrt());
    let pair = |arm: Vector3<f64>| [arm, -arm];
    let point = |position| PointMass {
        mass: mass / 6.0,
        position,
    };
    arms.flat_map(pair).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_maneuver_is_a_function_of_seed_and_index() {
        for index in 0..20 {
            let [once, again] = [0, 1].map(|_| maneuver(SEED, index).unwrap());
            assert_eq!(once.transfer.initial(), again.transfer.initial());
            assert_eq!(once.transfer.target(), again.transfer.target());
            assert_eq!(once.transfer.h(), again.transfer.h());
            let other = maneuver(SEED + 1, index).unwrap();
            assert_ne!(once.transfer.target(), other.transfer.target());
        }
    }

    /// Published rates refer to maneuvers by index, so their bits must not change.
    #[test]
    fn the_first_maneuvers_are_those_of_the_published_rates() {
        let h = [0, 1].map(|index| maneuver(SEED, index).unwrap().transfer.h().to_bits());
        assert_eq!(h, [4590078863218111707, 4588552789827826655]);
    }

    #[test]
    fn ends_in_orbit_are_on_bound_orbits_and_the_range_of_shapes_is_covered() {
        let mut least = 1.0_f64;
        let mut greatest_turn = 0.0_f64;
        for index in 0..400 {
            let Maneuver {
                class,
                body,
                transfer,
                ..
            } = maneuver(SEED, index).unwrap();
            let n = transfer.intervals();
            assert!((50..=200).contains(&n));
            let moments = Vector3::from(body.inertia().principal_moments());
            least = least.min(moments.min() / moments.max());
            let (initial, target) = (transfer.initial(), transfer.target().state().unwrap());
            greatest_turn =
                greatest_turn.max(lgvi_lie::log(&initial.attitude.tr_mul(&target.attitude)).norm());
            let duration = transfer.h() * n as f64;
            if class == Class::RestToRest {
                assert_eq!(
                    initial.linear_momentum.norm() + target.linear_momentum.norm(),
                    0.0
                );
                continue;
            }
            let periods = [*initial, target].map(|state| {
                let (r, v) = (state.position, state.velocity(&body));
                let semi_major_axis = 0.5 / (1.0 / r.norm() - 0.5 * v.norm_squared());
                assert!(semi_major_axis > 0.999 && semi_major_axis < 2.501);
                std::f64::consts::TAU * semi_major_axis.powf(1.5)
            });
            let part = duration / periods[0].min(periods[1]);
            assert!(part > 0.099 && part < 0.701, "{part}");
        }
        assert!(least < 0.03, "{least}");
        assert!(greatest_turn > 3.0, "{greatest_turn}");
    }
}
