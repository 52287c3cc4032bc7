//! Mutual attraction of every pair of kinds of bodies.

use lgvi_dynamics::gravity::{Field, Fixed, Gravity, Multipole, Mutual};
use lgvi_dynamics::{BodyState, Load, Mobility};
use nalgebra::Vector3;
use num_dual::Dual64;

use crate::potentials::{
    Cloud, KINDS, Kind, Number, Triple, add, constant, legendre, quadrupole_pair, rotated,
    subtract, turned, vector,
};

const G: f64 = 1.3;

/// Two bodies at random.
struct Pair {
    clouds: [Cloud; 2],
    states: [BodyState; 2],
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

    fn loads(&self) -> [Load; 2] {
        let bodies = [self.clouds[0].body(), self.clouds[1].body()];
        let mut loads = [Load::default(); 2];
        Mutual::new(G).add_loads(&bodies, &self.states, &mut loads);
        loads
    }

    /// The potential with the positions moved by δ and the attitudes turned by ζ, body after body.
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

/// A few roundings of the greatest terms, force times distance.
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

/// A body that is held attracts another as a fixed source does, and two such bodies do nothing to each other.
#[test]
fn a_held_body_is_a_fixed_source() {
    for pair in pairs(1) {
        let [Kind::Series(_), Kind::Sphere | Kind::Points] = pair.kinds() else {
            continue;
        };
        let [held, free] = [0, 1].map(|own| pair.clouds[own].body());
        let source: Multipole = pair.clouds[0].multipole().scaled(G);
        let field = Fixed::new(source, pair.states[0].position, pair.states[0].attitude);
        let state = &pair.states[1];
        let expected = field.load(&free, &state.position, &state.attitude);
        let bodies = [held.with_mobility(Mobility::Fixed), free];
        let mut loads = [Load::default(); 2];
        Mutual::new(G).add_loads(&bodies, &pair.states, &mut loads);
        assert!((loads[1].force - expected.force).norm() < 1e-14);
        assert!((loads[1].moment - expected.moment).norm() < 1e-14);

        let bodies = bodies.map(|body| body.with_mobility(Mobility::Fixed));
        let mut loads = [Load::default(); 2];
        Mutual::new(G).add_loads(&bodies, &pair.states, &mut loads);
        assert_eq!(loads, [Load::default(); 2]);
        assert_eq!(Mutual::new(G).potential(&bodies, &pair.states), 0.0);
    }
}

/// The force between two series and the points they stand for differs, relative to the force, as the power 3 of the
/// inverse distance at second order and as the power 5 at fourth.
#[test]
fn the_error_of_the_series_falls_with_the_distance() {
    let mut rng = fastrand::Rng::with_seed(5);
    let kinds = [Kind::Points, Kind::Series(2), Kind::Series(4)];
    let exact = [0, 1].map(|_| Cloud::random(Kind::Points, &mut rng, 0.4));
    let attitudes = [0, 1].map(|_| lgvi_lie::exp(&vector(&mut rng, 1.8)));
    let direction = vector(&mut rng, 1.0).normalize();
    let force = |kind: Kind, distance: f64| {
        let clouds = exact.clone().map(|cloud| Cloud { kind, ..cloud });
        let states = [0, 1].map(|own: usize| BodyState {
            position: own as f64 * distance * direction,
            linear_momentum: Vector3::zeros(),
            attitude: attitudes[own],
            angular_momentum: Vector3::zeros(),
        });
        Pair { clouds, states }.loads()[0].force
    };
    let error = |kind: Kind, distance: f64| {
        let expected = force(kinds[0], distance);
        (force(kind, distance) - expected).norm() / expected.norm()
    };
    for (kind, power) in [(kinds[1], 3.0), (kinds[2], 5.0)] {
        let errors = [20.0, 40.0, 80.0].map(|distance| error(kind, distance));
        println!("{kind:?}: {errors:?}");
        for pair in errors.windows(2) {
            let slope = (pair[0] / pair[1]).log2();
            assert!((slope - power).abs() < 0.15, "{kind:?}: {errors:?}");
        }
    }
}
