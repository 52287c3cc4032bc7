use lgvi_dynamics::gravity::{Central, Field, Fixed, Uniform};
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use nalgebra::{Matrix3, Vector3};

use super::{Class, Maneuver, ManeuverError, finish, pairs};
use crate::random::Random;

/// Draws a maneuver from rest to rest.
pub(super) fn to_rest(random: &mut Random, intervals: usize) -> Result<Maneuver, ManeuverError> {
    let duration = random.log_uniform(1.0, 10.0);
    let mass = random.log_uniform(0.5, 2.0);
    let widest = if random.below(3) == 0 { 0.03 } else { 1.0 };
    let mut ratio = || random.log_uniform(0.008, widest);
    let axes = Vector3::new(1.0, ratio(), ratio());
    let gyration = random.log_uniform(0.1, 0.5);
    // Mean squares of the coordinates of the mass along the principal axes.
    let spread = axes * (gyration * gyration / axes.sum());
    let frame = if random.below(2) == 0 {
        Matrix3::identity()
    } else {
        random.rotation()
    };
    let axial = Matrix3::from_diagonal_element(spread.sum()) - Matrix3::from_diagonal(&spread);
    let inertia = Inertia::new(mass * frame * axial * frame.transpose())?;
    let mut points = Vec::new();
    let gravity: Vec<Box<dyn Field>> = match random.below(3) {
        0 => vec![],
        1 => vec![Box::new(Uniform {
            acceleration: random.uniform(0.0, 0.1) * random.direction(),
        })],
        _ => {
            let distance = random.uniform(20.0, 50.0);
            let rate = random.uniform(0.05, 0.5) / duration;
            let central = Central {
                gm: rate * rate * distance * distance * distance,
            };
            points = pairs(mass, &frame, &spread);
            let place = distance * random.direction();
            vec![Box::new(Fixed::new(central, place, Matrix3::identity()))]
        }
    };
    let body = RigidBody::new(mass, inertia, points)?;
    let apart = random.log_uniform(0.1, 5.0) * random.direction();
    let mut at_rest = |position| BodyState {
        position,
        linear_momentum: Vector3::zeros(),
        attitude: random.rotation(),
        angular_momentum: Vector3::zeros(),
    };
    let ends = [at_rest(Vector3::zeros()), at_rest(apart)];
    let h = duration / intervals as f64;
    finish(random, Class::RestToRest, body, gravity, h, intervals, ends)
}
