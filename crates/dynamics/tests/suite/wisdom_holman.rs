//! What Wisdom–Holman splittings promise beyond the conformance suite: errors in proportion to the perturbation, exact Kepler
//! motion, momenta to rounding, and refusals.

use fastrand::Rng;
use lgvi_dynamics::docking::{Docking, Port};
use lgvi_dynamics::gravity::{Central, Gravity, Multipole, Mutual, Uniform};
use lgvi_dynamics::integrator::KeplerScheme;
use lgvi_dynamics::{
    BodyState, Inertia, Load, Method, MethodError, Mobility, PointMass, RigidBody, Simulation,
    StepError, System,
};
use nalgebra::{Matrix3, Vector3};

use crate::case::Case;

const SCHEMES: [KeplerScheme; 4] = [
    KeplerScheme::Leapfrog,
    KeplerScheme::Aba82,
    KeplerScheme::Aba864,
    KeplerScheme::Aba1064,
];

fn method(scheme: KeplerScheme) -> Method {
    Method::WisdomHolman { scheme }
}

fn best() -> Method {
    method(KeplerScheme::Aba1064)
}

const REFERENCE: Method = Method::DormandPrince853 { tolerance: 1e-16 };

fn point(mass: f64) -> RigidBody {
    let inertia = Inertia::principal([0.4 * mass; 3]).expect("inertia");
    RigidBody::new(mass, inertia, vec![]).expect("a body")
}

fn quadrupole(mass: f64, moments: [f64; 3]) -> RigidBody {
    let inertia = Inertia::principal(moments.map(|moment| moment * mass)).expect("inertia");
    let multipole = Multipole::of_inertia(mass, &inertia);
    RigidBody::with_multipole(inertia, multipole).expect("a body")
}

fn dumbbell(mass: f64, half: f64) -> RigidBody {
    let points = [half, -half].map(|x| PointMass {
        mass: 0.5 * mass,
        position: Vector3::new(x, 0.0, 0.0),
    });
    let across = mass * half * half;
    let inertia = Inertia::principal([0.1 * across, across, across]).expect("inertia");
    RigidBody::new(mass, inertia, points.to_vec()).expect("a body")
}

fn at(body: &RigidBody, position: [f64; 3], velocity: [f64; 3]) -> BodyState {
    let rate = Vector3::new(0.1, -0.3, 0.7);
    let (position, velocity) = (position.into(), velocity.into());
    BodyState::from_velocities(body, position, velocity, Matrix3::identity(), rate)
}

/// A system with its states.
type Flight = (Vec<RigidBody>, Vec<BodyState>, Vec<Box<dyn Gravity>>);

fn fly((bodies, states, gravity): Flight, method: Method, t: f64, steps: u32) -> Simulation {
    let system = System::new(bodies, gravity);
    let mut simulation =
        Simulation::new(system, states, method, t / f64::from(steps)).expect("a method");
    let none = vec![Load::default(); simulation.states().len()];
    for _ in 0..steps {
        simulation.advance(&none).expect("a step");
    }
    simulation
}

/// The largest difference of positions.
fn apart(one: &Simulation, other: &Simulation) -> f64 {
    let each = one.states().iter().zip(other.states());
    let each = each.map(|(a, b)| (a.position - b.position).norm());
    each.fold(0.0, f64::max)
}

/// A point about a center whose oblateness is of size ε.
fn oblate(epsilon: f64) -> Flight {
    let body = point(1e-3);
    let state = at(&body, [1.0, 0.1, 0.0], [0.05, 1.05, 0.2]);
    let center = Multipole::oblate(1.0, epsilon, 0.5);
    (vec![body], vec![state], vec![Box::new(center)])
}

/// Two planets of masses ε about a star, and the asphericity of the star and of one of them.
fn planets(epsilon: f64) -> Flight {
    let bodies = vec![
        quadrupole(1.0, [0.01, 0.012, 0.014].map(|moment| moment * epsilon)),
        quadrupole(epsilon, [0.01, 0.012, 0.015].map(|moment| moment * epsilon)),
        point(0.7 * epsilon),
    ];
    let states = vec![
        at(&bodies[0], [0.0; 3], [0.0, 0.01, 0.0]),
        at(&bodies[1], [1.0, 0.0, 0.1], [0.0, 1.02, 0.1]),
        at(&bodies[2], [-2.0, 0.3, 0.0], [-0.1, -0.7, 0.0]),
    ];
    (bodies, states, vec![Box::new(Mutual::new(1.0))])
}

/// The first of the generalized orders is that of the part of the error that is linear in the perturbation, so a tenth of the
/// perturbation has a tenth of the error or less.
#[test]
fn errors_fall_with_the_step_and_with_the_perturbation() {
    for (name, flight) in [
        ("oblate", oblate as fn(f64) -> Flight),
        ("planets", planets),
    ] {
        for (scheme, order, steps, shrinks) in [
            (KeplerScheme::Leapfrog, 2.0, 64, 1.0),
            (KeplerScheme::Aba82, 2.0, 64, 2.0),
            (KeplerScheme::Aba864, 4.0, 24, 1.0),
            (KeplerScheme::Aba1064, 4.0, 24, 1.0),
        ] {
            let error = |epsilon: f64, steps: u32| {
                let end = fly(flight(epsilon), method(scheme), 6.0, steps);
                apart(&end, &fly(flight(epsilon), REFERENCE, 6.0, 1))
            };
            let errors = [error(3e-2, steps), error(3e-2, 2 * steps)];
            let found = (errors[0] / errors[1]).log2();
            let small = error(3e-3, steps);
            let falls = (errors[0] / small).log10();
            println!("{name}, {scheme}: {errors:?}, order {found:.2}; {small:e}, power {falls:.2}");
            assert!(found > order - 0.2, "{name}, {scheme}: {found}");
            assert!(falls > shrinks - 0.3, "{name}, {scheme}: {falls}");
        }
    }
}

/// A point about a point, at a fixed source, a fixed body or a free one, moves exactly in steps of any length.
#[test]
fn kepler_motion_is_exact() {
    let light = || point(0.01);
    let state = || at(&light(), [1.0, 0.2, 0.0], [0.1, 1.1, 0.3]);
    let heavy = || point(2.0);
    let rest = || at(&heavy(), [0.3, 0.0, 0.0], [0.0; 3]);
    let flights: [&dyn Fn() -> Flight; 3] = [
        &|| {
            (
                vec![light()],
                vec![state()],
                vec![Box::new(Central { gm: 1.5 })],
            )
        },
        &|| {
            let bodies = vec![light(), heavy().with_mobility(Mobility::Fixed)];
            (
                bodies,
                vec![state(), rest()],
                vec![Box::new(Mutual::new(1.0))],
            )
        },
        &|| {
            let states = vec![state(), rest()];
            (
                vec![light(), heavy()],
                states,
                vec![Box::new(Mutual::new(1.0))],
            )
        },
    ];
    for flight in flights {
        let reference = fly(flight(), REFERENCE, 30.0, 1);
        for (scheme, steps) in SCHEMES.into_iter().zip([1, 3, 7, 100]) {
            let error = apart(&fly(flight(), method(scheme), 30.0, steps), &reference);
            println!("{scheme}, {steps}: {error:e}");
            assert!(error < 1e-11, "{scheme}, {steps}: {error:e}");
        }
    }
}

/// A heavy body and others on random orbits about it, each of any kind and spin.
fn crowd(rng: &mut Rng) -> Flight {
    let mut random = |low: f64, high: f64| low + (high - low) * rng.f64();
    let count = random(1.0, 6.0) as usize;
    let mut bodies = vec![quadrupole(1.0, [0.002, 0.003, 0.004])];
    let mut states = vec![at(
        &bodies[0],
        [random(-5.0, 5.0), random(-5.0, 5.0), random(-5.0, 5.0)],
        [random(-0.2, 0.2), random(-0.2, 0.2), random(-0.2, 0.2)],
    )];
    for place in 0..count {
        let mass = random(1e-6, 1e-3);
        let body = match place % 3 {
            0 => point(mass),
            1 => dumbbell(mass, random(0.001, 0.05)),
            _ => quadrupole(mass, [1e-4, 1.5e-4, 2e-4]),
        };
        let distance = 1.5_f64.powi(place as i32) * random(0.95, 1.05);
        let (angle, tilt) = (random(0.0, 6.3), random(-0.3, 0.3));
        let speed = random(0.9, 1.1) / distance.sqrt();
        let (sin, cos) = libm::sincos(angle);
        let relative = [distance * cos, distance * sin, distance * tilt];
        let velocity = [-speed * sin, speed * cos, 0.1 * speed * tilt];
        let mut state = at(&body, relative, velocity);
        state.position += states[0].position;
        state.linear_momentum += body.mass() * states[0].linear_momentum;
        bodies.push(body);
        states.push(state);
    }
    // In no order.
    let last = bodies.len() - 1;
    bodies.swap(0, last);
    states.swap(0, last);
    (bodies, states, vec![Box::new(Mutual::new(1.0))])
}

#[test]
fn momenta_of_random_systems_are_kept_to_rounding() {
    let mut rng = Rng::with_seed(20131);
    let mut worst = [0.0_f64; 2];
    for run in 0..60 {
        let (bodies, states, gravity) = crowd(&mut rng);
        let system = System::new(bodies, gravity);
        let scheme = SCHEMES[run % 4];
        let mut simulation =
            Simulation::new(system, states, method(scheme), 0.2).expect("a method");
        let start = simulation.invariants();
        let none = vec![Load::default(); simulation.states().len()];
        for _ in 0..500 {
            simulation.advance(&none).expect("a step");
        }
        let end = simulation.invariants();
        let (mut linear, mut angular) = (0.0, 0.0);
        for state in simulation.states() {
            linear += state.linear_momentum.norm();
            angular += state.position.norm() * state.linear_momentum.norm();
        }
        let errors = [
            (end.linear_momentum - start.linear_momentum).norm() / linear,
            (end.angular_momentum - start.angular_momentum).norm() / angular,
        ];
        for (worst, error) in worst.iter_mut().zip(errors) {
            *worst = worst.max(error);
        }
        assert!(end.orthogonality_error < 3e-15, "{run}");
        let energy = (end.energy / start.energy - 1.0).abs();
        assert!(energy < 1e-4, "{run}: {energy:e}");
    }
    println!("{worst:?}");
    assert!(worst[0] < 1e-13 && worst[1] < 1e-13, "{worst:?}");
}

/// The outer planets over 200 000 days in steps of 312.5 days, a fourteenth of Jupiter's revolution.
#[test]
fn the_outer_planets_are_met_in_long_steps() {
    let error = Case::load("f_outer_planets").errors_at(200_000.0, 640, best());
    println!("{:e}", error.position);
    assert!(error.position < 1e-8, "{:e}", error.position);
}

/// A satellite on a low orbit for a day in steps of two minutes. Its error is below a micrometer for a body of the Earth's size.
#[test]
fn a_low_orbit_under_j2_is_met() {
    let flight = || -> Flight {
        let inertia = Inertia::principal([25.0, 110.0, 120.0]).expect("inertia");
        let multipole = Multipole::of_inertia(250.0, &inertia);
        let body = RigidBody::with_multipole(inertia, multipole).expect("a body");
        let state = BodyState::from_velocities(
            &body,
            Vector3::new(7_078_137.0, 0.0, 0.0),
            Vector3::new(0.0, -1069.47, 7432.68),
            Matrix3::identity(),
            Vector3::new(2e-5, -3e-5, 1.11e-3),
        );
        let earth = Multipole::oblate(3.986004418e14, 1.08262668e-3, 6_378_137.0);
        (vec![body], vec![state], vec![Box::new(earth)])
    };
    let reference = fly(flight(), REFERENCE, 86_400.0, 1);
    let errors = [240, 480, 960].map(|steps| {
        let end = fly(flight(), best(), 86_400.0, steps);
        let [one, other] = [&end, &reference].map(|flown| flown.states()[0]);
        (one.position - other.position).norm()
    });
    println!("{errors:?}");
    assert!(errors[0] < 0.1 && errors[2] < 1e-4, "{errors:?}");
}

fn refusal(flight: Flight) -> MethodError {
    let (bodies, states, gravity) = flight;
    match Simulation::new(System::new(bodies, gravity), states, best(), 0.1) {
        Ok(_) => panic!("not refused"),
        Err(error) => error,
    }
}

#[test]
fn what_it_is_not_for_is_refused() {
    let state = |body: &RigidBody, x: f64| at(body, [x, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let body = point(1.0);
    let alone = || (vec![point(1.0)], vec![state(&body, 1.0)]);

    for gravity in [
        Vec::new(),
        vec![Box::new(Mutual::new(1.0)) as Box<dyn Gravity>],
        vec![Box::new(Uniform {
            acceleration: Vector3::x(),
        })],
    ] {
        let (bodies, states) = alone();
        let error = refusal((bodies, states, gravity));
        assert!(matches!(error, MethodError::Center { .. }), "{error}");
        assert!(error.to_string().contains("Nyström"), "{error}");
    }

    let (bodies, states) = alone();
    let pivoted = bodies
        .into_iter()
        .map(|body| body.with_mobility(Mobility::Pivoted));
    let error = refusal((
        pivoted.collect(),
        states,
        vec![Box::new(Central { gm: 1.0 })],
    ));
    assert!(
        matches!(error, MethodError::Body { body: 0, .. }),
        "{error}"
    );

    // Three equal bodies, each as near to one as to the other.
    let states = [-1.0, 1.0, 0.5].map(|x| state(&body, x)).to_vec();
    let bodies = vec![body.clone(), body.clone(), body.clone()];
    let error = refusal((bodies, states, vec![Box::new(Mutual::new(1.0))]));
    assert!(
        matches!(error, MethodError::Perturbation { ratio, .. } if ratio > 0.5),
        "{error}"
    );

    // A moon that its planet attracts more than its star does.
    let bodies = vec![point(1.0), point(1e-3), point(1e-8)];
    let states = vec![
        state(&bodies[0], 0.0),
        state(&bodies[1], 1.0),
        state(&bodies[2], 1.01),
    ];
    let error = refusal((bodies, states, vec![Box::new(Mutual::new(1.0))]));
    assert!(
        matches!(error, MethodError::Perturbation { body: 1 | 2, .. }),
        "{error}"
    );
}

/// States that are not of its kind are refused in flight too, and leave it as it was.
#[test]
fn new_states_are_checked() {
    let (bodies, states, gravity) = planets(1e-3);
    let mut simulation = Simulation::new(System::new(bodies, gravity), states.clone(), best(), 0.1)
        .expect("planets");
    let mut other = states.clone();
    other[2].position = other[1].position + Vector3::new(1e-3, 0.0, 0.0);
    let error = simulation.set_states(&other).expect_err("too near");
    assert!(matches!(error, MethodError::Perturbation { .. }), "{error}");
    assert_eq!(simulation.states(), states);
    simulation.advance(&[Load::default(); 3]).expect("a step");
}

/// A body falls from rest into its center just at the end of a step.
#[test]
fn a_collision_is_an_error_and_leaves_no_trace() {
    let body = point(1.0);
    let state = at(&body, [1.0, 0.0, 0.0], [0.0; 3]);
    let system = System::new(vec![body], vec![Box::new(Central { gm: 1.0 })]);
    let h = std::f64::consts::PI / 8.0_f64.sqrt();
    let leapfrog = method(KeplerScheme::Leapfrog);
    let mut simulation = Simulation::new(system, vec![state], leapfrog, h).expect("a method");
    let made = simulation.advance(&[Load::default()]);
    if let Err(error) = made {
        assert!(matches!(error, StepError::NotFinite { body: 0 }), "{error}");
        assert_eq!(simulation.states(), [state]);
    } else {
        assert!(simulation.states()[0].position.norm() < 1e-7);
    }
}

/// Two bodies about a center dock at once and then fly as one, as by a method with error control.
#[test]
fn bodies_that_dock_fly_on() {
    let bodies = vec![dumbbell(1e-3, 0.02), dumbbell(2e-3, 0.01)];
    let states = vec![
        at(&bodies[0], [1.0, 0.0, 0.0], [0.0, 1.05, 0.1]),
        at(&bodies[1], [1.08, 0.0, 0.0], [0.0, 1.04, 0.1]),
    ];
    let port = |body| Port {
        body,
        position: Vector3::zeros(),
        axis: Vector3::x(),
    };
    let docking = Docking {
        ports: [port(0), port(1)],
        distance: f64::INFINITY,
        angle: 4.0,
        speed: f64::INFINITY,
        rate: f64::INFINITY,
    };
    let gravity = || -> Vec<Box<dyn Gravity>> {
        vec![
            Box::new(Multipole::oblate(1.0, 1e-3, 0.5)),
            Box::new(Mutual::new(1e-6)),
        ]
    };
    let ends = [best(), REFERENCE].map(|method| {
        let simulation = move |system, states| Simulation::new(system, states, method, 0.05);
        let start = simulation(System::new(bodies.clone(), gravity()), states.clone());
        let joined = start
            .expect("a method")
            .with_dockings(vec![docking], gravity, simulation);
        let mut joined = joined.expect("a docking");
        for _ in 0..100 {
            joined.advance(&[Load::default(); 2]).expect("a step");
        }
        assert_eq!(joined.docked().len(), 1);
        joined
    });
    let error = apart(&ends[0], &ends[1]);
    println!("{error:e}");
    assert!(error < 1e-7, "{error:e}");
}
