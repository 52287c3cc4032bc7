//! Newton's iteration of the planner.

use std::hint::black_box;

use lgvi_control::{Actuation, NewtonSettings, PlanError, Start, Transfer, solve};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::{BodyState, Inertia, PointMass, RigidBody};
use nalgebra::{Matrix3, Vector3};

use super::Kernel;

const INTERVALS: usize = 100;

/// More than there are would be of no use, fewer would count the beginning.
const ITERATIONS: u32 = 5;

/// A quarter of a circle later, and a quarter turned.
fn transfer() -> Transfer {
    let inertia = Inertia::principal([0.1, 1.0, 1.0]).expect("inertia");
    let ends = [0.25, -0.25].map(|x| PointMass {
        mass: 0.5,
        position: Vector3::new(x, 0.0, 0.0),
    });
    let body = RigidBody::new(1.0, inertia, ends.to_vec()).expect("a body");
    let state = |position, velocity, attitude| {
        BodyState::from_velocities(&body, position, velocity, attitude, Vector3::zeros())
    };
    let quarter = *nalgebra::Rotation3::new(Vector3::new(0.0, 0.0, 1.5)).matrix();
    let initial = state(Vector3::x() * 2.0, Vector3::y() * 0.7, Matrix3::identity());
    let target = state(Vector3::y() * 2.0, Vector3::x() * -0.7, quarter);
    let identity = Matrix3::identity();
    let actuation = Actuation::full(&identity, &identity).expect("weights");
    let h = 4.4 / INTERVALS as f64;
    let field = Central { gm: 1.0 };
    Transfer::new(body, field, h, INTERVALS, initial, target, actuation).expect("a transfer")
}

/// Some iterations of one resolution, with what it takes to begin and to end.
fn solve_in_part(transfer: &mut Transfer) -> u32 {
    let settings = NewtonSettings {
        coarse: INTERVALS,
        ..NewtonSettings::default()
    };
    let mut seen = 0;
    let ended = solve(black_box(transfer), Start::Cold, &settings, |_| {
        seen += 1;
        seen < ITERATIONS
    });
    assert!(
        matches!(ended, Err(PlanError::Stopped { .. })),
        "{seen} iterations"
    );
    seen
}

pub(super) fn kernels() -> Vec<Kernel> {
    let kernel = Kernel::new("planner", "newton_iterations", transfer, solve_in_part);
    vec![kernel]
}
