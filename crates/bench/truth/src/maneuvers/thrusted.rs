//! Maneuvers from rest to rest by one-sided thrusters that turn with the body.
//!
//! **Thrusters.** Twelve: on each axis two to each side, at arms of 0.5 to 1.5 times the body's radius of gyration, with
//! directions that are off by some 0.1 rad. Prices are uniform in 0.5 … 2. All have one limit: 1.5 to 4 times half of the
//! force with which a force and a moment that switch once would move and turn the body.
//!
//! **Ends.** Distances are log-uniform in 0.3 … 3, attitudes uniform on SO(3), durations log-uniform in 1 … 10.
//!
//! Even indices cost the squares of the thrusts, odd ones the thrusts: minimum fuel.

use lgvi_control::constraint::CommandLimit;
use lgvi_control::{Actuation, Constraint, Dynamics, Transfer};
use lgvi_dynamics::RigidBody;
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::thrusters::{Propellant, Thruster, Thrusters};
use nalgebra::Vector3;

use super::ManeuverError;
use super::varied::{at_rest, brick};
use crate::random::Random;

/// A maneuver by thrusters.
#[derive(Clone)]
pub struct Thrusted {
    /// The controlled body, with its thrusters.
    pub body: RigidBody,
    /// Weights or prices of their commands.
    pub prices: Vec<f64>,
    /// True if the prices are those of the commands, not of their squares.
    pub fuel: bool,
    /// Limits of the commands.
    pub limits: Constraint,
    /// The optimal control problem.
    pub transfer: Transfer,
}

/// Returns maneuver `index` of `seed` with this number of steps.
pub fn thrusted(seed: u64, index: u64, intervals: usize) -> Result<Thrusted, ManeuverError> {
    let mut random = Random::new(seed, index);
    let random = &mut random;
    let body = brick(random)?;
    let gyration = (0.5 * body.inertia().matrix().trace() / body.mass()).sqrt();
    let (apart, ends) = at_rest(random);
    let duration = random.log_uniform(1.0, 10.0);

    let turn = lgvi_lie::log(&ends[0].attitude.tr_mul(&ends[1].attitude));
    let force = 4.0 * body.mass() * apart.norm() / (duration * duration);
    let moment = 4.0 * (body.inertia().matrix() * turn).norm() / (duration * duration);
    let limit = 0.5 * random.uniform(1.5, 4.0) * (force + moment / gyration);

    let mut thrusters = Vec::new();
    for axis in 0..3 {
        for side in [1.0, -1.0] {
            for sign in [1.0, -1.0] {
                let length = random.uniform(0.5, 1.5) * gyration;
                let place = side * length * Vector3::ith((axis + 1) % 3, 1.0);
                let direction = sign * Vector3::ith(axis, 1.0) + 0.1 * random.normals();
                thrusters.push(Thruster::new(place, direction, limit));
            }
        }
    }
    let prices: Vec<_> = thrusters.iter().map(|_| random.uniform(0.5, 2.0)).collect();
    let none = Propellant {
        mass: 0.0,
        inertia: None,
    };
    let limits = vec![limit; thrusters.len()];
    let thrusters = Thrusters::new(thrusters, none)?;
    let limits = Constraint::commands(CommandLimit::new(&limits)?.one_sided());
    let constraints = std::slice::from_ref(&limits);
    let fuel = !index.is_multiple_of(2);
    let quadratic = Actuation::thrusters(&thrusters, &prices)?;
    let actuation = if fuel {
        quadratic.minimizing_fuel(constraints)?
    } else {
        quadratic
    };
    let h = duration / intervals as f64;
    let field = Central { gm: 0.0 };
    let transfer = Transfer::new(
        body.clone(),
        field,
        h,
        intervals,
        ends[0],
        ends[1],
        actuation,
    )?;
    Ok(Thrusted {
        body: body.with_thrusters(thrusters)?,
        prices,
        fuel,
        transfer: transfer
            .with_dynamics(Dynamics::Lgvi)
            .with_constraints(constraints),
        limits,
    })
}
