//! A plan around a user-defined obstacle: `cargo run --release -p lgvi_control --example plan`.

#![allow(clippy::print_stdout)]

use lgvi_control::constraint::{Coordinates, StateConstraint};
use lgvi_control::nalgebra::{Matrix3, Vector3};
use lgvi_control::{Actuation, Constraint, NewtonSettings, Start, Transfer, solve};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::{BodyState, Inertia, RigidBody};

/// A cylinder along z to be avoided: `g = ½ (1 − (x² + y²)/r²)` about its axis.
#[derive(Debug, PartialEq)]
struct Cylinder(Vector3<f64>, f64);

impl StateConstraint for Cylinder {
    fn name(&self) -> &'static str {
        "keep_out_cylinder"
    }
    fn coordinates(&self) -> Coordinates {
        Coordinates::Position
    }
    fn value(&self, state: &BodyState) -> f64 {
        0.5 * (1.0 - (state.position - self.0).xy().norm_squared() / self.1.powi(2))
    }
    fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        let across = Vector3::new(1.0, 1.0, 0.0) / -self.1.powi(2);
        let arm = state.position - self.0;
        (across.component_mul(&arm), Matrix3::from_diagonal(&across))
    }
    fn size(&self) -> f64 {
        self.1
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let body = RigidBody::new(1.0, Inertia::principal([0.01, 0.02, 0.025])?, vec![])?;
    let (still, upright) = (Vector3::zeros(), Matrix3::identity());
    let initial = BodyState::from_velocities(&body, Vector3::x(), Vector3::y(), upright, still);
    let target = BodyState::from_velocities(&body, 1.1 * Vector3::y(), still, upright, still);
    let actuation = Actuation::full(&upright, &upright)?;
    let field = Central { gm: 1.0 };
    let transfer = Transfer::new(body, field, 0.02, 80, initial, target, actuation)?;
    let free = solve(&transfer, Start::Cold, &NewtonSettings::default(), |_| true)?;
    let obstacle = Constraint::state(Cylinder(free.states[40].position, 0.2));
    let transfer = transfer.with_constraints(&[obstacle]);
    let plan = solve(&transfer, Start::Cold, &NewtonSettings::default(), |_| true)?;
    println!("cost {:.6}, past it {:.6}", free.cost, plan.cost);
    Ok(())
}
