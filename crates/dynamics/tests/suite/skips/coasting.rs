//! Bodies on which no moment acts.

use lgvi_dynamics::gravity::{Central, Gravity};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{BodyState, Load, Method, Mobility, RigidBody, Simulation, Skip, System};
use lgvi_truth::random::Random;
use nalgebra::Vector3;

use super::{ball, dumbbell, fly, mutual, state};

const LGVI: Method = Method::Lgvi(Rotor::Discrete);

const NYSTROM: Method = Method::Nystrom { order: 6 };

/// Balls, a dumbbell and fixed bodies, under a fixed source and mutual attraction.
fn company() -> (Vec<RigidBody>, Vec<BodyState>) {
    let bodies = vec![
        ball(1e-3),
        ball(2e-3),
        dumbbell(1e-3, 0.05),
        ball(1e-2).with_mobility(Mobility::Fixed),
        dumbbell(1e-2, 0.1).with_mobility(Mobility::Fixed),
    ];
    let mut random = Random::new(7, 0);
    let random = &mut random;
    let states = vec![
        state(&bodies[0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.1], random),
        state(&bodies[1], [-1.5, 0.0, 0.1], [0.0, -0.8, 0.0], random),
        state(&bodies[2], [0.0, 2.0, 0.0], [-0.7, 0.0, 0.1], random),
        state(&bodies[3], [0.0, 0.0, 5.0], [0.0; 3], random),
        state(&bodies[4], [0.0, 5.0, 5.0], [0.0; 3], random),
    ];
    (bodies, states)
}

fn gravity() -> Vec<Box<dyn Gravity>> {
    let mut gravity = mutual(0.5);
    gravity.push(Box::new(Central { gm: 1.0 }));
    gravity
}

fn greatest_difference(a: &[BodyState], b: &[BodyState]) -> f64 {
    let each = a.iter().zip(b).map(|(a, b)| {
        let of_attitude = (a.attitude - b.attitude).norm();
        (a.position - b.position).norm().max(of_attitude)
    });
    each.fold(0.0, f64::max)
}

/// The results are bitwise equal for a method whose drifts cannot be combined.
#[test]
fn exact_skips_change_no_bit_of_a_discrete_rotor() {
    let (bodies, states) = company();
    for method in [LGVI, Method::LieEuler(Rotor::default())] {
        let flown = |skip| fly((&bodies, gravity()), &states, method, (0.01, 2_000), skip);
        let (full, exact) = (flown(Skip::Nothing), flown(Skip::Exact));
        assert_eq!(full.states(), exact.states());
        assert_ne!(full.states(), &states[..]);
    }
}

/// One rotation per step equals the sum of the rotations of its drifts.
#[test]
fn exact_skips_change_nothing_but_rounding_of_an_exact_rotor() {
    let (bodies, states) = company();
    let flown = |skip| fly((&bodies, gravity()), &states, NYSTROM, (0.05, 2_000), skip);
    let (full, exact) = (flown(Skip::Nothing), flown(Skip::Exact));
    let difference = greatest_difference(full.states(), exact.states());
    println!("{difference:e}");
    assert!(difference < 1e-11, "{difference:e}");
    assert_ne!(full.states()[0].attitude, exact.states()[0].attitude);
}

/// The moment of a control acts on bodies that otherwise coast, and they continue to rotate as without omissions.
#[test]
fn moments_of_controls_act_on_coasting_bodies() {
    let (bodies, mut states) = company();
    states[1].angular_momentum = Vector3::zeros();
    for (method, most) in [(LGVI, 0.0), (NYSTROM, 1e-12)] {
        let flown = [Skip::Nothing, Skip::Exact].map(|skip| {
            let system = System::new(bodies.clone(), gravity());
            let simulation = Simulation::new(system, states.clone(), method, 0.05);
            let mut simulation = simulation.expect("a simulation").with_skips(skip);
            let mut controls = vec![Load::default(); bodies.len()];
            for step in 0..100 {
                let acts = if step % 10 == 3 { 1e-4 } else { 0.0 };
                controls[1].moment = Vector3::new(acts, -acts, 2.0 * acts);
                simulation.advance(&controls).expect("a step");
            }
            simulation
        });
        let [full, exact] = &flown;
        let difference = greatest_difference(full.states(), exact.states());
        assert!(difference <= most, "{method}: {difference:e}");
        assert!((full.states()[1].attitude - states[1].attitude).norm() > 0.1);
    }
}

/// The attitude of a body at rest without moments remains bitwise unchanged.
#[test]
fn bodies_at_rest_are_not_turned() {
    let (bodies, mut states) = company();
    states[0].angular_momentum = Vector3::zeros();
    for method in [LGVI, NYSTROM] {
        let exact = fly(
            (&bodies, gravity()),
            &states,
            method,
            (0.01, 100),
            Skip::Exact,
        );
        assert_eq!(exact.states()[0].attitude, states[0].attitude);
        let full = fly(
            (&bodies, gravity()),
            &states,
            method,
            (0.01, 100),
            Skip::Nothing,
        );
        assert!(greatest_difference(full.states(), exact.states()) < 1e-14);
    }
}
