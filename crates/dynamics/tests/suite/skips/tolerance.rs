//! The tolerance is met if errors grow fast, bodies spin fast, and steps are long.

use lgvi_dynamics::Accuracy;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::skip::{Allowance, Refusal};
use lgvi_dynamics::{BodyState, Load, Method, Mobility, RigidBody, Simulation, Skip, System};
use nalgebra::{Matrix3, Vector3};

use super::levels::flyby;
use super::{ball, fly, inertia, mutual};

const METHOD: Method = Method::DormandPrince853 { tolerance: 1e-11 };
const DURATION: f64 = 3.0;
const TOLERANCE: f64 = 1e-6;

/// A small body with the given spin that passes close to a heavy one, and a distant third body with the mass
/// `perturber`.
fn swingby(spin: f64, perturber: f64) -> ([RigidBody; 3], [BodyState; 3]) {
    let small = RigidBody::new(1e-6, inertia([1e-6; 3]), vec![]).expect("a body");
    let held = |mass| ball(mass).with_mobility(Mobility::Fixed);
    let bodies = [small, held(1.0), held(perturber)];
    let state = |body: &RigidBody, position: [f64; 3], speed: f64, spin: f64| {
        let along = Vector3::new(speed, 0.0, 0.0);
        let turning = Vector3::new(spin, 0.0, 0.0);
        BodyState::from_velocities(body, position.into(), along, Matrix3::identity(), turning)
    };
    let states = [
        state(&bodies[0], [-10.0, 0.01, 0.0], 10.0, spin),
        state(&bodies[1], [0.0; 3], 0.0, 0.0),
        state(&bodies[2], [0.0, 100.0, 0.0], 0.0, 0.0),
    ];
    (bodies, states)
}

fn allowance(bodies: &[RigidBody], states: &[BodyState]) -> Result<Allowance, Refusal> {
    let mut system = System::new(bodies.to_vec(), mutual(1.0));
    Allowance::new(&mut system, states, DURATION, TOLERANCE)
}

/// The difference between the end states of a simulation with `skip` and of a full one.
fn error(bodies: &[RigidBody], states: &[BodyState], skip: Skip) -> f64 {
    let flown = |skip| {
        fly(
            (bodies, mutual(1.0)),
            states,
            METHOD,
            (DURATION / 300.0, 300),
            skip,
        )
    };
    let [full, reduced] = [Skip::Nothing, skip].map(flown);
    Accuracy::new(bodies, states).error(reduced.states(), full.states())
}

/// An interaction that is negligible if errors grow as in free motion is not negligible if they grow a thousandfold. A
/// fast spin of a body whose rotation affects nothing makes no difference.
#[test]
fn growth_decides_what_is_negligible() {
    let (bodies, states) = swingby(0.0, 0.033);
    let slow = allowance(&bodies, &states);
    let Err(Refusal::Never { response }) = slow else {
        panic!("{slow:?}");
    };
    assert!(response > 1e3, "{response}");
    let spinning = swingby(1e3, 0.033).1;
    assert_eq!(allowance(&bodies, &spinning), slow);
    let mut system = System::new(bodies.to_vec(), mutual(1.0));
    let skip = Skip::within(&mut system, &spinning, DURATION, TOLERANCE);
    assert_eq!(skip, Skip::Exact);
    assert!(error(&bodies, &spinning, skip) <= TOLERANCE);
    let free = Allowance {
        tolerance: TOLERANCE,
        perturbation: 2.0 * TOLERANCE / DURATION.powi(2),
        length: Accuracy::new(&bodies, &states).length,
        response: 1.0,
        evaluations: 0,
    };
    let error_of_free = error(&bodies, &states, Skip::Within(free));
    println!("{response}, {error_of_free:e}");
    assert!(error_of_free > TOLERANCE, "{error_of_free:e}");
}

/// The error of the omissions is within the tolerance, but not much smaller.
#[test]
fn what_growth_allows_is_left_out() {
    let (bodies, states) = swingby(1e3, 3e-5);
    let skip = allowance(&bodies, &states).map(Skip::Within);
    let error = error(&bodies, &states, skip.expect("an allowance"));
    println!("{error:e}");
    assert!(error <= TOLERANCE && error > 1e-3 * TOLERANCE, "{error:e}");
}

/// If the flights would take too long or diverge too far, nothing is omitted.
#[test]
fn unknown_growth_leaves_nothing_out() {
    let (bodies, mut states) = flyby();
    states[0].angular_momentum = bodies[0].inertia().matrix() * Vector3::new(1e4, 1e4, 0.0);
    let mut system = System::new(bodies.to_vec(), mutual(0.2));
    let costly = Allowance::new(&mut system, &states, 60.0, 1e-5);
    assert!(matches!(costly, Err(Refusal::Costly { .. })), "{costly:?}");
    let (bodies, mut states) = swingby(0.0, 1e-9);
    states[0].position.y = 1e-4;
    states[0].linear_momentum *= 10.0;
    let saturated = allowance(&bodies, &states);
    assert!(
        matches!(saturated, Err(Refusal::Saturated { .. })),
        "{saturated:?}"
    );
}

/// A pair that meets within one step of the run but is far apart at its ends is computed in full near the encounter.
#[test]
fn pairs_that_meet_within_a_step_are_seen() {
    let (bodies, states) = flyby();
    let accuracy = Accuracy::new(&bodies, &states);
    let simulation = |method, h, skip| {
        let system = System::new(bodies.to_vec(), mutual(0.2));
        let simulation = Simulation::new(system, states.to_vec(), method, h).expect("a simulation");
        (simulation, skip)
    };
    let end = |simulation: Simulation, skip, steps: u32| {
        let mut simulation = simulation.with_skips(skip);
        for _ in 0..steps {
            simulation.advance(&[Load::default(); 2]).expect("a step");
        }
        simulation
    };
    let within = |tolerance| {
        let mut system = System::new(bodies.to_vec(), mutual(0.2));
        let skip = Skip::within(&mut system, &states, 60.0, tolerance);
        assert!(matches!(skip, Skip::Within(_)), "{skip:?}");
        skip
    };
    for steps in [1, 3] {
        let skips = [Skip::Nothing, within(1e-5)];
        let flown = skips.map(|skip| {
            let (simulation, skip) = simulation(METHOD, 60.0 / f64::from(steps), skip);
            end(simulation, skip, steps)
        });
        let error = accuracy.error(flown[1].states(), flown[0].states());
        println!("{steps}: {error:e}, {} switches", flown[1].switches());
        assert!(
            error <= 1e-5 && flown[1].switches() > 0,
            "{steps}: {error:e}"
        );
    }
    let lgvi = Method::Lgvi(Rotor::Exact);
    let flown = [Skip::Nothing, within(1e-3)].map(|skip| {
        let (simulation, skip) = simulation(lgvi, 60.0, skip);
        end(simulation.with_subdivision(12).expect("a depth"), skip, 1)
    });
    let error = accuracy.error(flown[1].states(), flown[0].states());
    println!("subdivided: {error:e}, {} switches", flown[1].switches());
    assert!(error <= 1e-3 && flown[1].switches() > 0, "{error:e}");
    // The kicks are at -60, -20, 20 and 60, with none in between.
    let (simulation, skip) = simulation(lgvi, 20.0, within(1e-3));
    let flown = end(simulation, skip, 3);
    assert!(flown.switches() > 0);
}
