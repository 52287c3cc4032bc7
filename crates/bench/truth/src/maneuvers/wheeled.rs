//! Turns from rest to rest by reaction wheels that spin.
//!
//! **Wheels.** Three to six. The axes of the first three are off the body's axes by some 0.3 rad, the others' are uniform. Inertias
//! are uniform in 0.5 … 2 % of the body's least. The momenta at the start are some 0.1 to 10 times that of the body at the mean rate of
//! the turn. Weights are uniform in 0.5 … 2. All have one limit of torque: 1.5 to 4 times the moment that would turn the body by
//! switching once and turn with it what the wheels store.
//!
//! **Ends.** Attitudes are uniform on SO(3), durations log-uniform in 1 … 10.

use lgvi_control::constraint::CommandLimit;
use lgvi_control::{Actuation, Constraint, Dynamics, Motion, Transfer};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::wheels::{ReactionWheel, WheelState, Wheels};
use lgvi_dynamics::{BodyState, RigidBody};
use nalgebra::Vector3;

use super::ManeuverError;
use super::varied::{at_rest, brick};
use crate::random::Random;

/// A turn by reaction wheels.
#[derive(Clone)]
pub struct Wheeled {
    /// The controlled body, with its wheels.
    pub body: RigidBody,
    /// Weights of their torques.
    pub weights: Vec<f64>,
    /// The optimal control problem.
    pub transfer: Transfer,
}

/// Returns turn `index` of `seed` with this number of steps.
pub fn wheeled(seed: u64, index: u64, intervals: usize) -> Result<Wheeled, ManeuverError> {
    let mut random = Random::new(seed, index);
    let random = &mut random;
    let body = brick(random)?;
    let (_, ends) = at_rest(random);
    let [initial, target] = ends.map(|end| BodyState {
        position: Vector3::x(),
        ..end
    });
    let duration = random.log_uniform(1.0, 10.0);
    let turn = lgvi_lie::log(&initial.attitude.tr_mul(&target.attitude)).norm();
    let greatest = body.inertia().matrix().amax();
    let own = greatest * turn / duration;
    let stored = random.log_uniform(0.1, 10.0) * own;
    let limit = random.uniform(1.5, 4.0) * (4.0 * own + stored * turn) / duration;

    let count = 3 + random.below(4);
    let mut wheels = Vec::new();
    for index in 0..count {
        let axis = match index {
            0..3 => Vector3::ith(index, 1.0) + 0.3 * random.normals(),
            _ => random.direction(),
        };
        let inertia = random.uniform(0.005, 0.02) * body.inertia().matrix().diagonal().min();
        wheels.push(ReactionWheel {
            max_torque: limit,
            ..ReactionWheel::new(axis, inertia)
        });
    }
    let mut wheels = Wheels::new(wheels)?;
    let each = (count as f64).sqrt();
    let momentum = |random: &mut Random| stored * random.uniform(-1.0, 1.0) / each;
    let states = (0..count).map(|_| WheelState {
        momentum: momentum(random),
        ..WheelState::default()
    });
    let states: Vec<_> = states.collect();
    wheels.set_states(&states);
    let weights: Vec<_> = (0..count).map(|_| random.uniform(0.5, 2.0)).collect();
    let actuation = Actuation::wheels(&wheels, &weights)?;
    let body = body.with_wheels(wheels)?;
    let transfer = Transfer::new(
        body.clone(),
        Central { gm: 0.0 },
        duration / intervals as f64,
        intervals,
        initial,
        target,
        actuation,
    )?;
    let limits = CommandLimit::new(&vec![limit; count])?;
    Ok(Wheeled {
        body,
        weights,
        transfer: transfer
            .with_dynamics(Dynamics::Lgvi)
            .with_motion(Motion::Rotation)
            .with_constraints(&[Constraint::commands(limits)]),
    })
}
