//! Lanes give bitwise the same results as simulations.

#![allow(clippy::unwrap_used)]

use lgvi_dynamics::gravity::{
    Central, Fixed, Gravity, Moments, Multipole, Mutual, Polyhedron, Uniform,
};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::lanes::{
    Flight, FlyError, Instructions, Member, Outcome, Thrust, Unfit, Width, fit, fly,
};
use lgvi_dynamics::{
    BodyState, Drive, Inertia, Load, Method, MethodError, Mobility, PointMass, RigidBody,
    Simulation, StepError, System,
};
use nalgebra::{Matrix3, Vector3};

/// Creates the system of a sample.
type MakeMember = fn(usize) -> Member;

const WIDTHS: [Width; 2] = [Width::One, Width::Eight];

const INSTRUCTIONS: [Instructions; 3] = [
    Instructions::Baseline,
    Instructions::Avx2,
    Instructions::Newest,
];

fn methods() -> impl Iterator<Item = Method> {
    let of_rotor = |rotor| {
        let compositions = [4, 6, 8, 10].map(|order| Method::Composition { order, rotor });
        [Method::Lgvi(rotor), Method::LieEuler(rotor)]
            .into_iter()
            .chain(compositions)
    };
    let nystrom = [4, 6, 8].map(|order| Method::Nystrom { order });
    of_rotor(Rotor::Discrete)
        .chain(of_rotor(Rotor::Exact))
        .chain(nystrom)
}

/// A number close to 1 that differs between samples.
fn about_one(sample: usize, which: usize) -> f64 {
    let mut rng = fastrand::Rng::with_seed((100 * sample + which) as u64);
    1.0 + 0.02 * (2.0 * rng.f64() - 1.0)
}

fn body(sample: usize, moments: [f64; 3], turned: bool, points: &[[f64; 3]]) -> RigidBody {
    let moments = Vector3::from(moments) * about_one(sample, 0);
    let axes = match turned {
        true => lgvi_lie::exp(&Vector3::new(0.3, 0.5, -0.2)),
        false => Matrix3::identity(),
    };
    let inertia = axes * Matrix3::from_diagonal(&moments) * axes.transpose();
    let mass = 1.5 * about_one(sample, 1);
    let points = points.iter().map(|&position| PointMass {
        mass: mass / points.len() as f64,
        position: position.into(),
    });
    RigidBody::new(mass, Inertia::new(inertia).unwrap(), points.collect()).unwrap()
}

fn state(sample: usize, body: &RigidBody, place: [f64; 3], rates: [[f64; 3]; 2]) -> BodyState {
    let [velocity, angular] = rates.map(Vector3::from);
    let position = Vector3::from(place) * about_one(sample, 2);
    let attitude = lgvi_lie::exp(&(Vector3::new(0.2, -0.4, 0.7) * about_one(sample, 3)));
    let angular = angular * about_one(sample, 4);
    BodyState::from_velocities(body, position, velocity, attitude, angular)
}

fn member(
    bodies: Vec<RigidBody>,
    gravity: Vec<Box<dyn Gravity>>,
    states: Vec<BodyState>,
) -> Member {
    Member {
        system: System::new(bodies, gravity),
        states,
        force: Vector3::repeat(1.0),
        moment: Vector3::repeat(1.0),
    }
}

/// Two bodies of two points each.
fn dumbbells(sample: usize) -> Member {
    let bodies = vec![
        body(
            sample,
            [0.02, 0.3, 0.31],
            false,
            &[[0.2, 0.0, 0.0], [-0.2, 0.0, 0.0]],
        ),
        body(
            sample + 50,
            [0.1, 0.9, 0.8],
            false,
            &[[0.0, 0.3, 0.0], [0.0, -0.3, 0.0]],
        ),
    ];
    let states = vec![
        state(
            sample,
            &bodies[0],
            [1.0, 0.0, 0.1],
            [[0.0, 0.6, 0.2], [0.4, 0.3, 2.0]],
        ),
        state(
            sample,
            &bodies[1],
            [-1.0, 0.0, 0.0],
            [[0.0, -0.6, 0.0], [0.2, -1.0, 0.5]],
        ),
    ];
    member(bodies, vec![Box::new(Mutual::new(1.0))], states)
}

/// Bodies of three, one and two points, the first two with rotated principal axes, the last one fixed.
fn company(sample: usize) -> Member {
    let triangle = [[0.2, 0.0, 0.1], [-0.2, 0.1, 0.0], [0.0, -0.1, -0.1]];
    let bodies = vec![
        body(sample, [0.5, 0.6, 0.7], true, &triangle)
            .with_radius(0.8)
            .unwrap(),
        body(sample, [0.3, 0.2, 0.4], true, &[]),
        body(
            sample,
            [0.3, 0.2, 0.4],
            false,
            &[[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0]],
        )
        .with_mobility(Mobility::Fixed),
    ];
    let rates = [[0.1, 0.3, -0.1], [0.5, -0.2, 0.8]];
    let states = vec![
        state(sample, &bodies[0], [3.0, 0.0, 0.0], rates),
        state(sample, &bodies[1], [0.0, 3.0, 0.5], rates),
        state(sample, &bodies[2], [-1.0, -2.0, 0.5], rates),
    ];
    member(bodies, vec![Box::new(Mutual::new(0.7))], states)
}

/// A satellite of an oblate planet that is not at the origin, with an additional uniform acceleration.
fn satellite(sample: usize) -> Member {
    let points = [[0.1, 0.0, 0.0], [-0.1, 0.2, 0.0], [0.0, -0.2, 0.0]];
    let bodies = vec![body(sample, [0.5, 0.6, 0.7], true, &points)];
    let states = vec![state(
        sample,
        &bodies[0],
        [2.0, 0.3, 0.5],
        [[0.0, 0.7, 0.1], [0.3, 0.1, 0.9]],
    )];
    member(bodies, attractors(), states)
}

fn attractors() -> Vec<Box<dyn Gravity>> {
    let pole = lgvi_lie::exp(&Vector3::new(0.4, 0.0, 0.1));
    let planet = Fixed::new(
        Multipole::oblate(1.0, 1e-2, 0.9),
        Vector3::new(0.1, 0.0, 0.2),
        pole,
    );
    vec![
        Box::new(planet.with_radius(0.5).unwrap()),
        Box::new(Central { gm: 0.2 }),
        Box::new(Uniform {
            acceleration: Vector3::new(0.0, 0.01, -0.02),
        }),
    ]
}

/// A pendulum in a uniform field.
fn pendulum(sample: usize) -> Member {
    let inertia = Inertia::principal([0.3 * about_one(sample, 0), 0.4, 0.5]).unwrap();
    let point = PointMass {
        mass: 1.0,
        position: Vector3::new(0.0, 0.0, -0.5),
    };
    let bodies = vec![RigidBody::pivoted(1.0, inertia, vec![point]).unwrap()];
    let states = vec![state(
        sample,
        &bodies[0],
        [0.0; 3],
        [[0.0; 3], [0.1, 0.7, 0.3]],
    )];
    let acceleration = Vector3::new(0.0, 0.0, -9.8);
    member(bodies, vec![Box::new(Uniform { acceleration })], states)
}

/// A free body that rotates so far in a step that the first pass seldom solves its equation.
fn spinner(sample: usize) -> Member {
    let bodies = vec![body(sample, [1.0, 2.0, 2.5], false, &[])];
    let states = vec![state(
        sample,
        &bodies[0],
        [0.0; 3],
        [[0.1; 3], [20.0, 15.0, 30.0]],
    )];
    member(bodies, Vec::new(), states)
}

fn multipole(sample: usize, moments: [f64; 3], turned: bool) -> RigidBody {
    let from = body(sample, moments, turned, &[]);
    let multipole = Multipole::of_inertia(from.mass(), from.inertia());
    RigidBody::with_multipole(from.inertia().clone(), multipole).unwrap()
}

/// A multipole of fourth order without symmetry.
fn lump(sample: usize) -> RigidBody {
    let from = body(sample, [0.5, 0.6, 0.7], true, &[]);
    let points = [
        [0.3, 0.1, -0.2],
        [-0.3, 0.2, 0.1],
        [0.1, -0.4, 0.3],
        [-0.1, 0.1, -0.2],
    ];
    let points = points.map(|position| PointMass {
        mass: 0.25 * from.mass(),
        position: position.into(),
    });
    let multipole = Multipole::of_moments(from.mass(), &Moments::of_points(&points));
    RigidBody::with_multipole(from.inertia().clone(), multipole).unwrap()
}

/// A multipole of fourth order of an ellipsoid.
fn ellipsoid(sample: usize) -> RigidBody {
    let from = body(sample, [0.5, 0.6, 0.7], false, &[]);
    let moments = Moments::of_ellipsoid(from.mass(), [0.5, 0.4, 0.3]);
    let multipole = Multipole::of_moments(from.mass(), &moments);
    RigidBody::with_multipole(from.inertia().clone(), multipole).unwrap()
}

/// Multipoles of fourth order, one of second order and a body of points, which attract each other.
fn lumps(sample: usize) -> Member {
    let points = [[0.1, 0.0, 0.0], [-0.1, 0.2, 0.0], [0.0, -0.2, 0.0]];
    let bodies = vec![
        lump(sample),
        body(sample, [0.3, 0.2, 0.4], false, &points),
        ellipsoid(sample + 20),
        multipole(sample + 40, [0.5, 0.6, 0.7], false),
    ];
    let rates = [[0.1, 0.3, -0.1], [0.5, -0.2, 0.8]];
    let places = [
        [3.0, 0.0, 0.0],
        [0.0, 3.0, 0.5],
        [-1.0, -2.0, 0.5],
        [0.0, 0.5, -3.0],
    ];
    let each = bodies.iter().zip(places);
    let states = each.map(|(body, place)| state(sample, body, place, rates));
    let states = states.collect();
    member(bodies, vec![Box::new(Mutual::new(0.7))], states)
}

/// Two multipoles, two bodies of points, and a multipole that is fixed, which attract each other, in a uniform field.
fn asteroids(sample: usize) -> Member {
    let points = [[0.1, 0.0, 0.0], [-0.1, 0.2, 0.0], [0.0, -0.2, 0.0]];
    let bodies = vec![
        multipole(sample, [0.5, 0.6, 0.7], true),
        body(sample, [0.3, 0.2, 0.4], false, &points),
        multipole(sample + 20, [0.4, 0.4, 0.6], false)
            .with_radius(0.3)
            .unwrap(),
        multipole(sample + 40, [0.5, 0.6, 0.7], false).with_mobility(Mobility::Fixed),
        body(sample, [0.3, 0.2, 0.4], true, &[]),
    ];
    let rates = [[0.1, 0.3, -0.1], [0.5, -0.2, 0.8]];
    let places = [
        [3.0, 0.0, 0.0],
        [0.0, 3.0, 0.5],
        [-1.0, -2.0, 0.5],
        [0.0, 0.5, -3.0],
        [-3.0, 2.0, 1.0],
    ];
    let each = bodies.iter().zip(places);
    let states = each.map(|(body, place)| state(sample, body, place, rates));
    let states = states.collect();
    let gravity: Vec<Box<dyn Gravity>> = vec![
        Box::new(Mutual::new(0.7)),
        Box::new(Uniform {
            acceleration: Vector3::new(0.0, 0.01, -0.02),
        }),
    ];
    member(bodies, gravity, states)
}

/// A multipole of second and one of fourth order under the attractors of [`satellite`].
fn orbiters(sample: usize) -> Member {
    let bodies = vec![multipole(sample, [0.5, 0.6, 0.7], true), lump(sample)];
    let rates = [[0.0, 0.7, 0.1], [0.3, 0.1, 0.9]];
    let states = vec![
        state(sample, &bodies[0], [2.0, 0.3, 0.5], rates),
        state(sample, &bodies[1], [2.5, 0.3, 0.5], rates),
    ];
    member(bodies, attractors(), states)
}

const SYSTEMS: [fn(usize) -> Member; 8] = [
    dumbbells, company, satellite, pendulum, spinner, asteroids, lumps, orbiters,
];

/// The result of a simulation.
fn simulated(flight: &Flight, member: Member) -> Outcome {
    let Member {
        system,
        states,
        force,
        moment,
    } = member;
    let mut loads = vec![Load::default(); states.len()];
    let simulation = Simulation::new(system, states, flight.method, flight.h).unwrap();
    let mut simulation = simulation.with_substeps(flight.substeps);
    let mut failure = None;
    for step in 0..flight.steps {
        if let Some(Thrust {
            body,
            loads: planned,
        }) = flight.thrust
        {
            let load = planned.get(step as usize).copied().unwrap_or_default();
            loads[body] = Load {
                force: load.force.component_mul(&force),
                moment: load.moment.component_mul(&moment),
            };
        }
        if let Err(error) = simulation.advance(&loads) {
            failure = Some(error);
            break;
        }
    }
    Outcome {
        states: simulation.states().to_vec(),
        steps: simulation.step(),
        failure,
    }
}

/// Bits of all numbers in the outcomes, including the signs of zeros.
fn bits(ends: &[Outcome]) -> Vec<u64> {
    let numbers = ends.iter().flat_map(|end| &end.states).flat_map(|state| {
        let vectors = [
            state.position,
            state.linear_momentum,
            state.angular_momentum,
        ];
        let vectors = vectors.iter().flat_map(|v| v.iter().copied());
        vectors
            .chain(state.attitude.iter().copied())
            .collect::<Vec<_>>()
    });
    numbers.map(f64::to_bits).collect()
}

fn flight(method: Method) -> Flight<'static> {
    Flight {
        method,
        h: 0.01,
        substeps: 1,
        steps: 60,
        thrust: None,
    }
}

/// Integrates `count` systems by simulations and by lanes with every width and instruction set, checks that the results
/// agree, and returns the outcomes.
fn agree(flight: &Flight, system: impl Fn(usize) -> Member, count: usize) -> Vec<Outcome> {
    let expected: Vec<_> = (0..count).map(|k| simulated(flight, system(k))).collect();
    let members: Vec<_> = (0..count).map(system).collect();
    for width in WIDTHS {
        for instructions in INSTRUCTIONS {
            let found = fly(flight, &members, width, instructions).unwrap();
            assert_eq!(
                found, expected,
                "{width:?} {instructions:?} {}",
                flight.method
            );
            assert!(bits(&found) == bits(&expected), "zeros differ in sign");
        }
    }
    expected
}

#[test]
fn every_method_and_system_ends_where_the_simulation_does() {
    for system in SYSTEMS {
        for method in methods() {
            let ends = agree(&flight(method), system, 11);
            assert!(ends.iter().all(|end| end.failure.is_none()), "{ends:?}");
        }
    }
}

/// Axisymmetric bodies about each body axis and about another axis, with equal moments to rounding, and a sphere.
/// Asymmetric bodies on both sides of the separatrix, near it, near their axes, nearly symmetric, and long rods.
const MOMENTS: [[f64; 3]; 11] = [
    [1.0, 2.0, 2.0],
    [2.0, 1.0, 2.0],
    [2.0, 2.0, 3.0],
    [2.0, 2.0, 2.0],
    [1.0, 2.0, 2.5],
    [2.5, 1.0, 2.0],
    [2.0, 2.5, 1.0],
    [1.0, 1.001, 1.5],
    [1.0, 1.499, 1.5],
    [1e-6, 1.0, 1.0000005],
    [0.3, 1.0, 1.0 + 1e-14],
];

/// Neighboring lanes range from angles that short series suffice for to several turns per step, on both sides of every
/// limit between formulas, and rest.
#[test]
fn free_rotations_of_all_kinds_and_speeds_are_the_same() {
    let directions = [
        [0.3, 0.5, 0.7],
        [1.0, 1e-9, 0.2],
        [1e-5, 1.0, -1e-5],
        [0.0, 0.0, -1.0],
        [0.0, 1.0, 0.0],
        [-0.2, -1e-3, 0.9],
        [1.0, 0.01, 0.0],
    ];
    let speeds = [0.0, 1e-3, 1.0, 4.0, 12.0, 30.0, 100.0, 700.0];
    let flight = Flight {
        steps: 25,
        ..flight(Method::Nystrom { order: 4 })
    };
    for moments in MOMENTS {
        for turned in [false, true] {
            for direction in directions {
                let fast = |sample: usize| {
                    let bodies = vec![body(sample, moments, turned, &[])];
                    let mut states = vec![state(sample, &bodies[0], [0.0; 3], [[0.1; 3]; 2])];
                    let momentum = Vector3::from(direction) * about_one(sample, 5);
                    states[0].angular_momentum = momentum * speeds[sample % speeds.len()];
                    member(bodies, Vec::new(), states)
                };
                agree(&flight, fast, 16);
                // All at one speed, so that no lane keeps the others from short series.
                for speed in [1.0, 10.0, 25.0, 100.0] {
                    let alike = |sample: usize| {
                        let mut member = fast(sample);
                        let momentum = Vector3::from(direction) * about_one(sample, 5);
                        member.states[0].angular_momentum = momentum * speed;
                        member
                    };
                    agree(&flight, alike, 5);
                }
            }
        }
    }
}

/// Bodies of different kinds side by side.
#[test]
fn kinds_of_bodies_may_differ_between_members() {
    let mixed = |sample: usize| {
        let moments = MOMENTS[sample % MOMENTS.len()];
        let bodies = vec![body(sample, moments, sample.is_multiple_of(2), &[])];
        let rates = [[0.1; 3], [3.0, -1.0, 2.0]];
        let states = vec![state(sample, &bodies[0], [0.0; 3], rates)];
        member(bodies, Vec::new(), states)
    };
    agree(&flight(Method::Nystrom { order: 6 }), mixed, 22);
}

/// Neighboring lanes range from steps that are solved in the first pass to steps that need Newton's method.
#[test]
fn longer_steps_are_repeated_as_the_simulation_does() {
    let faster = |sample: usize| {
        let mut member = company(sample);
        for state in &mut member.states {
            state.angular_momentum *= 1.5_f64.powi(sample as i32);
        }
        member
    };
    for h in [0.001, 0.01, 0.1] {
        let lgvi = Method::Lgvi(Rotor::default());
        agree(&Flight { h, ..flight(lgvi) }, faster, 9);
    }
}

#[test]
fn substeps_and_flights_back_in_time_are_the_same() {
    for method in methods() {
        let flight = flight(method);
        agree(
            &Flight {
                substeps: 3,
                ..flight
            },
            dumbbells,
            5,
        );
        agree(&Flight { h: -0.02, ..flight }, satellite, 5);
    }
}

#[test]
fn thrust_acts_with_the_errors_of_each_member() {
    let loads: Vec<_> = (0..40)
        .map(|step| Load {
            force: Vector3::new(0.1, -0.05, 0.01 * f64::from(step)),
            moment: Vector3::new(0.0, 0.02, 0.01),
        })
        .collect();
    let systems: [(usize, MakeMember); 3] = [(1, dumbbells), (0, satellite), (0, spinner)];
    for (body, system) in systems {
        let with_errors = |sample: usize| Member {
            force: Vector3::new(1.0, about_one(sample, 7), 0.9),
            moment: Vector3::repeat(about_one(sample, 8)),
            ..system(sample)
        };
        for method in methods() {
            let thrust = Some(Thrust {
                body,
                loads: &loads,
            });
            let flight = Flight {
                thrust,
                ..flight(method)
            };
            let pushed = agree(&flight, with_errors, 5);
            let coasting = agree(
                &Flight {
                    thrust: None,
                    ..flight
                },
                with_errors,
                5,
            );
            assert_ne!(pushed, coasting);
        }
    }
}

/// One system rotates too far, one body falls into another, and one overflows. Each flight ends with the same error as
/// its simulation and does not affect its neighbors.
#[test]
fn a_lane_that_fails_is_left_alone() {
    let method = Method::Lgvi(Rotor::default());
    let flight = Flight {
        steps: 400,
        ..flight(method)
    };
    let troubled = |sample: usize| {
        let mut member = company(sample);
        match sample % 7 {
            1 => member.states[1].angular_momentum *= 300.0,
            2 => {
                member.states[1].position = Vector3::new(3.0, 1.2, 0.0);
                member.states[1].linear_momentum = Vector3::new(0.0, -1.0, 0.0);
            }
            4 => member.states[1].linear_momentum = Vector3::repeat(1e308),
            _ => {}
        }
        member
    };
    let ends = agree(&flight, troubled, 14);
    let failures: Vec<_> = ends.iter().map(|end| end.failure).collect();
    assert!(
        matches!(failures[1], Some(StepError::Unsolvable { body: 1, .. })),
        "{failures:?}"
    );
    assert!(
        matches!(failures[2], Some(StepError::CloseApproach(_))),
        "{failures:?}"
    );
    assert!(
        matches!(failures[4], Some(StepError::NotFinite { .. })),
        "{failures:?}"
    );
    assert_eq!(failures.iter().flatten().count(), 6);
    assert!(ends[2].steps > 0 && ends[2].steps < 400);
    assert_eq!(ends[3].steps, 400);
}

#[test]
fn what_lanes_cannot_fly_is_refused() {
    let unfit = |system: &System, method| fit(system, method).unwrap_err();
    let lgvi = Method::Lgvi(Rotor::default());
    let Member { system, .. } = dumbbells(0);
    assert!(fit(&system, lgvi).is_ok());
    for method in [
        Method::ImplicitMidpoint,
        Method::ClosedForm,
        Method::Nystrom { order: 5 },
    ] {
        assert!(
            matches!(unfit(&system, method), Unfit::Method { .. }),
            "{method}"
        );
    }
    let plain = || body(0, [0.5, 0.6, 0.7], false, &[]);
    let driven = plain().with_mobility(Mobility::Driven(Drive::default()));
    let system = System::new(vec![plain(), driven], vec![]);
    assert_eq!(unfit(&system, lgvi), Unfit::Mobility { body: 1 });
    let cube = Polyhedron::cuboid([1.0; 3], 1.0).unwrap();
    let body = RigidBody::with_polyhedron(None, &cube, 2).unwrap();
    let system = System::new(vec![body], vec![]);
    assert_eq!(unfit(&system, lgvi), Unfit::Distribution { body: 0 });

    let members = [dumbbells(0), satellite(0)];
    let fly = |flight: Flight, members: &[Member]| {
        fly(&flight, members, Width::Eight, Instructions::Newest).unwrap_err()
    };
    let unlike = FlyError::Unfit(Unfit::Unlike { member: 1 });
    assert_eq!(fly(flight(lgvi), &members), unlike);
    let thrust = Some(Thrust {
        body: 2,
        loads: &[],
    });
    let refused = fly(
        Flight {
            thrust,
            ..flight(lgvi)
        },
        &members[..1],
    );
    assert_eq!(refused, FlyError::Unfit(Unfit::Thrust { body: 2 }));
    let refused = fly(
        Flight {
            h: 0.0,
            ..flight(lgvi)
        },
        &members[..1],
    );
    assert!(
        matches!(refused, FlyError::Method(MethodError::Parameter { .. })),
        "{refused}"
    );
    let stateless = Member {
        states: vec![],
        ..dumbbells(0)
    };
    let refused = fly(flight(lgvi), &[stateless]);
    assert!(
        matches!(refused, FlyError::Method(MethodError::StateCount { .. })),
        "{refused}"
    );
}
