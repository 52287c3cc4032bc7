//! Bodies that are homogeneous polyhedra: mutual attraction of every pair, fixed polyhedra, and simulations.

use lgvi_dynamics::gravity::{
    Central, CloseApproach, Field, Fixed, Gravity, Moments, Multipole, Mutual, Polyhedron, Sources,
};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{
    BodyState, Inertia, Load, Method, Mobility, PointMass, RigidBody, Simulation, StepError, System,
};
use nalgebra::{Matrix3, Vector3};
use num_dual::Dual64;

use crate::potentials::{Number, Triple, add, constant, dot, rotated, subtract, turned, vector};

const G: f64 = 1.3;
const AXES: [[f64; 3]; 2] = [[1.0, 0.7, 0.4], [0.6, 0.5, 0.3]];
const LGVI: Method = Method::Lgvi(Rotor::Discrete);

/// An irregular body of 20 faces and approximately this size.
fn rock(rng: &mut fastrand::Rng, size: f64) -> Polyhedron {
    let smooth = Polyhedron::ellipsoid([1.0, 0.8, 0.6].map(|a| size * a), 0, 1.0).expect("a shape");
    let vertices = smooth.vertices().iter();
    let vertices = vertices.map(|v| v + vector(rng, 0.15 * size)).collect();
    let rough = Polyhedron::new(vertices, smooth.faces().to_vec(), 1.0).expect("a shape");
    rough.recentered()
}

fn solid(polyhedron: &Polyhedron, degree: usize) -> RigidBody {
    RigidBody::with_polyhedron(None, polyhedron, degree).expect("a body")
}

/// The body that represents a polyhedron by its multipole.
fn series(polyhedron: &Polyhedron, order: u32) -> RigidBody {
    let inertia = polyhedron.inertia().expect("inertia");
    let multipole = if order == 2 {
        Multipole::of_inertia(polyhedron.mass(), &inertia)
    } else {
        Multipole::of_moments(polyhedron.mass(), &polyhedron.moments())
    };
    RigidBody::with_multipole(inertia, multipole).expect("a body")
}

fn dumbbell(mass: f64, arm: f64) -> RigidBody {
    let points = [arm, -arm].map(|x| PointMass {
        mass: 0.5 * mass,
        position: Vector3::new(x, 0.0, 0.0),
    });
    let second = Moments::of_points(&points).second + Matrix3::from_diagonal_element(0.01 * mass);
    let inertia = Matrix3::from_diagonal_element(second.trace()) - second;
    let inertia = Inertia::new(inertia).expect("inertia");
    RigidBody::new(mass, inertia, points.to_vec()).expect("a body")
}

fn posed(position: Vector3<f64>, attitude: Matrix3<f64>) -> BodyState {
    BodyState {
        position,
        linear_momentum: Vector3::zeros(),
        attitude,
        angular_momentum: Vector3::zeros(),
    }
}

fn poses(rng: &mut fastrand::Rng, distance: f64) -> [BodyState; 2] {
    let apart = vector(rng, 1.0).normalize() * distance;
    [Vector3::zeros(), apart]
        .map(|offset| posed(offset + vector(rng, 0.1), lgvi_lie::exp(&vector(rng, 1.8))))
}

fn loads(bodies: &[RigidBody; 2], states: &[BodyState; 2]) -> [Load; 2] {
    let mut loads = [Load::default(); 2];
    Mutual::new(G).add_loads(bodies, states, &mut loads);
    loads
}

/// Every pair with a polyhedron in it, in both orders.
fn pairs(rng: &mut fastrand::Rng) -> Vec<[RigidBody; 2]> {
    let solid_of = |rng: &mut fastrand::Rng, size| solid(&rock(rng, size), 4);
    let others = [
        dumbbell(1.0, 0.4),
        series(&rock(rng, 0.6), 2),
        series(&rock(rng, 0.6), 4),
        solid_of(rng, 0.5),
        solid_of(rng, 1.2),
    ];
    let mut all = Vec::new();
    for other in others {
        all.push([solid_of(rng, 0.9), other.clone()]);
        all.push([other, solid_of(rng, 0.9)]);
    }
    all
}

/// The bound is a few rounding errors of the largest terms, as for points and multipoles, and somewhat more for the
/// sums of the polyhedra.
#[test]
fn total_force_and_moment_vanish_to_rounding() {
    let mut rng = fastrand::Rng::with_seed(5);
    let mut worst = 0.0_f64;
    for _ in 0..20 {
        for bodies in pairs(&mut rng) {
            let states = poses(&mut rng, 3.5);
            let [first, second] = loads(&bodies, &states);
            assert_eq!(first.force, -second.force);
            assert!(first.force.norm() > 0.0);
            let [at, there] = &states;
            let total = at.position.cross(&first.force)
                + there.position.cross(&second.force)
                + at.attitude * first.moment
                + there.attitude * second.moment;
            let scale = first.force.norm() * (at.position - there.position).norm();
            worst = worst.max(total.norm() / scale);
        }
    }
    println!("total moment {worst:.1e} of force times distance");
    assert!(worst < 5e-15, "total moment {worst:e}");
}

/// Compares the loads with central differences of the potential in the position and attitude of each body.
#[test]
fn loads_are_minus_the_derivatives_of_the_potential() {
    let mut rng = fastrand::Rng::with_seed(6);
    for bodies in pairs(&mut rng) {
        let states = poses(&mut rng, 3.0);
        let loads = loads(&bodies, &states);
        let e = 1e-4;
        for own in [0, 1] {
            for axis in 0..6 {
                let energy = |e: f64| {
                    let mut moved = states;
                    let along = Vector3::ith(axis % 3, e);
                    if axis < 3 {
                        moved[own].position += along;
                    } else {
                        moved[own].attitude *= lgvi_lie::exp(&along);
                    }
                    Mutual::new(G).potential(&bodies, &moved)
                };
                let once = (energy(e) - energy(-e)) / (2.0 * e);
                let twice = (energy(2.0 * e) - energy(-2.0 * e)) / (4.0 * e);
                let slope = (4.0 * once - twice) / 3.0;
                let found = if axis < 3 {
                    loads[own].force[axis]
                } else {
                    loads[own].moment[axis - 3]
                };
                assert!((found + slope).abs() < 1e-10, "{found} for {}", -slope);
            }
        }
    }
}

/// Gauss–Legendre nodes on [−1, 1] and weights, by Newton's method.
fn gauss_legendre(count: usize) -> Vec<(f64, f64)> {
    let node = |k: usize| {
        let mut x = libm::cos(std::f64::consts::PI * (k as f64 + 0.75) / (count as f64 + 0.5));
        let mut slope = 1.0;
        for _ in 0..20 {
            let (mut last, mut p) = (1.0, x);
            for n in 1..count {
                let n = n as f64;
                (last, p) = (p, ((2.0 * n + 1.0) * x * p - n * last) / (n + 1.0));
            }
            slope = count as f64 * (x * p - last) / (x * x - 1.0);
            x -= p / slope;
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..count).map(node).collect()
}

/// A cuboid of density 1 as the points of a product quadrature.
fn cubature(semi_axes: [f64; 3], count: usize) -> Vec<PointMass> {
    let rule = gauss_legendre(count);
    let [a, b, c] = semi_axes;
    let mut points = Vec::new();
    for &(x, u) in &rule {
        for &(y, v) in &rule {
            for &(z, w) in &rule {
                points.push(PointMass {
                    mass: a * b * c * u * v * w,
                    position: Vector3::new(a * x, b * y, c * z),
                });
            }
        }
    }
    points
}

/// `−Gσσ ∬ 1/r` of two cuboids with the positions moved by δ and the attitudes rotated by ζ.
fn double_cubature<T: Number>(
    clouds: &[Vec<PointMass>; 2],
    states: &[BodyState; 2],
    delta: [Triple<T>; 2],
    zeta: [Triple<T>; 2],
) -> T {
    let [first, second] = [0, 1].map(|own| {
        let place = |point: &PointMass| {
            let rho = turned(zeta[own], constant(&point.position));
            let x = add(constant(&states[own].position), delta[own]);
            (point.mass, add(x, rotated(&states[own].attitude, rho)))
        };
        clouds[own].iter().map(place).collect::<Vec<_>>()
    });
    let mut sum = T::from(0.0);
    for (mass, place) in &first {
        let mut inner = T::from(0.0);
        for (other, there) in &second {
            let d = subtract(*place, *there);
            inner += dot(d, d).sqrt().recip() * *other;
        }
        sum += inner * *mass;
    }
    -sum * G
}

/// Largest relative errors of the forces, and of the moments relative to force times size, of two cuboids at `ratio`
/// times the sum of their radii. The reference is the derivative of a double cubature.
fn errors_of_cuboids(ratio: f64, degree: usize) -> [f64; 2] {
    let bodies = AXES.map(|axes| solid(&Polyhedron::cuboid(axes, 1.0).expect("a cuboid"), degree));
    let reach = |axes: [f64; 3]| Vector3::from(axes).norm();
    let direction = Vector3::new(0.5, -0.6, 0.4).normalize();
    let distance = ratio * (reach(AXES[0]) + reach(AXES[1]));
    let states = [
        posed(
            Vector3::zeros(),
            lgvi_lie::exp(&Vector3::new(0.3, -0.2, 0.8)),
        ),
        posed(
            distance * direction,
            lgvi_lie::exp(&Vector3::new(0.4, 1.1, -0.7)),
        ),
    ];
    let loads = loads(&bodies, &states);
    let clouds = AXES.map(|axes| cubature(axes, 7));
    let mut errors = [0.0_f64; 2];
    let force = loads[0].force.norm();
    for own in [0, 1] {
        for axis in 0..6 {
            let mut delta = [[Dual64::from(0.0); 3]; 2];
            let mut zeta = delta;
            let (part, component, scale) = if axis < 3 {
                (&mut delta, loads[own].force[axis], force)
            } else {
                let scale = force * reach(AXES[own]);
                (&mut zeta, loads[own].moment[axis - 3], scale)
            };
            part[own][axis % 3].eps = 1.0;
            let u = double_cubature(&clouds, &states, delta, zeta);
            let error = (component + u.eps).abs() / scale;
            errors[axis / 3] = errors[axis / 3].max(error);
        }
    }
    errors
}

/// Bounds are twice the measured values. The error of the reference is smaller.
#[test]
fn cuboids_attract_as_their_double_integral_tells() {
    for (ratio, degree, bounds) in [
        (1.2, 4, [9e-6, 3e-5]),
        (1.2, 8, [7e-8, 2.4e-7]),
        (2.0, 4, [1.4e-6, 3.2e-6]),
        (2.0, 8, [1e-9, 5e-9]),
    ] {
        let [force, moment] = errors_of_cuboids(ratio, degree);
        println!("at {ratio}, degree {degree}: force {force:.1e}, moment {moment:.1e}");
        assert!(force < bounds[0] && moment < bounds[1]);
    }
}

/// At large distance two polyhedra attract like their multipoles. The truncation error relative to the force decays
/// with the power order + 1 of the distance. Relative to the moment, which is itself smaller by two powers, it decays
/// with the power order − 1, unless only the other body is truncated.
#[test]
fn polyhedra_attract_as_their_multipoles_far_away() {
    let mut rng = fastrand::Rng::with_seed(7);
    let shapes = [rock(&mut rng, 1.0), rock(&mut rng, 0.6)];
    let direction = vector(&mut rng, 1.0).normalize();
    let attitudes = [0, 1].map(|_| lgvi_lie::exp(&vector(&mut rng, 1.8)));
    let difference = |distance: f64, order: u32| {
        let states = [0.0, distance].map(|d| d * direction);
        let states = [0, 1].map(|own| posed(states[own], attitudes[own]));
        let solids = shapes.each_ref().map(|shape| solid(shape, 8));
        let multipoles = shapes.each_ref().map(|shape| series(shape, order));
        let mixed = [solids[0].clone(), multipoles[1].clone()];
        let [exact, both, mixed] = [solids, multipoles, mixed].map(|pair| loads(&pair, &states));
        let relative = |found: [Load; 2]| {
            let force = (found[0].force - exact[0].force).norm() / exact[0].force.norm();
            let moment = (found[0].moment - exact[0].moment).norm() / exact[0].moment.norm();
            [force, moment]
        };
        [relative(both), relative(mixed)]
    };
    for (order, both, mixed) in [(2, [3.0, 1.0], [3.0, 3.0]), (4, [5.0, 3.0], [5.0, 5.0])] {
        let (near, far) = (difference(10.0, order), difference(20.0, order));
        for (of, expected) in [both, mixed].iter().enumerate() {
            let slopes = [0, 1].map(|part| libm::log2(near[of][part] / far[of][part]));
            println!("order {order}: {:?} at 10, slopes {slopes:.2?}", near[of]);
            for (slope, expected) in slopes.iter().zip(expected) {
                assert!((slope - expected).abs() < 0.3, "{slope} for {expected}");
            }
        }
    }
}

/// By Newton's third law, the load of a fixed source on a polyhedron's cloud equals the reaction to the polyhedron's
/// own field acting on the source.
#[test]
fn fixed_sources_act_on_the_cloud() {
    let mut rng = fastrand::Rng::with_seed(8);
    let body = solid(&rock(&mut rng, 1.0), 8);
    let [at, there] = poses(&mut rng, 3.0);
    let gm = 1.7;
    let source = Fixed::new(Central { gm }, at.position, Matrix3::identity());
    let found = source.load(&body, &there.position, &there.attitude);
    let inertia = Inertia::principal([1.0; 3]).expect("inertia");
    let sphere = RigidBody::new(gm / G, inertia, vec![]).expect("a sphere");
    let [_, expected] = loads(&[sphere, body], &[at, there]);
    let force = (found.force - expected.force).norm() / expected.force.norm();
    let moment = (found.moment - expected.moment).norm() / expected.force.norm();
    println!("force {force:.1e}, moment {moment:.1e} of force times size");
    assert!(force < 5e-7 && moment < 1e-6);
}

/// A fixed polyhedron acts as a field that equals the mutual attraction of points and smaller polyhedra. The same holds
/// for a multipole acting on polyhedra.
#[test]
fn a_held_polyhedron_is_a_field() {
    let mut rng = fastrand::Rng::with_seed(9);
    let great = rock(&mut rng, 1.2);
    let small = rock(&mut rng, 0.5);
    for (held, free) in [
        (solid(&great, 4), dumbbell(1.0, 0.4)),
        (solid(&great, 4), solid(&small, 4)),
        (series(&great, 4), solid(&small, 4)),
    ] {
        let [at, there] = poses(&mut rng, 3.0);
        let held = held.with_mobility(Mobility::Fixed);
        let field = Sources::of_bodies(G, std::slice::from_ref(&held), &[at]);
        let found = field.load(&free, &there.position, &there.attitude);
        let [_, expected] = loads(&[held, free], &[at, there]);
        assert!((found.force - expected.force).norm() < 1e-13);
        assert!((found.moment - expected.moment).norm() < 1e-13);
    }
}

/// An orbit at distance 3 from the center of a rock of radius 1. Returns the largest errors of the total momenta, the
/// linear one relative to that of the small body, and the largest energy errors of each half of the flight, relative to
/// the small body's kinetic energy.
fn flight(h: f64, steps: u32) -> ([f64; 2], [f64; 2]) {
    let rock = rock(&mut fastrand::Rng::with_seed(10), 1.0);
    let speed = (G * rock.mass() / 3.0).sqrt();
    let bodies = vec![solid(&rock, 4), dumbbell(1e-2, 0.1)];
    let states = vec![
        BodyState::from_velocities(
            &bodies[0],
            Vector3::zeros(),
            Vector3::new(0.0, 1e-2 * speed / rock.mass(), 0.0),
            Matrix3::identity(),
            Vector3::new(0.1, -0.2, 0.3),
        ),
        BodyState::from_velocities(
            &bodies[1],
            Vector3::new(3.0, 0.0, 0.0),
            Vector3::new(0.0, -speed, 0.0),
            Matrix3::identity(),
            Vector3::new(0.2, 0.1, 0.4),
        ),
    ];
    let kinetic = 0.5 * 1e-2 * speed * speed;
    let system = System::new(bodies, vec![Box::new(Mutual::new(G))]);
    let mut simulation = Simulation::new(system, states, LGVI, h).expect("a method");
    let start = simulation.invariants();
    let (mut momenta, mut energy) = ([0.0_f64; 2], [0.0_f64; 2]);
    for step in 0..steps {
        simulation.advance(&[Load::default(); 2]).expect("a step");
        let now = simulation.invariants();
        let linear = (now.linear_momentum - start.linear_momentum).norm() / (1e-2 * speed);
        let angular = (now.angular_momentum - start.angular_momentum).norm();
        momenta[0] = momenta[0].max(linear);
        momenta[1] = momenta[1].max(angular / start.angular_momentum.norm());
        let half = &mut energy[usize::from(2 * step >= steps)];
        *half = half.max((now.energy - start.energy).abs() / kinetic);
    }
    (momenta, energy)
}

#[test]
fn a_flight_about_a_rock_keeps_momenta_and_bounds_the_energy_error() {
    let ([linear, angular], [first, second]) = flight(0.04, 10_000);
    let (_, [finer, later]) = flight(0.02, 20_000);
    println!("momenta: linear {linear:.1e}, angular {angular:.1e}");
    println!("energy {first:.2e}, then {second:.2e}; at half the step {finer:.2e}, {later:.2e}");
    assert!(linear < 1e-15, "linear momentum {linear:e}");
    assert!(angular < 1e-13, "angular momentum {angular:e}");
    assert!(second < 1.1 * first && later < 1.1 * finer);
    let ratio = first.max(second) / finer.max(later);
    assert!((ratio - 4.0).abs() < 0.1, "ratio {ratio}");
}

/// A slender body: within its bounding sphere, points beside it are allowed, but points inside it are not.
#[test]
fn a_body_inside_a_polyhedron_is_a_close_approach() {
    let rod = Polyhedron::cuboid([1.0, 0.2, 0.2], 1.0).expect("a rod");
    let inertia = Inertia::principal([1e-3; 3]).expect("inertia");
    let sphere = RigidBody::new(1e-3, inertia, vec![]).expect("a sphere");
    let pebble = Polyhedron::cuboid([0.05; 3], 1.0).expect("a pebble");
    let intruders = [
        sphere,
        dumbbell(1e-3, 0.05),
        series(&pebble, 2),
        solid(&pebble, 4),
    ];
    let still = |x: [f64; 3]| posed(x.into(), Matrix3::identity());
    for intruder in intruders {
        for rod_first in [true, false] {
            let mut bodies = vec![
                solid(&rod, 4).with_mobility(Mobility::Fixed),
                intruder.clone(),
            ];
            let mut states = vec![still([0.0; 3]), still([0.1, 0.4, 0.0])];
            if !rod_first {
                bodies.reverse();
                states.reverse();
            }
            let system = System::new(bodies, vec![Box::new(Mutual::new(1.0))]);
            let mut simulation = Simulation::new(system, states, LGVI, 1e-3).expect("a method");
            let mut steps = 0;
            let error = loop {
                match simulation.advance(&[Load::default(); 2]) {
                    Ok(_) => steps += 1,
                    Err(error) => break error,
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
            assert_eq!((body, other), (0, Some(1)));
            assert!(steps > 100 && distance < limit);
            assert!((0.19..0.31).contains(&distance), "{distance}");
            assert!(limit >= 1.08_f64.sqrt());
        }
    }
}

/// The attraction of two clouds of points, on the first of them: force and moment about its origin, inertial frame.
fn between_points(clouds: &[Vec<PointMass>; 2], states: &[BodyState; 2]) -> [Vector3<f64>; 2] {
    let [first, second] = [0, 1].map(|own| {
        let state = &states[own];
        let place = |point: &PointMass| (point.mass, state.attitude * point.position);
        clouds[own].iter().map(place).collect::<Vec<_>>()
    });
    let separation = states[1].position - states[0].position;
    let mut sums = [Vector3::zeros(); 2];
    for (mass, arm) in &first {
        let mut pull = Vector3::zeros();
        for (other, there) in &second {
            let d = separation + there - arm;
            let squared = d.norm_squared();
            pull += other / (squared * squared.sqrt()) * d;
        }
        sums[0] += G * *mass * pull;
        sums[1] += arm.cross(&(G * *mass * pull));
    }
    sums
}

/// Random rocks of 20 faces and different sizes, at random attitudes, against quadratures of both volumes. Bounds are
/// twice the largest of the measured errors.
#[test]
fn rocks_attract_as_quadratures_of_both_tell() {
    let mut rng = fastrand::Rng::with_seed(11);
    for (ratio, bounds) in [
        (1.2, [1e-3, 4e-4]),
        (2.0, [7e-5, 1.4e-4]),
        (4.0, [2.2e-6, 1e-5]),
    ] {
        let mut worst = [0.0_f64; 2];
        for trial in 0..8 {
            let size = 0.2 + 0.8 * rng.f64();
            let mut shapes = [rock(&mut rng, 1.0), rock(&mut rng, size)];
            if trial % 2 == 1 {
                shapes.reverse();
            }
            let radii: f64 = shapes.iter().map(Polyhedron::bounding_radius).sum();
            let direction = vector(&mut rng, 1.0).normalize();
            let states = [0.0, ratio * radii]
                .map(|x| posed(x * direction, lgvi_lie::exp(&vector(&mut rng, 1.8))));
            let clouds = shapes
                .each_ref()
                .map(|shape| shape.cloud(8).expect("points"));
            let [force, moment] = between_points(&clouds, &states);
            let found = loads(&shapes.each_ref().map(|shape| solid(shape, 4)), &states)[0];
            let errors = [
                (found.force - force).norm() / force.norm(),
                (states[0].attitude * found.moment - moment).norm()
                    / (force.norm() * shapes[0].bounding_radius()),
            ];
            for (worst, error) in worst.iter_mut().zip(errors) {
                *worst = worst.max(error);
            }
        }
        let [force, moment] = worst;
        println!("at {ratio}: force {force:.1e}, moment {moment:.1e} of force times size");
        assert!(force < bounds[0] && moment < bounds[1]);
    }
}
