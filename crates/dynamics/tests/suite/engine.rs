//! Bodies with an engine, by the rocket equation, at its limits and at the end of its propellant.

use lgvi_dynamics::nalgebra::{Matrix3, Vector3};
use lgvi_dynamics::thrusters::{Engine, Propellant, ThrusterError, Thrusters};
use lgvi_dynamics::{BodyState, Inertia, Load, Method, RigidBody, Simulation, System};

use crate::actuated::METHODS;

const VELOCITY: f64 = 2.5;

fn thrusters(engine: Engine) -> Result<Thrusters, ThrusterError> {
    let propellant = Propellant {
        mass: 1.0,
        inertia: None,
    };
    Thrusters::new(Vec::new(), propellant)?.with_engine(engine)
}

/// A body of mass 3 that turns, with an engine of thrust 0.5.
fn simulation(method: Method, h: f64, rate: Vector3<f64>) -> Simulation {
    let inertia = Inertia::principal([1.0, 1.4, 1.9]).expect("valid");
    let body = RigidBody::new(3.0, inertia, vec![]).expect("valid");
    let engine = Engine {
        thrust: 0.5,
        exhaust_velocity: VELOCITY,
    };
    let body = body
        .with_thrusters(thrusters(engine).expect("valid"))
        .expect("valid");
    let still = Vector3::zeros();
    let state = BodyState::from_velocities(&body, still, still, Matrix3::identity(), rate);
    Simulation::new(System::new(vec![body], vec![]), vec![state], method, h).expect("valid")
}

fn force(force: Vector3<f64>) -> Load {
    Load {
        force,
        moment: Vector3::zeros(),
    }
}

/// A force beyond the limit is one at the limit, in any direction; none is left when the propellant is used up.
#[test]
fn the_change_of_velocity_is_that_of_the_rocket_equation() {
    let way = Vector3::new(1.0, -2.0, 0.5).normalize();
    for method in METHODS {
        for (steps, mass) in [(3_000, 3.0 - 0.6), (7_000, 2.0)] {
            let mut simulation = simulation(method, 1e-3, Vector3::zeros());
            let rest = simulation.command(0, force(2.0 * way));
            assert_eq!(rest, Load::default());
            for _ in 0..steps {
                simulation.advance(&[rest]).expect("a step");
            }
            let body = &simulation.system().bodies()[0];
            let velocity = simulation.states()[0].velocity(body);
            let miss = (velocity - VELOCITY * f64::ln(3.0 / mass) * way).norm();
            assert!(miss < 2e-8, "{method}: {miss:e}");
            assert!((body.mass() - mass).abs() < 1e-12);
            let last = body.thrusters().expect("an engine").engine_force();
            let expected = if steps == 7_000 { 0.0 } else { 0.5 };
            assert!((last.norm() - expected).abs() < 1e-12, "{last}");
        }
    }
}

/// The mass falls by `(1 − a/2)/(1 + a/2)` in a step, with `a = h F/(c m)` of the mass `m` in its middle.
#[test]
fn a_step_is_that_of_the_discrete_rocket_equation() {
    let mut simulation = simulation(METHODS[3], 0.5, Vector3::zeros());
    let rest = simulation.command(0, force(0.4 * Vector3::y()));
    simulation.advance(&[rest]).expect("a step");
    let body = &simulation.system().bodies()[0];
    let middle = 3.0 - 0.5 * 0.5 * 0.4 / VELOCITY;
    let a = 0.5 * 0.4 / (VELOCITY * middle);
    assert!((body.mass() - 3.0 * (1.0 - 0.5 * a) / (1.0 + 0.5 * a)).abs() < 1e-15);
    let velocity = simulation.states()[0].velocity(body);
    assert!((velocity - 0.5 * 0.4 / middle * Vector3::y()).norm() < 1e-16);
}

/// Gas that leaves at the center of mass takes no angular momentum along.
#[test]
fn the_angular_momentum_stays() {
    let rate = Vector3::new(0.3, -0.2, 0.5);
    // Others do not conserve it to rounding.
    for method in [METHODS[3], METHODS[4]] {
        let mut simulation = simulation(method, 0.01, rate);
        let momentum = |simulation: &Simulation| {
            let state = &simulation.states()[0];
            state.attitude * state.angular_momentum
        };
        let before = momentum(&simulation);
        let rest = simulation.command(0, force(0.5 * Vector3::x()));
        for _ in 0..300 {
            simulation.advance(&[rest]).expect("a step");
        }
        let off = (momentum(&simulation) - before).norm();
        assert!(off < 1e-13, "{method}: {off:e}");
        assert!(simulation.system().bodies()[0].mass() < 2.5);
    }
}

#[test]
fn a_body_without_an_engine_takes_the_load_itself() {
    let inertia = Inertia::principal([1.0, 1.4, 1.9]).expect("valid");
    let body = RigidBody::new(3.0, inertia, vec![]).expect("valid");
    let still = Vector3::zeros();
    let state = BodyState::from_velocities(&body, still, still, Matrix3::identity(), still);
    let system = System::new(vec![body], vec![]);
    let mut simulation = Simulation::new(system, vec![state], METHODS[3], 0.1).expect("valid");
    let load = force(Vector3::x());
    assert_eq!(simulation.command(0, load), load);
}

#[test]
fn a_failed_step_leaves_the_propellant() {
    let mut simulation = simulation(METHODS[3], 10.0, Vector3::new(0.0, 2.0, 1.0));
    let rest = simulation.command(0, force(0.1 * Vector3::x()));
    let before = simulation.system().bodies().to_vec();
    simulation.advance(&[rest]).unwrap_err();
    assert_eq!(simulation.system().bodies(), before);
}

#[test]
fn engines_are_checked() {
    for (thrust, exhaust_velocity, found) in [
        (0.0, 1.0, "thrust"),
        (f64::NAN, 1.0, "thrust"),
        (1.0, 0.0, "exhaust velocity"),
        (1.0, f64::INFINITY, "exhaust velocity"),
    ] {
        let engine = Engine {
            thrust,
            exhaust_velocity,
        };
        match thrusters(engine) {
            Err(ThrusterError::Engine { quantity, .. }) => assert_eq!(quantity, found),
            other => panic!("{other:?}"),
        }
    }
}
