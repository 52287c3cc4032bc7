//! A user-defined gravity model: a harmonic potential that pulls bodies to the origin.

#![allow(clippy::print_stdout)]

use lgvi_dynamics::gravity::Gravity;
use lgvi_dynamics::{BodyState, Inertia, Load, Method, RigidBody, Simulation, System};
use nalgebra::{Matrix3, Vector3};

/// `U = ½ k |x|²`.
struct Spring {
    stiffness: f64,
}

impl Gravity for Spring {
    fn add_loads(&mut self, _bodies: &[RigidBody], states: &[BodyState], loads: &mut [Load]) {
        for (state, load) in states.iter().zip(loads) {
            load.force -= self.stiffness * state.position;
        }
    }

    fn potential(&self, _bodies: &[RigidBody], states: &[BodyState]) -> f64 {
        let squared: f64 = states
            .iter()
            .map(|state| state.position.norm_squared())
            .sum();
        0.5 * self.stiffness * squared
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let body = RigidBody::new(1.0, Inertia::principal([1.0, 2.0, 2.5])?, vec![])?;
    let (at_rest, spin) = (Vector3::zeros(), Vector3::new(0.1, 2.0, 0.1));
    let state = BodyState::from_velocities(&body, Vector3::x(), at_rest, Matrix3::identity(), spin);
    let system = System::new(vec![body], vec![Box::new(Spring { stiffness: 1.0 })]);
    let steps = 1000;
    let h = std::f64::consts::TAU / f64::from(steps);
    let mut simulation = Simulation::new(system, vec![state], Method::Nystrom { order: 8 }, h)?;
    let before = simulation.invariants().energy;
    for _ in 0..steps {
        simulation.advance(&[Load::default()])?;
    }
    let miss = (simulation.states()[0].position - Vector3::x()).norm();
    let change = simulation.invariants().energy - before;
    println!("after one period {miss:.1e} off, energy changed by {change:.1e}");
    Ok(())
}
