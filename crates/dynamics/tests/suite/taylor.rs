//! What Taylor series promise: accuracy on reference trajectories and on random systems of every supported kind, and
//! refusals.

use lgvi_dynamics::docking::{Docking, Port};
use lgvi_dynamics::gravity::{
    Central, Fixed, Gravity, Moments, Multipole, Mutual, Polyhedron, Uniform,
};
use lgvi_dynamics::{
    BodyState, Drive, Inertia, Load, Method, MethodError, Mobility, PointMass, RigidBody,
    Simulation, StepError, System,
};
use lgvi_truth::random::Random;
use nalgebra::{Matrix3, Vector3};

use crate::case::Case;

fn taylor(tolerance: f64) -> Method {
    Method::Taylor { tolerance }
}

/// Over eight decades, the error in multiples of the case's lengths stays within a constant factor of the tolerance.
#[test]
fn errors_are_proportional_to_the_tolerance() {
    for (case, t, length) in [
        ("a1_two_dumbbells_regular", 10.0, 1.0),
        ("a2_two_dumbbells_coupled", 2.0, 1.0),
        ("c1_3d_pendulum", 2.0, 1.0),
        ("d_dumbbell_central", 10.0, 1.0),
        ("e_kw4_like", 86_400.0, 2_500.0),
        ("f_outer_planets", 10_000.0, 10.0),
        ("g_kepler", 10.0, 1.0),
        ("h_five_bodies", 5.0, 4.0),
        ("i_ten_bodies", 5.0, 8.0),
    ] {
        let reference = Case::load(case);
        for exponent in [5, 7, 9, 11, 13] {
            let tolerance = 10f64.powi(-exponent);
            let error = reference.errors_at(t, 1, taylor(tolerance)).greatest() / length;
            println!("{case} {tolerance:e}: {error:.2e}");
            assert!(
                error < 100.0 * tolerance,
                "{case}, {tolerance:e}: {error:e}"
            );
        }
    }
}

/// A random symmetric positive definite inertia of a body of mass 1, with general principal axes.
fn inertia(random: &mut Random, mass: f64) -> Inertia {
    let second = Vector3::from_fn(|_, _| random.uniform(0.01, 0.05)) * mass;
    let trace = second.sum();
    let axes = random.rotation();
    let moments = Matrix3::from_diagonal(&second.map(|one| trace - one));
    let matrix = axes * moments * axes.transpose();
    Inertia::new(0.5 * (matrix + matrix.transpose())).expect("an inertia")
}

/// Points about their center of mass: one, some on a line, or some in space.
fn points(random: &mut Random, mass: f64) -> Vec<PointMass> {
    let count = 1 + random.below(5);
    let on_a_line = random.below(2) == 0;
    let axis = random.direction();
    let positions: Vec<_> = (0..count)
        .map(|_| {
            let position = 0.15 * random.normals();
            if on_a_line {
                position.dot(&axis) * axis
            } else {
                position
            }
        })
        .collect();
    let center = positions.iter().sum::<Vector3<f64>>() / count as f64;
    let mass = mass / count as f64;
    let centered = positions.into_iter().map(|position| PointMass {
        mass,
        position: position - center,
    });
    centered.collect()
}

fn body(random: &mut Random, multipoles: bool) -> RigidBody {
    let mass = random.log_uniform(0.1, 2.0);
    let inertia = inertia(random, mass);
    let body = if !multipoles {
        RigidBody::new(mass, inertia, points(random, mass))
    } else if random.below(4) == 0 {
        RigidBody::new(mass, inertia, vec![])
    } else {
        RigidBody::with_multipole(inertia.clone(), Multipole::of_inertia(mass, &inertia))
    };
    let body = body.expect("a body");
    match random.below(7) {
        0 => body.with_mobility(Mobility::Fixed),
        1 => body.with_mobility(Mobility::Pivoted),
        2 => body.with_mobility(Mobility::Driven(Drive {
            velocity: 0.2 * random.normals(),
            rate: 0.1 * random.normals(),
            spin: random.normals(),
        })),
        _ => body,
    }
}

/// Bodies some units apart under mutual attraction, sources of every kind, and controls.
struct Flight {
    bodies: Vec<RigidBody>,
    states: Vec<BodyState>,
    sources: Vec<usize>,
    oblate: (Multipole, Vector3<f64>, Matrix3<f64>),
    controls: Vec<Load>,
}

impl Flight {
    fn random(index: u64) -> Self {
        let mut random = Random::new(0x7a71, index);
        let multipoles = random.below(2) == 0;
        let count = 1 + random.below(4);
        let bodies: Vec<_> = (0..count).map(|_| body(&mut random, multipoles)).collect();
        let mut states = Vec::new();
        for (place, body) in bodies.iter().enumerate() {
            let position = Vector3::new(2.5 * place as f64, 0.0, 0.0) + 0.3 * random.normals();
            let velocity = 0.4 * random.normals();
            let attitude = random.rotation();
            let rate = random.normals();
            states.push(BodyState::from_velocities(
                body, position, velocity, attitude, rate,
            ));
        }
        let control = |random: &mut Random| match random.below(3) {
            0 => Load {
                force: 0.1 * random.normals(),
                moment: 0.01 * random.normals(),
            },
            _ => Load::default(),
        };
        let controls = (0..count).map(|_| control(&mut random)).collect();
        let sources = (0..4).filter(|_| random.below(2) == 0).collect();
        let oblate = (
            Multipole::oblate(3.0, 0.3, 0.8),
            Vector3::new(-4.0, 2.0, 1.0),
            random.rotation(),
        );
        Self {
            bodies,
            states,
            sources,
            oblate,
            controls,
        }
    }

    fn system(&self) -> System {
        let each = self.sources.iter().map(|source| -> Box<dyn Gravity> {
            let (multipole, position, attitude) = &self.oblate;
            match source {
                0 => Box::new(Mutual::new(1.0)),
                1 => Box::new(Uniform {
                    acceleration: Vector3::new(0.1, -0.2, 0.05),
                }),
                2 => Box::new(Fixed::new(multipole.clone(), *position, *attitude)),
                _ => Box::new(Fixed::new(
                    Central { gm: 2.0 },
                    Vector3::new(1.0, 6.0, -2.0),
                    Matrix3::identity(),
                )),
            }
        });
        System::new(self.bodies.clone(), each.collect())
    }

    fn fly(&self, method: Method, steps: u32) -> Vec<BodyState> {
        let h = 2.0 / f64::from(steps);
        let mut simulation = Simulation::new(self.system(), self.states.clone(), method, h)
            .unwrap_or_else(|error| panic!("{error}"));
        for _ in 0..steps {
            simulation.advance(&self.controls).expect("a step");
        }
        simulation.states().to_vec()
    }
}

fn distance(a: &[BodyState], b: &[BodyState]) -> f64 {
    let one = |(a, b): (&BodyState, &BodyState)| {
        (a.position - b.position)
            .norm()
            .max((a.attitude - b.attitude).norm())
            .max((a.linear_momentum - b.linear_momentum).norm())
            .max((a.angular_momentum - b.angular_momentum).norm())
    };
    a.iter().zip(b).map(one).fold(0.0, f64::max)
}

/// Every kind of body, source and mobility, in random combinations.
#[test]
fn random_systems_agree_with_another_method() {
    for index in 0..150 {
        let flight = Flight::random(index);
        let reference = flight.fly(Method::DormandPrince853 { tolerance: 1e-16 }, 1);
        let fine = distance(&flight.fly(taylor(1e-16), 1), &reference);
        let coarse = distance(&flight.fly(taylor(1e-8), 1), &reference);
        println!("{index}: {fine:.1e}, {coarse:.1e}");
        assert!(
            fine < 1e-12 && coarse < 1e-6,
            "{index}: {fine:e}, {coarse:e}"
        );
    }
}

/// States shown within steps lie on the same solution, bit for bit, forward and backward in time.
#[test]
fn the_solution_does_not_depend_on_the_output() {
    for index in 0..20 {
        let flight = Flight::random(index);
        for tolerance in [1e-4, 1e-12] {
            let once = flight.fly(taylor(tolerance), 1);
            let often = flight.fly(taylor(tolerance), 512);
            assert_eq!(once, often, "{index}, {tolerance:e}");
        }
    }
}

/// Attitudes are rotations to rounding at any tolerance and time.
#[test]
fn attitudes_are_rotations() {
    for index in 0..20 {
        for state in Flight::random(index).fly(taylor(1e-3), 7) {
            let error = lgvi_lie::orthogonality_error(&state.attitude);
            assert!(error < 2e-15, "{index}: {error:e}");
        }
    }
}

/// The relative energy errors of flights over `time` whose truncation errors are below rounding, from twelve starts.
fn rounding(case: &str, time: f64) -> [f64; 12] {
    let case = Case::load(case);
    let (system, states) = case.system();
    let masses: Vec<f64> = system.bodies().iter().map(RigidBody::mass).collect();
    let total: f64 = masses.iter().sum();
    let center = |of: &dyn Fn(&BodyState, f64) -> Vector3<f64>| {
        let parts = states
            .iter()
            .zip(&masses)
            .map(|(state, mass)| of(state, *mass));
        parts.sum::<Vector3<f64>>() / total
    };
    let position = center(&|state, mass| mass * state.position);
    let velocity = center(&|state, _| state.linear_momentum);
    std::array::from_fn(|start| {
        let mut states = states.clone();
        for (state, mass) in states.iter_mut().zip(&masses) {
            state.position = (state.position - position) * (1.0 + 1e-9 * start as f64);
            state.linear_momentum -= *mass * velocity;
        }
        let controls = vec![Load::default(); states.len()];
        let mut simulation = case.simulation_from(states, taylor(1e-17), time);
        let before = simulation.invariants().energy;
        simulation.advance(&controls).expect("a step");
        simulation.invariants().energy / before - 1.0
    })
}

fn root_mean_square(errors: &[f64]) -> f64 {
    let squares = errors.iter().map(|error| error * error);
    (squares.sum::<f64>() / errors.len() as f64).sqrt()
}

/// Rounding has no bias: over 2000 orbits of Jupiter, energy walks at random about its value. With sums and products of
/// reciprocals that are rounded once, its mean is 2.5e-14.
#[test]
fn rounding_of_the_planets_is_a_random_walk() {
    let errors = rounding("f_outer_planets", 2000.0 * 4332.589);
    let (mean, size) = (errors.iter().sum::<f64>() / 12.0, root_mean_square(&errors));
    println!("mean {mean:.1e}, root mean square {size:.1e}");
    assert!(mean.abs() < 1.2e-14 && size < 3e-14, "{mean:e}, {size:e}");
}

/// Sums are compensated: over 300 orbits of a binary asteroid, energy keeps its last digit but one.
#[test]
fn rounding_of_a_binary_asteroid_is_compensated() {
    let size = root_mean_square(&rounding("e_kw4_like", 300.0 * 62_640.0));
    println!("root mean square {size:.1e}");
    assert!(size < 1e-15, "{size:e}");
}

#[test]
fn a_motion_returns_along_its_path() {
    let case = Case::load("a1_two_dumbbells_regular");
    let none = [Load::default(); 2];
    let mut there = case.simulation(taylor(1e-14), 10.0);
    there.advance(&none).expect("a step");
    let states = there.states().to_vec();
    let mut back = case.simulation_from(states, taylor(1e-14), -10.0);
    back.advance(&none).expect("a step");
    let (_, start) = case.system();
    let error = distance(back.states(), &start);
    assert!(error < 1e-11, "{error:e}");
}

fn refusal(bodies: Vec<RigidBody>, gravity: Box<dyn Gravity>) -> MethodError {
    let states = bodies.iter().enumerate().map(|(index, body)| {
        let position = Vector3::new(10.0 * index as f64, 0.0, 0.0);
        let zero = Vector3::zeros();
        BodyState::from_velocities(body, position, zero, Matrix3::identity(), zero)
    });
    let states = states.collect();
    let system = System::new(bodies, vec![gravity]);
    let made = Simulation::new(system, states, taylor(1e-9), 0.1);
    made.err().expect("a refusal")
}

#[test]
fn unsupported_gravity_is_refused() {
    let inertia = Inertia::principal([1.0; 3]).expect("an inertia");
    let point = || RigidBody::new(1.0, inertia.clone(), vec![]).expect("a body");
    let fourth = Multipole::of_moments(1.0, &Moments::of_ellipsoid(1.0, [0.3, 0.2, 0.1]));
    let fourth = RigidBody::with_multipole(inertia.clone(), fourth).expect("a body");
    let cuboid = Polyhedron::cuboid([0.3, 0.2, 0.1], 1.0).expect("a polyhedron");
    let solid = RigidBody::with_polyhedron(None, &cuboid, 4).expect("a body");
    for body in [fourth, solid] {
        let error = refusal(vec![point(), body], Box::new(Mutual::new(1.0)));
        assert!(
            matches!(error, MethodError::Body { body: 1, .. }),
            "{error}"
        );
    }
    let pair = [1.0, -1.0].map(|x| PointMass {
        mass: 0.5,
        position: Vector3::new(x, 0.0, 0.0),
    });
    let dumbbell = RigidBody::new(1.0, inertia.clone(), pair.to_vec()).expect("a body");
    let multipole =
        RigidBody::with_multipole(inertia.clone(), Multipole::of_inertia(1.0, &inertia));
    let bodies = vec![multipole.expect("a body"), dumbbell];
    let error = refusal(bodies, Box::new(Mutual::new(1.0)));
    assert!(
        matches!(error, MethodError::Body { body: 1, .. }),
        "{error}"
    );
    let fourth = Multipole::of_moments(1.0, &Moments::of_ellipsoid(1.0, [0.3, 0.2, 0.1]));
    let error = refusal(vec![point()], Box::new(fourth));
    assert!(matches!(error, MethodError::Model { .. }), "{error}");
    let system = System::new(vec![point()], vec![]);
    for tolerance in [0.0, 1.0, f64::NAN] {
        let error = taylor(tolerance)
            .integrator(&system)
            .err()
            .expect("a refusal");
        assert!(matches!(error, MethodError::Parameter { .. }), "{error}");
    }
}

/// Coefficients of high order neither overflow nor underflow, whatever the unit of time.
#[test]
fn the_unit_of_time_does_not_matter() {
    let inertia = Inertia::principal([0.3, 0.4, 0.5]).expect("an inertia");
    let points = [0.1, -0.1].map(|y| PointMass {
        mass: 0.5,
        position: Vector3::new(0.0, y, 0.0),
    });
    let body = RigidBody::new(1.0, inertia, points.to_vec()).expect("a body");
    let fly = |power: i32, still: bool| {
        let rate = 2f64.powi(power);
        let moving = if still { 0.0 } else { rate };
        let state = BodyState::from_velocities(
            &body,
            Vector3::new(1.0, 0.1, 0.0),
            moving * Vector3::new(0.1, 0.9, 0.2),
            lgvi_lie::exp(&Vector3::new(0.1, 0.5, 0.2)),
            moving * Vector3::new(0.5, -0.3, 0.8),
        );
        let gravity: Vec<Box<dyn Gravity>> = vec![Box::new(Central { gm: rate * rate })];
        let system = System::new(vec![body.clone()], gravity);
        let h = 0.5 / rate;
        let made = Simulation::new(system, vec![state], taylor(1e-14), h);
        let mut simulation = made.expect("a method");
        simulation.advance(&[Load::default()]).expect("a step");
        simulation.states()[0]
    };
    for still in [false, true] {
        let known = fly(0, still);
        for power in [-90, -45, -20, 20, 45, 90] {
            let found = fly(power, still);
            let error = (found.position - known.position).norm();
            let turned = (found.attitude - known.attitude).norm();
            assert!(
                error < 1e-14 && turned < 1e-14,
                "{power}: {error:e}, {turned:e}"
            );
        }
    }
}

fn sphere(mass: f64) -> RigidBody {
    let inertia = Inertia::principal([0.4 * mass; 3]).expect("an inertia");
    RigidBody::new(mass, inertia, vec![]).expect("a body")
}

fn at(body: &RigidBody, position: Vector3<f64>) -> BodyState {
    let zero = Vector3::zeros();
    BodyState::from_velocities(body, position, zero, Matrix3::identity(), zero)
}

/// A body at rest, moved by one that is driven far faster than gravity moves it.
#[test]
fn a_driven_body_sets_the_unit_of_time() {
    let rate = Vector3::new(0.0, 0.0, 1.1e-3);
    let drive = Drive::circle(Vector3::zeros(), rate, Vector3::zeros());
    let driven = sphere(4e5).with_mobility(Mobility::Driven(drive));
    let bodies = vec![driven, sphere(1.0)];
    let states = vec![
        at(&bodies[0], Vector3::new(7e6, 0.0, 0.0)),
        at(&bodies[1], Vector3::new(1e8, 0.0, 0.0)),
    ];
    let fly = |method| {
        let system = System::new(bodies.clone(), vec![Box::new(Mutual::new(6.67e-11))]);
        let made = Simulation::new(system, states.clone(), method, 1e4);
        let mut simulation = made.expect("a method");
        for _ in 0..5 {
            simulation.advance(&[Load::default(); 2]).expect("a step");
        }
        simulation.states()[1].linear_momentum
    };
    let reference = fly(Method::DormandPrince853 { tolerance: 1e-15 });
    for tolerance in [1e-9, 1e-12, 1e-15] {
        let error = (fly(taylor(tolerance)) - reference).norm();
        println!("{tolerance:e}: {error:e} of {:e}", reference.norm());
        // In multiples of the least momentum that counts.
        assert!(error < 1e-3 * tolerance, "{tolerance:e}: {error:e}");
    }
}

/// A pendulum in equilibrium under a planet that slowly leaves its place: nothing moves at first.
#[test]
fn an_equilibrium_that_ends_slowly_is_left() {
    let points = [1.0, -1.0].map(|x| PointMass {
        mass: 0.5,
        position: Vector3::new(x, 0.0, 0.0),
    });
    let inertia = Inertia::principal([0.1, 1.0, 1.0]).expect("an inertia");
    let body = RigidBody::pivoted(1.0, inertia, points.to_vec()).expect("a body");
    let rate = Vector3::new(0.0, 0.0, 1.2e-9);
    let drive = Drive::circle(Vector3::zeros(), rate, Vector3::zeros());
    let planet = sphere(1e24).with_mobility(Mobility::Driven(drive));
    let bodies = vec![body, planet];
    let states = vec![
        at(&bodies[0], Vector3::zeros()),
        at(&bodies[1], Vector3::new(1e8, 0.0, 0.0)),
    ];
    let fly = |method, steps: u32| {
        let system = System::new(bodies.clone(), vec![Box::new(Mutual::new(6.67e-11))]);
        let made = Simulation::new(system, states.clone(), method, 1e7 / f64::from(steps));
        let mut simulation = made.expect("a method");
        for _ in 0..steps {
            simulation.advance(&[Load::default(); 2]).expect("a step");
        }
        simulation.states()[0].angular_momentum
    };
    let reference = fly(Method::RungeKutta4, 10_000);
    assert!(reference.norm() > 0.0);
    for tolerance in [1e-12, 1e-15] {
        let error = (fly(taylor(tolerance), 1) - reference).norm() / reference.norm();
        println!("{tolerance:e}: {error:e}");
        assert!(error < 1e-6, "{tolerance:e}: {error:e}");
    }
}

#[test]
fn points_at_the_same_place_are_refused() {
    let bodies = vec![sphere(1.0), sphere(1.0)];
    let states = bodies.iter().map(|body| at(body, Vector3::x())).collect();
    let system = System::new(bodies, vec![Box::new(Mutual::new(1.0))]);
    let mut simulation = Simulation::new(system, states, taylor(1e-9), 0.1).expect("a method");
    let error = simulation
        .advance(&[Load::default(); 2])
        .expect_err("a collision");
    assert_eq!(error, StepError::NotFinite { body: 0 });
}

/// Before the flight, not when the bodies dock.
#[test]
fn dockings_under_gravity_are_refused() {
    let bodies = vec![sphere(1.0), sphere(1.0)];
    let states = [0.0, 5.0].map(|x| Vector3::new(x, 0.0, 0.0));
    let states: Vec<_> = bodies
        .iter()
        .zip(states)
        .map(|(body, x)| at(body, x))
        .collect();
    let gravity = || -> Vec<Box<dyn Gravity>> { vec![Box::new(Mutual::new(1.0))] };
    let port = |body| Port {
        body,
        position: Vector3::zeros(),
        axis: Vector3::x(),
    };
    let docking = Docking {
        ports: [port(0), port(1)],
        distance: 0.1,
        angle: 4.0,
        speed: f64::INFINITY,
        rate: f64::INFINITY,
    };
    let simulation = |system, states| Simulation::new(system, states, taylor(1e-9), 0.1);
    let start = simulation(System::new(bodies, gravity()), states).expect("a method");
    let refused = start.with_dockings(vec![docking], gravity, simulation);
    assert!(matches!(refused.err(), Some(MethodError::Model { .. })));
}

#[test]
fn too_many_pairs_of_points_are_refused() {
    let bodies = vec![sphere(1.0); 800];
    let error = refusal(bodies, Box::new(Mutual::new(1.0)));
    let MethodError::Parameter { value, .. } = error else {
        panic!("{error}");
    };
    assert!(value > 262_144.0, "{value}");
}
