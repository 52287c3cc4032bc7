//! Steps that cannot be made or are unreliable: typed errors, and failures that subdivision resolves.

use crate::case::Case;
use lgvi_dynamics::gravity::{CloseApproach, Gravity, Mutual};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{
    BodyState, Inertia, Load, Method, Mobility, RigidBody, Simulation, StepError, System,
};
use nalgebra::{Matrix3, Vector3};

const LGVI: Method = Method::Lgvi(Rotor::Discrete);

fn sphere(mass: f64, radius: f64) -> RigidBody {
    let inertia = Inertia::principal([0.4 * mass; 3]).expect("inertia");
    RigidBody::new(mass, inertia, vec![])
        .and_then(|body| body.with_radius(radius))
        .expect("body")
}

fn at(body: &RigidBody, position: [f64; 3], velocity: [f64; 3]) -> BodyState {
    BodyState::from_velocities(
        body,
        position.into(),
        velocity.into(),
        Matrix3::identity(),
        Vector3::zeros(),
    )
}

fn attracting(bodies: Vec<RigidBody>, states: Vec<BodyState>, h: f64) -> Simulation {
    let gravity: Vec<Box<dyn Gravity>> = vec![Box::new(Mutual::new(1.0))];
    Simulation::new(System::new(bodies, gravity), states, LGVI, h).expect("a method")
}

/// A light body on an eccentric orbit about a fixed heavy one, with pericenter 0.02 and apocenter 2.
fn eccentric(h: f64) -> Simulation {
    let heavy = sphere(1.0, 0.0).with_mobility(Mobility::Fixed);
    let light = sphere(1e-3, 0.0);
    let (apocenter, pericenter): (f64, f64) = (2.0, 0.02);
    let axis = 0.5 * (apocenter + pericenter);
    let speed = (2.0 / apocenter - 1.0 / axis).sqrt();
    let states = vec![
        at(&heavy, [0.0; 3], [0.0; 3]),
        at(&light, [apocenter, 0.0, 0.0], [0.0, speed, 0.0]),
    ];
    attracting(vec![heavy, light], states, h)
}

/// The largest relative energy error, and the number of subdivisions, over one revolution.
fn revolution(mut simulation: Simulation, h: f64) -> Result<(f64, u32), StepError> {
    let period = std::f64::consts::TAU * 1.01_f64.powf(1.5);
    let energy = simulation.invariants().energy;
    let (mut worst, mut cuts) = (0.0_f64, 0);
    for _ in 0..(period / h) as u32 {
        cuts += simulation.advance(&[Load::default(); 2])?.cuts;
        worst = worst.max((simulation.invariants().energy / energy - 1.0).abs());
    }
    Ok((worst, cuts))
}

#[test]
fn a_close_passage_is_cut_into_resolved_steps_and_reported() {
    let h = 0.02;
    let (whole, none) = revolution(eccentric(h), h).expect("unresolved but finite");
    assert_eq!(none, 0);
    assert!(whole > 0.5, "the passage must need cutting: {whole:e}");
    let (cut, cuts) =
        revolution(eccentric(h).with_subdivision(12).expect("a depth"), h).expect("resolved");
    println!("energy error {whole:.1e} whole, {cut:.1e} with {cuts} cuts");
    assert!(cut < 0.1, "{cut:e}");
    assert!((20..10_000).contains(&cuts), "{cuts} cuts");
}

#[test]
fn what_subdivision_cannot_resolve_is_an_error() {
    let h = 0.02;
    let error = revolution(eccentric(h).with_subdivision(2).expect("a depth"), h)
        .expect_err("too few cuts");
    assert!(
        matches!(error, StepError::Unresolved { body: 1, excess } if excess > 1.0),
        "{error:?}"
    );
}

#[test]
fn a_turn_past_the_limit_is_cut_until_it_can_be_made() {
    let inertia = Inertia::principal([1.0, 2.0, 2.5]).expect("inertia");
    let body = RigidBody::new(1.0, inertia, vec![]).expect("body");
    let zero = Vector3::zeros();
    let omega = Vector3::new(0.0, 0.0, 1.0);
    let state = BodyState::from_velocities(&body, zero, zero, Matrix3::identity(), omega);
    let h = 3.0;
    let whole = || {
        let system = System::new(vec![body.clone()], vec![]);
        Simulation::new(system, vec![state], LGVI, h).expect("a method")
    };
    let error = whole().advance(&[Load::default()]);
    assert!(matches!(error, Err(StepError::Unsolvable { .. })));
    let mut cut = whole().with_subdivision(6).expect("a depth");
    let report = cut.advance(&[Load::default()]).expect("cut");
    assert_eq!(report.cuts, 4);
    // On a principal axis, the discrete rigid body rotates by θ with sin θ = h Ω.
    let turn = 4.0 * libm::asin(0.25 * h);
    let attitude = lgvi_lie::exp(&Vector3::new(0.0, 0.0, turn));
    let error = (cut.states()[0].attitude - attitude).norm();
    assert!(error < 1e-14, "{error:e}");
}

#[test]
fn a_resolved_step_is_not_cut() {
    let case = Case::load("a1_two_dumbbells_regular");
    let mut plain = case.simulation(LGVI, 0.002);
    let mut cutting = case
        .simulation(LGVI, 0.002)
        .with_subdivision(4)
        .expect("a depth");
    for _ in 0..1000 {
        plain.advance(&[Load::default(); 2]).expect("a step");
        let report = cutting.advance(&[Load::default(); 2]).expect("a step");
        assert_eq!(report.cuts, 0);
    }
    assert_eq!(plain.states(), cutting.states());
}

#[test]
fn entering_a_body_is_a_close_approach_with_its_figures() {
    let bodies = vec![sphere(1.0, 0.3), sphere(1.0, 0.2)];
    let states = vec![
        at(&bodies[0], [0.0; 3], [0.0; 3]),
        at(&bodies[1], [2.0, 0.0, 0.0], [-1.0, 0.0, 0.0]),
    ];
    for depth in [0, 5] {
        let mut simulation = attracting(bodies.clone(), states.clone(), 0.01)
            .with_subdivision(depth)
            .expect("a depth");
        let error = loop {
            let before = simulation.states().to_vec();
            if let Err(error) = simulation.advance(&[Load::default(); 2]) {
                assert_eq!(simulation.states(), before);
                break error;
            }
        };
        let StepError::CloseApproach(approach) = error else {
            panic!("{error:?}");
        };
        let CloseApproach {
            body,
            other,
            distance,
            limit,
        } = approach;
        assert_eq!((body, other, limit), (0, Some(1), 0.5));
        assert!((0.4..0.5).contains(&distance));
    }
}

/// A backward step needs the same subdivision as a forward step.
#[test]
fn a_step_back_is_cut_too() {
    let heavy = sphere(1.0, 0.0).with_mobility(Mobility::Fixed);
    let light = sphere(1e-3, 0.0);
    // A step covers one seventh of the orbit.
    let cuts = |h: f64| {
        let states = vec![
            at(&heavy, [0.0; 3], [0.0; 3]),
            at(&light, [0.1, 0.0, 0.0], [0.0, 4.4, 0.0]),
        ];
        let bodies = vec![heavy.clone(), light.clone()];
        let mut simulation = attracting(bodies, states, h)
            .with_subdivision(12)
            .expect("a depth");
        simulation.advance(&[Load::default(); 2]).expect("cut").cuts
    };
    assert!(cuts(0.02) > 1);
    assert_eq!(cuts(-0.02), cuts(0.02));
}

#[test]
fn the_closed_form_goes_on_after_a_control_that_fails() {
    let body = sphere(1.0, 0.0);
    let state = at(&body, [1.0, 2.0, 3.0], [0.1, 0.2, 0.3]);
    let system = System::new(vec![body], vec![]);
    let mut simulation =
        Simulation::new(system, vec![state], Method::ClosedForm, 0.5).expect("a method");
    let [none, mut bad] = [Load::default(); 2];
    bad.force.x = f64::NAN;
    simulation.advance(&[none]).expect("a step");
    let error = simulation.advance(&[bad]).expect_err("not a number");
    assert_eq!(error, StepError::NotFinite { body: 0 });
    simulation.advance(&[none]).expect("a step");
    let reached = simulation.states()[0].position;
    assert!((reached - Vector3::new(1.1, 2.2, 3.3)).norm() < 1e-15);
}

/// Invalid input is reported at the start, with its values. Controls for a different number of bodies are rejected.
#[test]
fn input_that_is_no_system_is_refused() {
    let body = sphere(1.0, 0.0);
    let fly = |states: Vec<BodyState>, h: f64| {
        let system = System::new(vec![body.clone()], vec![]);
        Simulation::new(system, states, LGVI, h)
    };
    let state = at(&body, [0.0; 3], [0.0; 3]);
    let refused = |states, h| fly(states, h).err().map(|error| error.to_string());
    let says = |found: Option<String>, expected: &str| {
        let found = found.expect("refused");
        assert!(found.contains(expected), "{found:?} for {expected:?}");
    };
    says(refused(vec![], 0.1), "0 states for 1 bodies");
    says(refused(vec![state, state], 0.1), "2 states for 1 bodies");
    for h in [0.0, f64::NAN, f64::INFINITY, 1e-320] {
        says(refused(vec![state], h), &format!("step is {h}"));
    }
    for entry in 0..9 {
        let mut broken = state;
        broken.attitude[entry] = f64::NAN;
        says(
            refused(vec![broken], 0.1),
            "body 0: its state is not finite",
        );
    }
    for (factor, expected) in [
        (-1.0, "det R -1.000"),
        (2.0, "det R 8.000"),
        (0.0, "|RᵀR − I| is 1.7e0"),
    ] {
        let mut broken = state;
        broken.attitude *= factor;
        says(refused(vec![broken], 0.1), expected);
    }

    // Values whose products would overflow or underflow in double precision.
    for h in [1e-31_f64, -1e31, 1e300] {
        let text = format!("the length of the step is {:e}", h.abs());
        says(refused(vec![state], h), &text);
    }
    let far = at(&body, [0.0, 1e31, 0.0], [0.0; 3]);
    says(
        refused(vec![far], 0.1),
        "body 0: the distance from the origin is 1e31, expected 0e0 to 1e30",
    );
    for (mass, moment, expected) in [
        (1e61, 1.0, "the mass is 1e61, expected 1e-60 to 1e60"),
        (1e50, 1e-20, "the trace of the inertia over the mass is "),
        (1e-61, 1.0, "the mass is 1e-61"),
        (1.0, 1e100, "the trace of the inertia is "),
        (1.0, 1e-101, "the trace of the inertia is "),
    ] {
        let inertia = Inertia::principal([moment; 3]).expect("inertia");
        let body = RigidBody::new(mass, inertia, vec![]).expect("body");
        let system = System::new(vec![body], vec![]);
        let made = Simulation::new(system, vec![state], LGVI, 0.1);
        says(made.err().map(|error| error.to_string()), expected);
    }

    let simulation = || fly(vec![state], 0.1).expect("a method");
    let error = simulation().advance(&[]).expect_err("no control");
    assert_eq!(
        error,
        StepError::Controls {
            expected: 1,
            found: 0
        }
    );
    says(
        simulation()
            .with_subdivision(31)
            .err()
            .map(|error| error.to_string()),
        "depth of the subdivision is 31, expected 30 at most",
    );
    let system = System::new(vec![body.clone()], vec![]);
    let method = Method::DormandPrince853 { tolerance: 1e-8 };
    let adaptive = Simulation::new(system, vec![state], method, 0.1).expect("a method");
    assert!(adaptive.with_subdivision(3).is_err());
}
