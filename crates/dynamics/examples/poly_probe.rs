//! Temporary probe.
use lgvi_dynamics::gravity::{Attractor, Gravity, Mutual, Polyhedron, PolyhedronField};
use lgvi_dynamics::{BodyState, Load, RigidBody};
use nalgebra::{Matrix3, Vector3};
use std::hint::black_box;
use std::time::Instant;

fn best(mut work: impl FnMut()) -> f64 {
    let mut least = f64::INFINITY;
    for _ in 0..7 {
        let mut n = 0;
        let begun = Instant::now();
        while begun.elapsed().as_secs_f64() < 0.02 {
            work();
            n += 1;
        }
        least = least.min(begun.elapsed().as_secs_f64() / n as f64);
    }
    1e6 * least
}
fn main() {
    for sub in [1, 2, 3, 4, 5] {
        let begun = Instant::now();
        let body = Polyhedron::ellipsoid([1.0, 0.7, 0.5], sub, 1.0).unwrap();
        let field = PolyhedronField::new(&body, 1.0);
        let setup = begun.elapsed().as_secs_f64();
        for r in [1.05, 1.3, 1.7, 2.0, 2.5, 4.0, 8.0, 30.0] {
            let d = r * Vector3::new(0.5, -0.6, 0.4).normalize();
            let a = best(|| {
                black_box(Attractor::acceleration(&field, black_box(&d)));
            });
            let u = best(|| {
                black_box(Attractor::potential(&field, black_box(&d)));
            });
            println!(
                "{} faces setup {:.3} s r {r}: a {a:.2} us u {u:.2} us {:?}",
                body.faces().len(),
                setup,
                Attractor::acceleration(&field, &d)
            );
        }
    }
    for ratio in [1.2, 1.5, 2.0, 2.5, 5.0] {
        for sub in [2, 3] {
            let bodies = [[1.0, 0.9, 0.8], [0.7, 0.6, 0.5]].map(|axes| {
                RigidBody::with_polyhedron(None, &Polyhedron::ellipsoid(axes, sub, 1.0).unwrap(), 4)
                    .unwrap()
            });
            let states = [0.0, 1.7 * ratio].map(|x| BodyState {
                position: Vector3::new(0.6 * x, 0.48 * x, 0.64 * x),
                linear_momentum: Vector3::zeros(),
                attitude: lgvi_lie::exp(&Vector3::new(0.3, x, -0.4)),
                angular_momentum: Vector3::zeros(),
            });
            let mut mutual = Mutual::new(1.0);
            let mut loads = [Load::default(); 2];
            let t = best(|| {
                loads = [Load::default(); 2];
                mutual.add_loads(&bodies, black_box(&states), &mut loads);
            });
            println!("pair sub {sub} ratio {ratio}: {t:.1} us {:?}", loads[0]);
        }
    }
    let _ = Matrix3::<f64>::identity();
}
