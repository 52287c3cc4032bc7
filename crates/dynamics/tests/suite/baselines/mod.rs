//! Tests of the baseline methods.

mod error_control;
mod invariants;
mod limits;
mod orders;

use lgvi_dynamics::gravity::{Gravity, Mutual};
use lgvi_dynamics::{BodyState, Inertia, Method, PointMass, RigidBody, System};
use nalgebra::{Matrix3, Vector3};

const A1: &str = "a1_two_dumbbells_regular";
const B1: &str = "b1_free_asymmetric";
const B2: &str = "b2_dzhanibekov";
const D: &str = "d_dumbbell_central";

/// The observed order over each halving of the step.
fn orders(errors: &[f64]) -> Vec<f64> {
    errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect()
}

fn assert_order(what: &str, errors: &[f64], order: f64, within: f64) {
    let orders = orders(errors);
    println!(
        "{what}: orders {orders:.3?}, finest {:.2e}",
        errors[errors.len() - 1]
    );
    for observed in &orders {
        assert!((observed - order).abs() < within, "{what}: {orders:?}");
    }
}

fn pairs(tolerance: f64) -> [Method; 2] {
    [
        Method::Fehlberg78 { tolerance },
        Method::DormandPrince853 { tolerance },
    ]
}

const ALL: [Method; 7] = [
    Method::ExplicitMidpoint,
    Method::ImplicitMidpoint,
    Method::CrouchGrossman,
    Method::RungeKutta4,
    Method::Fehlberg78 { tolerance: 1e-12 },
    Method::DormandPrince853 { tolerance: 1e-12 },
    Method::Taylor { tolerance: 1e-12 },
];

fn sphere() -> (RigidBody, BodyState) {
    let inertia = Inertia::principal([2.0; 3]).expect("inertia");
    let body = RigidBody::new(4.0, inertia, vec![]).expect("body");
    let zero = Vector3::zeros();
    let state = BodyState::from_velocities(&body, zero, zero, Matrix3::identity(), zero);
    (body, state)
}

fn point_mass() -> RigidBody {
    let point = PointMass {
        mass: 1.0,
        position: Vector3::zeros(),
    };
    let inertia = Inertia::principal([1.0; 3]).expect("inertia");
    RigidBody::new(1.0, inertia, vec![point]).expect("body")
}

fn attracting(bodies: Vec<RigidBody>) -> System {
    let gravity: Vec<Box<dyn Gravity>> = vec![Box::new(Mutual::new(1.0))];
    System::new(bodies, gravity)
}
