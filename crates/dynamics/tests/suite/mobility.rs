//! Fixed and driven bodies among free ones.

use lgvi_dynamics::gravity::{Gravity, Mutual};
use lgvi_dynamics::{
    BodyState, Drive, Inertia, Load, Method, Mobility, RigidBody, Simulation, System,
};
use nalgebra::{Matrix3, Vector3};

const METHOD: Method = Method::Lgvi(lgvi_dynamics::integrator::Rotor::Discrete);

fn sphere(mass: f64) -> RigidBody {
    let inertia = Inertia::principal([0.4 * mass; 3]).expect("inertia");
    RigidBody::new(mass, inertia, vec![]).expect("body")
}

fn at(body: &RigidBody, x: Vector3<f64>, v: Vector3<f64>) -> BodyState {
    BodyState::from_velocities(body, x, v, Matrix3::identity(), Vector3::zeros())
}

/// Makes `steps` steps of `h` under mutual gravity with `G = 1`.
fn fly(bodies: &[RigidBody], states: &[BodyState], h: f64, steps: u32) -> Vec<BodyState> {
    let gravity: Vec<Box<dyn Gravity>> = vec![Box::new(Mutual::new(1.0))];
    let system = System::new(bodies.to_vec(), gravity);
    let mut simulation = Simulation::new(system, states.to_vec(), METHOD, h).expect("a method");
    for _ in 0..steps {
        simulation
            .advance(&vec![Load::default(); bodies.len()])
            .expect("a step");
    }
    simulation.states().to_vec()
}

/// Two bodies on a mutual circular orbit. If one of them is driven along its circle, the other stays on its own.
#[test]
fn a_driven_body_attracts_from_where_its_path_has_it() {
    let (heavy, light) = (sphere(3.0), sphere(1.0));
    let rate = Vector3::new(0.0, 0.0, 2.0 / 8.0_f64.sqrt());
    let (near, far) = (Vector3::new(0.5, 0.0, 0.0), Vector3::new(-1.5, 0.0, 0.0));
    let states = [
        at(&heavy, near, rate.cross(&near)),
        at(&light, far, rate.cross(&far)),
    ];
    let h = 0.005;
    let free = fly(&[heavy.clone(), light.clone()], &states, h, 2000);
    let drive = Drive::circle(Vector3::zeros(), rate, Vector3::zeros());
    let driven = heavy.with_mobility(Mobility::Driven(drive));
    let led = fly(&[driven, light.clone()], &states, h, 2000);
    let exact = lgvi_lie::exp(&(rate * 10.0)) * far;
    let (own, led) = (free[1].position - exact, led[1].position - exact);
    assert!(own.norm() < 5e-5, "{own}");
    assert!(led.norm() < 8e-5, "{led}");
}

/// Uniform motion of the frame has no effect: an orbit around a driven body equals that around a fixed body.
#[test]
fn an_orbit_round_a_moving_body_is_that_round_a_held_one() {
    let (heavy, light) = (sphere(1.0), sphere(1e-3));
    let drift = Vector3::new(0.3, -0.2, 0.1);
    let (x, v) = (Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 0.9, 0.2));
    let zero = Vector3::zeros();
    let (h, steps) = (0.01, 1000);
    let held = fly(
        &[heavy.clone().with_mobility(Mobility::Fixed), light.clone()],
        &[at(&heavy, zero, zero), at(&light, x, v)],
        h,
        steps,
    );
    let moving = Mobility::Driven(Drive::uniform(drift, Vector3::new(0.0, 1.0, 0.0)));
    let led = fly(
        &[heavy.clone().with_mobility(moving), light.clone()],
        &[at(&heavy, zero, zero), at(&light, x, v + drift)],
        h,
        steps,
    );
    let moved = drift * h * f64::from(steps);
    assert!((led[0].position - moved).norm() < 1e-13);
    assert!((led[1].position - moved - held[1].position).norm() < 1e-11);
    assert_eq!(held[0], at(&heavy, zero, zero));
}

#[test]
fn a_pivoted_body_turns_in_place() {
    let inertia = Inertia::principal([0.13, 0.28, 0.17]).expect("inertia");
    let body = RigidBody::pivoted(1.0, inertia, vec![]).expect("body");
    let x = Vector3::new(1.0, 2.0, 3.0);
    let other = sphere(5.0).with_mobility(Mobility::Fixed);
    let states = [
        at(&body, x, Vector3::zeros()),
        at(&other, Vector3::zeros(), Vector3::zeros()),
    ];
    let end = fly(&[body, other], &states, 0.01, 100);
    assert_eq!(end[0].position, x);
    assert_eq!(end[0].linear_momentum, Vector3::zeros());
}
