//! Bodies that dock: what is kept when they join, how they fly on as one, and when they join.

use std::f64::consts::PI;

use crate::conformance::promises;
use fastrand::Rng;
use lgvi_dynamics::docking::{Docking, Port};
use lgvi_dynamics::gravity::{Central, Gravity, Multipole, Mutual, Polyhedron};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{
    BodyState, Inertia, Load, Method, MethodError, Mobility, PointMass, RigidBody, Simulation,
    StepError, System,
};
use lgvi_lie::exp;
use nalgebra::{Matrix3, Vector3};

fn random(rng: &mut Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| 2.0 * rng.f64() - 1.0)
}

/// A body of a random mass, inertia and orientation of its principal axes.
fn body(rng: &mut Rng) -> RigidBody {
    let mass = libm::exp2(8.0 * rng.f64() - 4.0);
    let second = random(rng).map(|c| mass * (0.05 + c * c));
    let axes = exp(&(3.0 * random(rng)));
    let j = Matrix3::from_diagonal_element(second.sum()) - Matrix3::from_diagonal(&second);
    let inertia = Inertia::new(axes * j * axes.transpose()).expect("an inertia");
    RigidBody::new(mass, inertia, vec![]).expect("a body")
}

fn state(rng: &mut Rng, body: &RigidBody) -> BodyState {
    let attitude = exp(&(3.0 * random(rng)));
    BodyState::from_velocities(body, random(rng), random(rng), attitude, random(rng))
}

/// A docking of two bodies under any condition.
fn always(one: usize, other: usize) -> Docking {
    let port = |body| Port {
        body,
        position: Vector3::zeros(),
        axis: Vector3::x(),
    };
    Docking {
        ports: [port(one), port(other)],
        distance: f64::INFINITY,
        angle: PI,
        speed: f64::INFINITY,
        rate: f64::INFINITY,
    }
}

type Models = fn() -> Vec<Box<dyn Gravity>>;

const NONE: Models = Vec::new;

fn docking(
    bodies: &[RigidBody],
    states: &[BodyState],
    gravity: Models,
    dockings: Vec<Docking>,
    method: Method,
    h: f64,
) -> Result<Simulation, MethodError> {
    let simulation = move |system, states| Simulation::new(system, states, method, h);
    simulation(System::new(bodies.to_vec(), gravity()), states.to_vec())?
        .with_dockings(dockings, gravity, simulation)
}

/// Totals of linear momentum, angular momentum about a point, and kinetic energy.
fn totals(
    bodies: &[RigidBody],
    states: &[BodyState],
    about: &Vector3<f64>,
) -> (Vector3<f64>, Vector3<f64>, f64) {
    let mut sums = (Vector3::zeros(), Vector3::zeros(), 0.0);
    for (body, state) in bodies.iter().zip(states) {
        let (p, l) = (state.linear_momentum, state.angular_momentum);
        sums.0 += p;
        sums.1 += (state.position - about).cross(&p) + state.attitude * l;
        sums.2 += 0.5 * p.dot(&state.velocity(body)) + 0.5 * l.dot(&state.angular_velocity(body));
    }
    sums
}

/// The pose of the second body in the frame of the first.
fn relative_pose(one: &BodyState, other: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
    let r = one.attitude.transpose();
    (r * (other.position - one.position), r * other.attitude)
}

/// Distance between two relative poses.
fn between(one: (Vector3<f64>, Matrix3<f64>), other: (Vector3<f64>, Matrix3<f64>)) -> f64 {
    (one.0 - other.0).norm() + (one.1 - other.1).norm()
}

fn methods() -> impl Iterator<Item = Method> {
    let error_control = [
        Method::Fehlberg78 { tolerance: 1e-12 },
        Method::DormandPrince853 { tolerance: 1e-12 },
        Method::Taylor { tolerance: 1e-12 },
    ];
    promises()
        .into_iter()
        .filter(|promise| !promise.central)
        .map(|promise| promise.method)
        .chain(error_control)
}

/// The step is so short that no method errs in it.
#[test]
fn joining_keeps_the_momenta_and_the_relative_pose_and_states_the_energy_that_is_lost() {
    for method in methods().chain([Method::ClosedForm]) {
        for seed in 0..40 {
            let mut rng = Rng::with_seed(seed);
            let bodies: Vec<_> = (0..3).map(|_| body(&mut rng)).collect();
            let states: Vec<_> = bodies.iter().map(|body| state(&mut rng, body)).collect();
            let about = 10.0 * random(&mut rng);
            let (linear, angular, kinetic) = totals(&bodies, &states, &about);
            let pose = relative_pose(&states[0], &states[2]);

            let docks = vec![always(2, 0)];
            let mut flight =
                docking(&bodies, &states, NONE, docks, method, 1e-6).expect("a flight");
            flight.advance(&[Load::default(); 3]).expect("a step");
            let after = totals(&bodies, flight.states(), &about);
            let size = bodies.iter().zip(&states).map(|(body, state)| {
                (state.position - about).norm() * state.linear_momentum.norm()
                    + state.angular_momentum.norm()
                    + body.mass()
            });
            let rounding = 4e-15 * size.sum::<f64>();
            let case = format!("{method}, seed {seed}");
            assert!((after.0 - linear).norm() < rounding, "{case}");
            assert!((after.1 - angular).norm() < rounding, "{case}");
            let docked = flight.docked();
            assert_eq!(docked.len(), 1, "{case}");
            assert_eq!((docked[0].docking, docked[0].step), (0, 0), "{case}");
            assert!(docked[0].energy_loss > 1e-3 * kinetic, "{case}");
            let lost = kinetic - after.2;
            assert!(
                (docked[0].energy_loss - lost).abs() < 1e-13 * kinetic,
                "{case}"
            );
            let flown = relative_pose(&flight.states()[0], &flight.states()[2]);
            assert!(between(flown, pose) < 1e-14, "{case}");
            // The first body is as it was, but for the step.
            assert!(
                (flight.states()[1].position - states[1].position).norm() < 1e-5,
                "{case}"
            );
        }
    }
}

/// Two dumbbells and a third one, all of which attract each other, about a center.
fn dumbbells(seed: u64) -> (Vec<RigidBody>, Vec<BodyState>) {
    let mut rng = Rng::with_seed(seed);
    let mut make = |x: f64| {
        let body = body(&mut rng);
        let arm = 0.2 * random(&mut rng);
        let points = [1.0, -1.0].map(|sign| PointMass {
            mass: 0.5 * body.mass(),
            position: sign * arm,
        });
        let body = RigidBody::new(body.mass(), body.inertia().clone(), points.into());
        let body = body.expect("a dumbbell");
        let at = Vector3::new(x, 0.3 * rng.f64(), 4.0);
        let (velocity, spin) = (0.3 * random(&mut rng), random(&mut rng));
        let attitude = exp(&(3.0 * random(&mut rng)));
        let state = BodyState::from_velocities(&body, at, velocity, attitude, spin);
        (body, state)
    };
    [0.0, 1.0, 6.0].map(&mut make).into_iter().unzip()
}

fn attraction() -> Vec<Box<dyn Gravity>> {
    vec![Box::new(Central { gm: 3.0 }), Box::new(Mutual::new(0.05))]
}

/// Two bodies of points as one, set up about axes parallel to the inertial ones at the start.
fn by_hand(bodies: &[RigidBody], states: &[BodyState]) -> (RigidBody, BodyState) {
    let each = || bodies.iter().zip(states);
    let mass = each().map(|(body, _)| body.mass()).sum::<f64>();
    let center = each().map(|(body, state)| body.mass() * state.position);
    let center = center.sum::<Vector3<f64>>() / mass;
    let (mut inertia, mut points) = (Matrix3::zeros(), Vec::new());
    for (body, state) in each() {
        let (r, d) = (state.attitude, state.position - center);
        inertia += r * body.inertia().matrix() * r.transpose();
        inertia +=
            body.mass() * (Matrix3::from_diagonal_element(d.norm_squared()) - d * d.transpose());
        points.extend(body.points().iter().map(|point| PointMass {
            mass: point.mass,
            position: d + r * point.position,
        }));
    }
    let (linear_momentum, angular_momentum, _) = totals(bodies, states, &center);
    // What the symmetric inertia of a moving frame rounds to.
    let inertia = Inertia::new(0.5 * (inertia + inertia.transpose())).expect("an inertia");
    let body = RigidBody::new(mass, inertia, points).expect("a body");
    let state = BodyState {
        position: center,
        linear_momentum,
        attitude: Matrix3::identity(),
        angular_momentum,
    };
    (body, state)
}

/// A control on the second dumbbell, as the wrench on the joined body about its center of mass.
fn wrench(load: &Load, at: &BodyState, whole: &BodyState) -> Load {
    let moment = at.attitude * load.moment + (at.position - whole.position).cross(&load.force);
    Load {
        force: load.force,
        moment: whole.attitude.tr_mul(&moment),
    }
}

#[test]
fn joined_bodies_fly_as_one_that_was_set_up_by_itself() {
    const STEPS: usize = 60;
    let mut flown = 0;
    for promise in promises()
        .iter()
        .filter(|promise| !(promise.free || promise.central))
    {
        let method = promise.method;
        for seed in 0..4 {
            let (bodies, states) = dumbbells(seed);
            let docks = vec![always(0, 1)];
            let mut joined =
                docking(&bodies, &states, attraction, docks, method, 0.02).expect("a flight");
            let (body, state) = by_hand(&bodies[..2], &states[..2]);
            let system = System::new(vec![body, bodies[2].clone()], attraction());
            let alone = Simulation::new(system, vec![state, states[2]], method, 0.02);
            let mut alone = alone.expect("a flight");
            let mut rng = Rng::with_seed(seed);
            let pose = relative_pose(&states[0], &states[1]);
            let seats = [0, 1].map(|part| relative_pose(&state, &states[part]));
            for step in 0..STEPS {
                let control = Load {
                    force: 0.3 * random(&mut rng),
                    moment: 0.1 * random(&mut rng),
                };
                let at = match step {
                    0 => states[1],
                    _ => joined.states()[1],
                };
                let on_whole = wrench(&control, &at, &alone.states()[0]);
                let mut controls = [Load::default(); 3];
                controls[1] = control;
                joined.advance(&controls).expect("a step");
                alone.advance(&[on_whole, Load::default()]).expect("a step");
            }
            let case = format!("{method}, seed {seed}");
            let (parts, whole) = (joined.states(), &alone.states()[0]);
            let mut off: f64 = between(relative_pose(&parts[0], &parts[1]), pose);
            for (part, (position, attitude)) in parts.iter().zip(&seats) {
                let expected = whole.position + whole.attitude * position;
                off = off.max((part.position - expected).norm());
                off = off.max((part.attitude - whole.attitude * attitude).norm());
            }
            let (linear, angular, _) = totals(&bodies[..2], &parts[..2], &whole.position);
            off = off.max((linear - whole.linear_momentum).norm());
            off = off.max((angular - whole.attitude * whole.angular_momentum).norm());
            off = off.max((parts[2].position - alone.states()[1].position).norm());
            println!("{case}: {off:.1e}");
            // Other methods evaluate gravity at matrices that are not quite rotations.
            let bound = if promise.geometric { 1e-11 } else { 1e-4 };
            assert!(off < bound, "{case}: {off:e}");
            flown += 1;
        }
    }
    assert!(flown > 80);
}

/// A multipole and a polyhedron joined, with a third body: the loads on them are those of a potential, and are balanced.
#[test]
fn joined_bodies_of_any_shape_keep_their_invariants() {
    fn mutual() -> Vec<Box<dyn Gravity>> {
        vec![Box::new(Mutual::new(1.0))]
    }
    let rock = Polyhedron::ellipsoid([0.5, 0.35, 0.3], 1, 2.0).expect("a rock");
    let rock = RigidBody::with_polyhedron(None, &rock, 4).expect("a rock");
    let inertia = Inertia::principal([0.02, 0.03, 0.04]).expect("an inertia");
    let multipole = Multipole::of_inertia(0.3, &inertia);
    let plate = RigidBody::with_multipole(inertia, multipole).expect("a multipole");
    let (third, _) = dumbbells(7);
    let bodies = [rock.clone(), plate, third[2].clone(), rock];
    let mut rng = Rng::with_seed(5);
    let places = [
        [0.0, 0.0, 0.0],
        [0.9, 0.2, 0.0],
        [3.0, 0.0, 0.5],
        [-2.5, 1.0, 0.0],
    ];
    let states: Vec<_> = bodies
        .iter()
        .zip(places)
        .map(|(body, place)| BodyState {
            position: place.into(),
            ..state(&mut rng, body)
        })
        .collect();
    let docks = vec![always(0, 1), always(3, 2)];
    let method = Method::Nystrom { order: 8 };
    let mut flight = docking(&bodies, &states, mutual, docks, method, 0.01).expect("a flight");
    let start = flight.invariants();
    let fly = |flight: &mut Simulation, steps| {
        for _ in 0..steps {
            flight.advance(&[Load::default(); 4]).expect("a step");
        }
    };
    fly(&mut flight, 1);
    let lost: f64 = flight
        .docked()
        .iter()
        .map(|docked| docked.energy_loss)
        .sum();
    assert_eq!(flight.docked().len(), 2);
    let joined = flight.invariants();
    let scale = start.energy.abs() + lost;
    assert!((joined.energy + lost - start.energy).abs() < 1e-9 * scale);
    let poses = |flight: &Simulation| {
        let at = flight.states();
        [relative_pose(&at[0], &at[1]), relative_pose(&at[2], &at[3])]
    };
    let before = poses(&flight);
    fly(&mut flight, 300);
    let end = flight.invariants();
    assert!(
        (end.energy - joined.energy).abs() < 1e-8 * scale,
        "{:e}",
        end.energy - joined.energy
    );
    for (found, expected) in [
        (end.linear_momentum, start.linear_momentum),
        (end.angular_momentum, start.angular_momentum),
    ] {
        assert!(
            (found - expected).norm() < 1e-11,
            "{:e}",
            (found - expected).norm()
        );
    }
    for (found, expected) in poses(&flight).into_iter().zip(before) {
        assert!(between(found, expected) < 1e-12);
    }
    assert!((flight.states()[0].position - states[0].position).norm() > 0.1);
}

/// Two balls whose ports meet in the origin, and by how much they are off.
fn meeting(gap: f64, tilt: f64, speed: f64, rate: f64) -> Simulation {
    let inertia = Inertia::principal([1.0; 3]).expect("an inertia");
    let ball = RigidBody::new(1.0, inertia, vec![]).expect("a ball");
    let port = |body, x| Port {
        body,
        position: Vector3::new(x, 0.0, 0.0),
        axis: Vector3::new(x, 0.0, 0.0),
    };
    let limits = Docking {
        ports: [port(0, 1.0), port(1, -1.0)],
        distance: 0.1,
        angle: 0.2,
        speed: 0.3,
        rate: 0.4,
    };
    let still = BodyState::from_velocities(
        &ball,
        Vector3::new(-1.0, 0.0, 0.0),
        Vector3::zeros(),
        Matrix3::identity(),
        Vector3::zeros(),
    );
    let turned = exp(&Vector3::new(0.0, tilt, 0.0));
    // The velocity of the port does not change with the angular velocity.
    let spin = Vector3::new(0.0, 0.0, rate);
    let arm = Vector3::new(-1.0, 0.0, 0.0);
    let velocity = Vector3::new(0.0, speed, 0.0) - turned * spin.cross(&arm);
    let position = Vector3::new(0.0, 0.0, gap) - turned * arm;
    let other = BodyState::from_velocities(&ball, position, velocity, turned, spin);
    let bodies = [ball.clone(), ball];
    let method = Method::Lgvi(Rotor::Discrete);
    docking(&bodies, &[still, other], NONE, vec![limits], method, 1e-9).expect("a flight")
}

#[test]
fn bodies_dock_within_each_limit_and_not_beyond() {
    let docks = |factors: [f64; 4]| {
        let [gap, tilt, speed, rate] = factors;
        let mut flight = meeting(0.1 * gap, 0.2 * tilt, 0.3 * speed, 0.4 * rate);
        flight.advance(&[Load::default(); 2]).expect("a step");
        !flight.docked().is_empty()
    };
    let (inside, outside) = (1.0 - 1e-12, 1.0 + 1e-12);
    assert!(docks([inside; 4]));
    for limit in 0..4 {
        let mut factors = [inside; 4];
        factors[limit] = outside;
        assert!(!docks(factors), "limit {limit}");
        factors = [0.0; 4];
        factors[limit] = outside;
        assert!(!docks(factors), "limit {limit}");
    }
    // Axes that look the same way do not meet.
    let mut turned = meeting(0.0, PI, 0.0, 0.0);
    turned.advance(&[Load::default(); 2]).expect("a step");
    assert_eq!(turned.docked(), []);
}

/// Bodies in a row, each slower than the one behind: they join one after the other, until all are one.
#[test]
fn a_joined_body_docks_again() {
    let inertia = Inertia::principal([1.0, 1.5, 2.0]).expect("an inertia");
    let ball = RigidBody::new(1.0, inertia, vec![]).expect("a ball");
    let bodies = vec![ball; 4];
    let states: Vec<_> = (0..4)
        .map(|index| {
            let x = f64::from(index);
            let place = Vector3::new(3.0 * x, 0.01 * x, 0.0);
            let velocity = Vector3::new(-x * x, 0.0, 0.0);
            let spin = Vector3::new(0.3 * x, 0.02, 0.0);
            BodyState::from_velocities(&bodies[0], place, velocity, Matrix3::identity(), spin)
        })
        .collect();
    let docks = (0..3).map(|index| Docking {
        distance: 2.0,
        ..always(index + 1, index)
    });
    let docks: Vec<_> = docks.collect();
    let method = Method::Lgvi(Rotor::Exact);
    let mut flight = docking(&bodies, &states, NONE, docks, method, 0.01).expect("a flight");
    let about = Vector3::new(1.0, 2.0, 3.0);
    let before = totals(&bodies, &states, &about);
    for _ in 0..400 {
        flight.advance(&[Load::default(); 4]).expect("a step");
    }
    let docked = flight.docked();
    assert_eq!(docked.len(), 3);
    assert!(
        docked.windows(2).all(|pair| pair[0].step <= pair[1].step),
        "{docked:?}"
    );
    assert!(docked[0].step < docked[2].step, "{docked:?}");
    let after = totals(&bodies, flight.states(), &about);
    assert!((after.0 - before.0).norm() < 1e-13);
    assert!((after.1 - before.1).norm() < 1e-12);
    let lost: f64 = docked.iter().map(|docked| docked.energy_loss).sum();
    assert!((before.2 - after.2 - lost).abs() < 1e-12, "{lost}");
    let rates = bodies.iter().zip(flight.states());
    let rates = rates.map(|(body, state)| state.attitude * state.angular_velocity(body));
    let rates: Vec<_> = rates.collect();
    assert!(rates.iter().all(|rate| (rate - rates[0]).norm() < 1e-13));
}

#[test]
fn bodies_whose_states_are_set_separate() {
    let mut flight = meeting(0.0, 0.0, 0.1, 0.0);
    flight.advance(&[Load::default(); 2]).expect("a step");
    assert_eq!(flight.docked().len(), 1);
    let mut states = flight.states().to_vec();
    states[1].position.x += 10.0;
    states[1].linear_momentum.y += 1.0;
    flight.set_states(&states).expect("states");
    flight.advance(&[Load::default(); 2]).expect("a step");
    assert_eq!(flight.docked().len(), 1);
    assert_eq!(
        flight.states()[1].linear_momentum,
        states[1].linear_momentum
    );
    // As they met before, they dock again.
    let start = meeting(0.0, 0.0, 0.1, 0.0);
    flight.set_states(start.states()).expect("states");
    flight.advance(&[Load::default(); 2]).expect("a step");
    assert_eq!(flight.docked().len(), 2);
    assert_eq!(flight.docked()[1].step, 2);
}

/// Joined bodies may be closer to each other than their radii allow; a third body may not be so to either.
#[test]
fn clearances_hold_between_joined_bodies_and_others() {
    fn mutual() -> Vec<Box<dyn Gravity>> {
        vec![Box::new(Mutual::new(1e-6))]
    }
    let inertia = Inertia::principal([1.0; 3]).expect("an inertia");
    let ball = RigidBody::new(1.0, inertia, vec![]).and_then(|ball| ball.with_radius(1.0));
    let bodies = vec![ball.expect("a ball"); 3];
    let at = |place: [f64; 3], velocity: [f64; 3]| {
        let (attitude, spin) = (Matrix3::identity(), Vector3::zeros());
        BodyState::from_velocities(&bodies[0], place.into(), velocity.into(), attitude, spin)
    };
    let coming = |place: [f64; 3], velocity: [f64; 3]| {
        [
            at(place, velocity),
            at([-0.6, 0.0, 0.0], [0.0; 3]),
            at([0.6, 0.0, 0.0], [0.0; 3]),
        ]
    };
    let aside = coming([0.0, 9.0, 0.0], [0.0, -1.0, 0.0]);
    let method = Method::Lgvi(Rotor::Discrete);
    let fly = |states: &[BodyState], docks: Vec<Docking>| {
        let mut flight = docking(&bodies, states, mutual, docks, method, 0.1).expect("a flight");
        for step in 0..100 {
            let before = flight.states().to_vec();
            if let Err(error) = flight.advance(&[Load::default(); 3]) {
                assert_eq!(flight.states(), before);
                return (step, error);
            }
        }
        panic!("the bodies do not meet");
    };
    let (step, _) = fly(&aside, vec![]);
    assert_eq!(step, 0);
    let (step, error) = fly(&aside, vec![always(1, 2)]);
    // The distance from the two balls is 2 where y² + 0.6² = 4.
    assert!((70..75).contains(&step), "{step}");
    let StepError::CloseApproach(approach) = error else {
        panic!("{error}");
    };
    assert_eq!((approach.body, approach.other), (0, Some(1)));

    // The second part is nearer, and named.
    let ahead = coming([9.0, 0.0, 0.0], [-1.0, 0.0, 0.0]);
    let (_, error) = fly(&ahead, vec![always(1, 2)]);
    let StepError::CloseApproach(approach) = error else {
        panic!("{error}");
    };
    assert_eq!((approach.body, approach.other), (0, Some(2)));
}

#[test]
fn ports_of_bodies_that_cannot_dock_are_refused() {
    let (mut bodies, states) = dumbbells(1);
    bodies[2] = bodies[2].clone().with_mobility(Mobility::Fixed);
    for (ports, body) in [([0, 0], 0), ([1, 2], 2), ([2, 0], 2), ([0, 3], 3)] {
        let docks = vec![always(0, 1), always(ports[0], ports[1])];
        let method = Method::Lgvi(Rotor::Discrete);
        let refused = docking(&bodies, &states, attraction, docks, method, 0.1);
        let expected = MethodError::Docking { docking: 1, body };
        assert_eq!(refused.err(), Some(expected), "{ports:?}");
    }
}

/// Two specks so far apart that the inertia about the line between them is lost in rounding.
#[test]
fn bodies_that_form_no_rigid_body_fail_to_dock_and_stay_as_they_are() {
    let inertia = Inertia::principal([1e-18; 3]).expect("an inertia");
    let speck = RigidBody::new(1.0, inertia, vec![]).expect("a speck");
    let at = |x: f64| {
        let still = Vector3::zeros();
        BodyState::from_velocities(&speck, Vector3::x() * x, still, Matrix3::identity(), still)
    };
    let (bodies, states) = ([speck.clone(), speck.clone()], [at(0.0), at(1.0)]);
    let method = Method::Lgvi(Rotor::Discrete);
    let docks = vec![always(0, 1)];
    let mut flight = docking(&bodies, &states, NONE, docks, method, 0.1).expect("a flight");
    let expected = StepError::Docking { body: 0, other: 1 };
    assert_eq!(flight.advance(&[Load::default(); 2]), Err(expected));
    assert_eq!((flight.states(), flight.step()), (&states[..], 0));
    assert_eq!(flight.docked(), []);
}
