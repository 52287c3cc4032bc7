//! Mutual attraction for every pair of kinds of bodies.

use lgvi_dynamics::gravity::{Field, Gravity, Mutual, Sources};
use lgvi_dynamics::{BodyState, Inertia, Load, Mobility, PointMass, RigidBody};
use nalgebra::Vector3;
use num_dual::Dual64;

use crate::potentials::{
    Cloud, KINDS, Kind, Number, Triple, add, constant, legendre, quadrupole_pair, rotated,
    subtract, turned, vector,
};

const G: f64 = 1.3;

/// Two bodies and their states.
pub struct Pair {
    pub clouds: [Cloud; 2],
    pub states: [BodyState; 2],
}

fn pairs(rounds: usize) -> Vec<Pair> {
    let mut rng = fastrand::Rng::with_seed(31);
    let mut all = Vec::new();
    for _ in 0..rounds {
        for first in KINDS {
            for second in KINDS {
                let apart = Vector3::new(2.0, 0.0, 0.0);
                let clouds = [first, second].map(|kind| Cloud::random(kind, &mut rng, 0.4));
                let states = [Vector3::zeros(), apart].map(|offset| BodyState {
                    position: offset + vector(&mut rng, 0.5),
                    linear_momentum: Vector3::zeros(),
                    attitude: lgvi_lie::exp(&vector(&mut rng, 1.8)),
                    angular_momentum: Vector3::zeros(),
                });
                all.push(Pair { clouds, states });
            }
        }
    }
    all
}

impl Pair {
    fn kinds(&self) -> [Kind; 2] {
        [self.clouds[0].kind, self.clouds[1].kind]
    }

    pub fn loads(&self) -> [Load; 2] {
        let bodies = [self.clouds[0].body(), self.clouds[1].body()];
        let mut loads = [Load::default(); 2];
        Mutual::new(G).add_loads(&bodies, &self.states, &mut loads);
        loads
    }

    /// The potential with the positions moved by δ and the attitudes rotated by ζ, one of each per body.
    fn potential<T: Number>(&self, delta: [Triple<T>; 2], zeta: [Triple<T>; 2]) -> T {
        let place = |own: usize| {
            move |rho: Triple<T>| rotated(&self.states[own].attitude, turned(zeta[own], rho))
        };
        let x = [0, 1].map(|own| add(constant(&self.states[own].position), delta[own]));
        let e = subtract(x[1], x[0]);
        let back = subtract(x[0], x[1]);
        let [first, second] = &self.clouds;
        let mut sum = T::from(0.0);
        match self.kinds() {
            [Kind::Series(n), Kind::Series(m)] => {
                sum += legendre(0, e, e);
                sum += first.reach(e, 2, place(0)) + second.reach(back, 2, place(1));
                if n.max(m) == 4 {
                    for p in &first.points {
                        for q in &second.points {
                            let rho = place(0)(constant(&p.position));
                            let sigma = place(1)(constant(&q.position));
                            sum += quadrupole_pair(e, rho, sigma) * (p.mass * q.mass);
                        }
                    }
                }
            }
            [Kind::Sphere | Kind::Points, _] => {
                for point in &first.points {
                    let rho = place(0)(constant(&point.position));
                    sum += second.reach(add(back, rho), 0, place(1)) * point.mass;
                }
            }
            [Kind::Series(_), _] => {
                for point in &second.points {
                    let rho = place(1)(constant(&point.position));
                    sum += first.reach(add(e, rho), 0, place(0)) * point.mass;
                }
            }
        }
        -sum * G
    }
}

#[test]
fn loads_are_minus_the_derivatives_of_the_potential() {
    for pair in pairs(5) {
        let bodies = [pair.clouds[0].body(), pair.clouds[1].body()];
        let loads = pair.loads();
        let energy = Mutual::new(G).potential(&bodies, &pair.states);
        for own in [0, 1] {
            for axis in 0..6 {
                let mut delta = [[Dual64::from(0.0); 3]; 2];
                let mut zeta = delta;
                let (part, component) = if axis < 3 {
                    (&mut delta, loads[own].force[axis])
                } else {
                    (&mut zeta, loads[own].moment[axis - 3])
                };
                part[own][axis % 3].eps = 1.0;
                let u = pair.potential(delta, zeta);
                let kinds = pair.kinds();
                assert!(
                    (component + u.eps).abs() < 1e-12,
                    "{kinds:?}: {component} for {}",
                    -u.eps
                );
                assert!(
                    (energy - u.re).abs() < 1e-12,
                    "{kinds:?}: {energy} for {}",
                    u.re
                );
            }
        }
    }
}

/// The bound is a few rounding errors of the largest terms, force times distance.
#[test]
fn total_force_and_moment_vanish_to_rounding() {
    let mut worst = 0.0_f64;
    for pair in pairs(100) {
        let [first, second] = pair.loads();
        assert_eq!(first.force, -second.force);
        let [at, there] = &pair.states;
        let total = at.position.cross(&first.force)
            + there.position.cross(&second.force)
            + at.attitude * first.moment
            + there.attitude * second.moment;
        let scale = first.force.norm() * (at.position - there.position).norm();
        worst = worst.max(total.norm() / scale);
    }
    println!("total moment {worst:.1e} of force times distance");
    assert!(worst < 2e-15, "total moment {worst:e}");
}

/// Compares every combination of numbers of points, including odd ones, with the plain sum over all pairs.
#[test]
fn every_number_of_points_attracts_as_the_sum_of_its_pairs() {
    let mut rng = fastrand::Rng::with_seed(41);
    let inertia = Inertia::principal([1.0; 3]).expect("inertia");
    let mut random = |count: usize| {
        let positions: Vec<_> = (0..count).map(|_| vector(&mut rng, 0.4)).collect();
        let center = positions.iter().sum::<Vector3<f64>>() / count as f64;
        let mass = 1.0 / count as f64;
        let points = positions.iter().map(|position| PointMass {
            mass,
            position: position - center,
        });
        RigidBody::new(1.0, inertia.clone(), points.collect()).expect("body")
    };
    let apart = [Vector3::zeros(), Vector3::new(1.5, -0.7, 0.9)];
    let turns = [Vector3::new(0.3, -1.0, 0.5), Vector3::new(-0.8, 0.2, 1.1)];
    let states = [0, 1].map(|own| BodyState {
        position: apart[own],
        linear_momentum: Vector3::zeros(),
        attitude: lgvi_lie::exp(&turns[own]),
        angular_momentum: Vector3::zeros(),
    });
    for (n, m) in (0..25).map(|k| (k / 5 + 1, k % 5 + 1)) {
        let bodies = [random(n), random(m)];
        let mut loads = [Load::default(); 2];
        Mutual::new(G).add_loads(&bodies, &states, &mut loads);
        let mut expected = [Load::default(); 2];
        for p in bodies[0].points() {
            for q in bodies[1].points() {
                let [first, second] = [p, q].map(|point| point.position);
                let d = states[1].position + states[1].attitude * second
                    - states[0].position
                    - states[0].attitude * first;
                let pull = G * p.mass * q.mass / d.norm().powi(3) * d;
                let seen = [0, 1].map(|own| states[own].attitude.tr_mul(&pull));
                expected[0].force += pull;
                expected[1].force -= pull;
                expected[0].moment += first.cross(&seen[0]);
                expected[1].moment -= second.cross(&seen[1]);
            }
        }
        for (found, expected) in loads.iter().zip(&expected) {
            assert!((found.force - expected.force).norm() < 1e-15, "{n}, {m}");
            assert!((found.moment - expected.moment).norm() < 1e-15, "{n}, {m}");
        }
    }
}

/// The load on the second body with its pose changed by δ and ζ, while the first is fixed.
fn mutual_load(pair: &Pair, delta: Vector3<f64>, zeta: Vector3<f64>) -> Load {
    let [held, free] = [0, 1].map(|own| pair.clouds[own].body());
    let [at, there] = pair.states;
    let there = BodyState {
        position: there.position + delta,
        attitude: there.attitude * lgvi_lie::exp(&zeta),
        ..there
    };
    let mut loads = [Load::default(); 2];
    let bodies = [held.with_mobility(Mobility::Fixed), free];
    Mutual::new(G).add_loads(&bodies, &[at, there], &mut loads);
    loads[1]
}

/// A fixed body attracts another like a field whose derivatives are those of the mutual attraction with respect to the
/// other's pose. Only the quadrupole–quadrupole interaction is missing from the field.
#[test]
fn a_held_body_is_a_field() {
    for pair in pairs(2) {
        if matches!(pair.kinds(), [Kind::Series(n), Kind::Series(m)] if n.max(m) == 4) {
            continue;
        }
        let [held, free] = [0, 1].map(|own| pair.clouds[own].body());
        let [at, there] = pair.states;
        let field = Sources::of_bodies(G, &[held], &[at]);
        let zero = Vector3::zeros();
        let expected = mutual_load(&pair, zero, zero);
        let load = field.load(&free, &there.position, &there.attitude);
        assert!((load.force - expected.force).norm() < 1e-14);
        assert!((load.moment - expected.moment).norm() < 1e-14);

        let gradient = field.gradient(&free, &there.position, &there.attitude);
        let e = 1e-5;
        for axis in 0..3 {
            let along = Vector3::ith(axis, e);
            let slope = |ahead: Load, behind: Load| {
                [
                    (ahead.force - behind.force) / (2.0 * e),
                    (ahead.moment - behind.moment) / (2.0 * e),
                ]
            };
            let by_position = slope(
                mutual_load(&pair, along, zero),
                mutual_load(&pair, -along, zero),
            );
            let by_attitude = slope(
                mutual_load(&pair, zero, along),
                mutual_load(&pair, zero, -along),
            );
            for (found, expected) in [
                (gradient.force_by_position, by_position[0]),
                (gradient.moment_by_position, by_position[1]),
                (gradient.force_by_attitude, by_attitude[0]),
                (gradient.moment_by_attitude, by_attitude[1]),
            ] {
                let error = (found.column(axis) - expected).norm();
                assert!(error < 1e-8, "{:?}: {error:e}", pair.kinds());
            }
        }
    }
}

#[test]
fn held_bodies_leave_each_other_alone() {
    for pair in pairs(1) {
        let bodies = [0, 1].map(|own| pair.clouds[own].body().with_mobility(Mobility::Fixed));
        let mut loads = [Load::default(); 2];
        Mutual::new(G).add_loads(&bodies, &pair.states, &mut loads);
        assert_eq!(loads, [Load::default(); 2]);
        assert_eq!(Mutual::new(G).potential(&bodies, &pair.states), 0.0);
    }
}

/// The loads and the potential of three bodies of three kinds equal the sums over their pairs.
#[test]
fn three_bodies_attract_as_their_pairs() {
    let mut rng = fastrand::Rng::with_seed(12);
    let kinds = [Kind::Points, Kind::Series(2), Kind::Sphere];
    let bodies = kinds.map(|kind| Cloud::random(kind, &mut rng, 0.3).body());
    let states = [0.0, 2.0, 4.0].map(|x| BodyState {
        position: Vector3::new(x, 0.0, 0.0) + vector(&mut rng, 0.5),
        linear_momentum: Vector3::zeros(),
        attitude: lgvi_lie::exp(&vector(&mut rng, 1.8)),
        angular_momentum: Vector3::zeros(),
    });
    let mut gravity = Mutual::new(G);
    let mut loads = [Load::default(); 3];
    gravity.add_loads(&bodies, &states, &mut loads);
    let mut expected = [Load::default(); 3];
    let mut energy = 0.0;
    for [i, j] in [[0, 1], [0, 2], [1, 2]] {
        let pair = [bodies[i].clone(), bodies[j].clone()];
        let at = [states[i], states[j]];
        let mut of_pair = [Load::default(); 2];
        gravity.add_loads(&pair, &at, &mut of_pair);
        expected[i] += of_pair[0];
        expected[j] += of_pair[1];
        energy += gravity.potential(&pair, &at);
    }
    for (found, expected) in loads.iter().zip(&expected) {
        assert!((found.force - expected.force).norm() < 1e-15);
        assert!((found.moment - expected.moment).norm() < 1e-15);
    }
    assert!((gravity.potential(&bodies, &states) - energy).abs() < 1e-15);
}
