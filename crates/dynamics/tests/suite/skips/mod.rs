//! Omissions in a simulation: their bounds hold, nothing more is omitted, and interactions are restored when needed.

mod bounds;
mod coasting;
mod levels;
mod tolerance;

use lgvi_dynamics::gravity::{Gravity, Mutual};
use lgvi_dynamics::{
    BodyState, Inertia, Load, Method, PointMass, RigidBody, Simulation, Skip, System,
};
use lgvi_truth::random::Random;
use nalgebra::Vector3;

fn inertia(moments: [f64; 3]) -> Inertia {
    Inertia::principal(moments).expect("an inertia")
}

/// A body that attracts as a point.
fn ball(mass: f64) -> RigidBody {
    let moments = [0.4, 0.5, 0.6].map(|moment| mass * moment);
    RigidBody::new(mass, inertia(moments), vec![]).expect("a body")
}

/// Two equal points, `length` apart.
fn dumbbell(mass: f64, length: f64) -> RigidBody {
    let points = [0.5, -0.5].map(|end| PointMass {
        mass: 0.5 * mass,
        position: Vector3::new(end * length, 0.0, 0.0),
    });
    let square = mass * length * length;
    let moments = [0.05 * square, 0.3 * square, 0.3 * square];
    RigidBody::new(mass, inertia(moments), points.into()).expect("a body")
}

fn state(
    body: &RigidBody,
    position: [f64; 3],
    velocity: [f64; 3],
    random: &mut Random,
) -> BodyState {
    let (attitude, spin) = (random.rotation(), 0.3 * random.normals());
    BodyState::from_velocities(body, position.into(), velocity.into(), attitude, spin)
}

fn mutual(constant: f64) -> Vec<Box<dyn Gravity>> {
    vec![Box::new(Mutual::new(constant))]
}

/// Makes `steps` steps without controls.
fn fly(
    (bodies, gravity): (&[RigidBody], Vec<Box<dyn Gravity>>),
    states: &[BodyState],
    method: Method,
    (h, steps): (f64, u32),
    skip: Skip,
) -> Simulation {
    let system = System::new(bodies.to_vec(), gravity);
    let simulation = Simulation::new(system, states.to_vec(), method, h);
    let mut simulation = simulation.expect("a simulation").with_skips(skip);
    let controls = vec![Load::default(); states.len()];
    for _ in 0..steps {
        simulation.advance(&controls).expect("a step");
    }
    simulation
}
