//! Bodies that are planned together.

use lgvi_control::{
    Actuation, Dynamics, Formation, FormationError, Motion, NewtonSettings, Terminal, Transfer,
    solve_together,
};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::gravity::Sources;
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use nalgebra::{Matrix3, Vector3};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

fn body(mass: f64) -> RigidBody {
    let inertia = Inertia::principal([mass, mass, mass]).expect("inertia");
    RigidBody::new(mass, inertia, Vec::new()).expect("a body")
}

fn state(mass: f64, position: Vector3<f64>, velocity: Vector3<f64>) -> BodyState {
    BodyState {
        position,
        linear_momentum: mass * velocity,
        attitude: Matrix3::identity(),
        angular_momentum: Vector3::zeros(),
    }
}

/// A body without gravity flies from rest to rest.
fn still(mass: f64, weight: f64, ends: [Vector3<f64>; 2], intervals: usize) -> Transfer {
    let [from, to] = ends.map(|at| state(mass, at, Vector3::zeros()));
    let unit = Matrix3::identity();
    Transfer::new(
        body(mass),
        Sources::new(Vec::new()),
        3.0 / intervals as f64,
        intervals,
        from,
        Terminal::try_from(to).expect("a state"),
        Actuation::full(&(weight * unit), &unit).expect("weights"),
    )
    .expect("a transfer")
    .with_dynamics(Dynamics::Lgvi)
    .with_motion(Motion::Translation)
}

fn together(transfers: &[Transfer], separation: f64) -> Result<Formation, FormationError> {
    solve_together(transfers, separation, &NewtonSettings::default(), |_| true)
}

#[test]
fn two_bodies_exchange_places() {
    let [left, right] = [-1.0, 1.0].map(|x| Vector3::new(x, 0.0, 0.0));
    for (masses, weights) in [
        ([1.0, 1.0], [1.0, 1.0]),
        ([1.0, 3.0], [1.0, 1.0]),
        ([2.0, 1.0], [0.1, 5.0]),
    ] {
        let transfers = [
            still(masses[0], weights[0], [left, right], 40),
            still(masses[1], weights[1], [right, left], 40),
        ];
        let start = std::time::Instant::now();
        let found = together(&transfers, 0.5);
        match &found {
            Ok(found) => println!(
                "{:?} cost {} {:?}",
                found.agreement,
                found.total_cost(),
                start.elapsed()
            ),
            Err(error) => println!("{error}"),
        }
    }
}

fn cube(rng: &mut Pcg64Mcg) -> Vector3<f64> {
    Vector3::from_fn(|_, _| (rng.next_u64() >> 11) as f64 * f64::EPSILON - 1.0)
}

#[test]
fn random_formations() {
    let mut rng = Pcg64Mcg::seed_from_u64(7);
    for case in 0..24 {
        let count = 2 + case % 3;
        let low = case % 2 == 1;
        let transfers: Vec<_> = loop {
            let starts: Vec<_> = (0..count).map(|_| cube(&mut rng)).collect();
            let ends: Vec<_> = (0..count)
                .map(|i| -starts[i] + 0.2 * cube(&mut rng))
                .collect();
            let apart = |all: &[Vector3<f64>]| {
                (0..count).all(|i| (0..i).all(|j| (all[i] - all[j]).norm() > 0.45))
            };
            if apart(&starts) && apart(&ends) {
                break (0..count)
                    .map(|i| {
                        let mass = (1.5 * cube(&mut rng).x).exp();
                        let weight = cube(&mut rng).x.exp();
                        if low {
                            orbiting(100.0 * mass, weight, [100.0 * starts[i], 100.0 * ends[i]])
                        } else {
                            still(mass, weight, [starts[i], ends[i]], 40)
                        }
                    })
                    .collect();
            }
        };
        let d = if low { 40.0 } else { 0.4 };
        let start = std::time::Instant::now();
        match together(&transfers, d) {
            Ok(found) => println!(
                "{case} {count} {low} {:?} cost {} {:?}",
                found.agreement,
                found.total_cost(),
                start.elapsed()
            ),
            Err(error) => println!("{case} {count} {low} {error} {:?}", start.elapsed()),
        }
    }
}

/// A body in a low orbit flies from a place to another one, both at rest in the axes of a circular orbit.
fn orbiting(mass: f64, weight: f64, ends: [Vector3<f64>; 2]) -> Transfer {
    let (gm, radius) = (3.986e14_f64, 6.778e6_f64);
    let rate = (gm / radius.powi(3)).sqrt();
    let duration = 1200.0;
    let at = |time: f64, place: Vector3<f64>| {
        let (sin, cos) = (rate * time).sin_cos();
        let turn = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        let position = turn * (Vector3::new(radius, 0.0, 0.0) + place);
        state(
            mass,
            position,
            Vector3::new(0.0, 0.0, rate).cross(&position),
        )
    };
    let unit = Matrix3::identity();
    Transfer::new(
        body(mass),
        Central { gm },
        duration / 60.0,
        60,
        at(0.0, ends[0]),
        Terminal::try_from(at(duration, ends[1])).expect("a state"),
        Actuation::full(&(weight * unit), &unit).expect("weights"),
    )
    .expect("a transfer")
    .with_dynamics(Dynamics::Lgvi)
    .with_motion(Motion::Translation)
}
