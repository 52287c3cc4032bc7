//! Quantities that the flow conserves under each kind of gravity are conserved by the integrator over many steps. Also
//! tests the radii of sources.

use lgvi_dynamics::gravity::{Central, CloseApproach, Fixed, Gravity, Multipole, Uniform};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{
    BodyError, BodyState, Inertia, Invariants, Load, Method, RigidBody, Simulation, StepError,
    System,
};
use nalgebra::{Matrix3, Vector3};

use crate::case::Case;

const LGVI: Method = Method::Lgvi(Rotor::Discrete);

/// The largest deviation of `quantity` from its initial value in each half of a flight of `steps`.
fn deviation(
    case: &Case,
    h: f64,
    steps: u32,
    quantity: impl Fn(&Invariants, &Invariants) -> f64,
) -> [f64; 2] {
    let mut simulation = case.simulation(LGVI, h);
    let controls = vec![Load::default(); simulation.states().len()];
    let start = simulation.invariants();
    let mut greatest = [0.0_f64; 2];
    for step in 0..steps {
        simulation.advance(&controls).expect("a step");
        let half = &mut greatest[usize::from(2 * step >= steps)];
        *half = half.max(quantity(&simulation.invariants(), &start));
    }
    greatest
}

/// The energy error does not grow with time, and halving the step reduces it by a factor of four.
#[test]
fn energy_error_is_bounded_and_of_second_order() {
    for (name, h, steps) in [
        ("c1_3d_pendulum", 1e-3, 100_000),
        ("c3_3d_pendulum_regular_small", 2e-3, 100_000),
        ("e_kw4_like", 40.0, 20_000),
    ] {
        let case = Case::load(name);
        let energy = |now: &Invariants, start: &Invariants| {
            ((now.energy - start.energy) / start.energy).abs()
        };
        let [first, second] = deviation(&case, h, steps, energy);
        let [finer, _] = deviation(&case, 0.5 * h, steps, energy);
        println!("{name}: energy {first:.3e}, later {second:.3e}, at half the step {finer:.3e}");
        assert!(second < 1.1 * first, "{name}: {first:e}, then {second:e}");
        let ratio = first / finer;
        assert!((ratio - 4.0).abs() < 0.1, "{name}: {first:e}, {finer:e}");
    }
}

/// Gravity exerts no moment about the vertical.
#[test]
fn a_pendulum_keeps_its_angular_momentum_about_the_vertical() {
    for name in ["c1_3d_pendulum", "c3_3d_pendulum_regular_small"] {
        let vertical = |now: &Invariants, start: &Invariants| {
            (now.angular_momentum.z - start.angular_momentum.z).abs()
                / start.angular_momentum.norm()
        };
        let [first, second] = deviation(&Case::load(name), 1e-3, 100_000, vertical);
        println!(
            "{name}: vertical angular momentum {:.1e}",
            first.max(second)
        );
        assert!(first.max(second) < 1e-12, "{name}: {first:e}, {second:e}");
    }
}

#[test]
fn a_binary_of_multipoles_keeps_its_momenta() {
    let case = Case::load("e_kw4_like");
    // The linear momentum of one body is 3.3e10 kg m/s. The total is nonzero because of the rounded initial velocities.
    let linear = |now: &Invariants, start: &Invariants| {
        (now.linear_momentum - start.linear_momentum).norm() / 3.3e10
    };
    let angular = |now: &Invariants, start: &Invariants| {
        (now.angular_momentum - start.angular_momentum).norm() / start.angular_momentum.norm()
    };
    let [_, linear] = deviation(&case, 20.0, 50_000, linear);
    let [_, angular] = deviation(&case, 20.0, 50_000, angular);
    println!("momenta after 1e6 s: linear {linear:.1e}, angular {angular:.1e}");
    assert!(linear < 1e-15, "linear momentum {linear:e}");
    assert!(angular < 1e-12, "angular momentum {angular:e}");
}

/// The field of an oblate planet is symmetric about its pole, and rotates the plane of an orbit.
#[test]
fn a_body_round_an_oblate_planet_keeps_its_angular_momentum_about_the_pole() {
    let inertia = Inertia::principal([1.0, 2.0, 2.5]).expect("inertia");
    let multipole = Multipole::of_inertia(1.0, &inertia);
    let body = RigidBody::with_multipole(inertia, multipole).expect("body");
    let attitude = lgvi_lie::exp(&Vector3::new(0.4, -0.8, 0.3));
    let center = Vector3::new(3.0, -2.0, 1.0);
    let planet = Fixed::new(Multipole::oblate(1.0, 0.1, 0.5), center, attitude);
    let state = BodyState::from_velocities(
        &body,
        center + Vector3::new(5.0, 0.0, 0.0),
        Vector3::new(0.0, 0.3, 0.35),
        Matrix3::identity(),
        Vector3::new(0.05, 0.1, -0.02),
    );
    let pole = attitude.column(2).into_owned();
    let about_pole = |state: &BodyState| {
        let orbital = (state.position - center).cross(&state.linear_momentum);
        pole.dot(&(orbital + state.attitude * state.angular_momentum))
    };
    let system = System::new(vec![body], vec![Box::new(planet)]);
    let mut simulation = Simulation::new(system, vec![state], LGVI, 0.05).expect("a method");
    let mut across = 0.0_f64;
    for _ in 0..20_000 {
        simulation.advance(&[Load::default()]).expect("a step");
        let change = about_pole(&simulation.states()[0]) - about_pole(&state);
        assert!(change.abs() < 1e-12, "{change:e}");
        let turned = simulation.states()[0].position - center;
        let plane = state.position - center;
        across = across.max(turned.dot(&plane.cross(&state.linear_momentum)).abs());
    }
    assert!(
        across > 0.1,
        "the plane of the orbit has not turned: {across:e}"
    );
}

#[test]
fn a_body_in_a_sources_radius_is_refused() {
    let inertia = Inertia::principal([1.0; 3]).expect("inertia");
    let body = RigidBody::new(1.0, inertia, vec![]).expect("body");
    let body = body.with_radius(0.25).expect("a radius");
    let center = Vector3::new(1.0, 2.0, 3.0);
    let source =
        |radius| Fixed::new(Central { gm: 1.0 }, center, Matrix3::identity()).with_radius(radius);
    assert_eq!(source(-0.5), Err(BodyError::Radius(-0.5)));
    let fly = |distance: f64| {
        let offset = Vector3::new(distance, 0.0, 0.0);
        let zero = Vector3::zeros();
        let (x, r) = (center + offset, Matrix3::identity());
        let state = BodyState::from_velocities(&body, x, zero, r, zero);
        let uniform = Uniform { acceleration: zero };
        let gravity: Vec<Box<dyn Gravity>> =
            vec![Box::new(uniform), Box::new(source(0.5).expect("a radius"))];
        let system = System::new(vec![body.clone()], gravity);
        let mut simulation = Simulation::new(system, vec![state], LGVI, 1e-9).expect("a method");
        simulation.advance(&[Load::default()])
    };
    assert!(fly(0.751).is_ok());
    match fly(0.749) {
        Err(StepError::CloseApproach(approach)) => {
            assert!((approach.distance - 0.749).abs() < 1e-12);
            let expected = CloseApproach {
                body: 0,
                other: None,
                limit: 0.75,
                ..approach
            };
            assert_eq!(approach, expected);
        }
        other => panic!("{other:?}"),
    }
}
