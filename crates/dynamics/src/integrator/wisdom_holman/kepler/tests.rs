use fastrand::Rng;

use super::references::REFERENCES;
use super::*;

/// The end of a motion.
fn end(mu: f64, [r, v]: [Vector3<f64>; 2], t: f64) -> [Vector3<f64>; 2] {
    let [dr, dv] = advance(mu, &r, &v, t).unwrap();
    [r + dr, v + dv]
}

/// The relative error, in units of rounding times how far the end moves with the start.
#[test]
fn motions_match_mpmath() {
    let mut worst = 0.0_f64;
    for row in REFERENCES {
        let vector = |from: usize| Vector3::new(row[from], row[from + 1], row[from + 2]);
        let [r, v] = end(row[0], [vector(1), vector(4)], row[7]);
        let (r_end, v_end, condition) = (vector(8), vector(11), row[14]);
        let error = ((r - r_end).norm() / r_end.norm()).max((v - v_end).norm() / v_end.norm());
        worst = worst.max(error / (f64::EPSILON * condition.max(1.0)));
    }
    println!("{worst:.2}");
    assert!(worst < 8.0, "{worst}");
}

/// A random orbit about μ = 1 of any shape, its state, and a time within which it moves far.
fn orbit(rng: &mut Rng) -> ([Vector3<f64>; 2], f64) {
    let mut direction = || Vector3::from_fn(|_, _| rng.f64() - 0.5).normalize();
    let (r, v) = (direction(), direction());
    let r = r * libm::exp(4.0 * (rng.f64() - 0.5));
    // Up to 1.5 times the speed of the parabola.
    let v = v * (0.1 + 1.4 * rng.f64()) * (2.0 / r.norm()).sqrt();
    let scale = r.norm().powi(3).sqrt();
    ([r, v], 40.0 * (rng.f64() - 0.5) * scale)
}

fn energy([r, v]: [Vector3<f64>; 2]) -> f64 {
    0.5 * v.norm_squared() - 1.0 / r.norm()
}

#[test]
fn energy_and_angular_momentum_are_kept_and_motions_go_back() {
    let mut rng = Rng::with_seed(7);
    let mut all = [[0.0_f64; 3]; 2];
    for _ in 0..20_000 {
        let (start, t) = orbit(&mut rng);
        let there = end(1.0, start, t);
        let back = end(1.0, there, -t);
        // Near the center an error of the distance at the other end is as many times as great.
        let [here, end] = [start, there].map(|[r, _]| r.norm());
        let near = here.min(end) / here.max(end);
        let speed = start[1].norm().max(there[1].norm());
        let periods = 1.0 + t.abs() * (-2.0 * energy(start)).max(0.0).powf(1.5);
        let errors = [
            near * (energy(there) - energy(start)).abs() * here.min(end),
            (there[0].cross(&there[1]) - start[0].cross(&start[1])).norm()
                / (here.max(end) * speed),
            near * near * (back[0] - start[0]).norm() / here.max(end) / periods,
        ];
        let kind = usize::from(energy(start) > 0.0);
        for (worst, error) in all[kind].iter_mut().zip(errors) {
            *worst = worst.max(error);
        }
    }
    println!("{all:?}");
    // A hyperbola that comes from afar and passes the center closely loses digits of its distance.
    for (worst, limits) in all.iter().zip([[4e-15, 4e-15, 1e-13], [6e-14; 3]]) {
        let mut each = worst.iter().zip(limits);
        assert!(each.all(|(error, limit)| *error < limit), "{all:?}");
    }
}

/// The iteration ends for every orbit, also through the center, at every time.
#[test]
fn extreme_orbits_end() {
    let mut rng = Rng::with_seed(8);
    let mut refused = 0;
    for _ in 0..50_000 {
        let ([r, mut v], t) = orbit(&mut rng);
        let across = v - r * (r.dot(&v) / r.norm_squared());
        v -= across * (1.0 - libm::exp(-50.0 * rng.f64())) * f64::from(rng.u8(0..2));
        let v = v * libm::exp(6.0 * (rng.f64() - 0.5));
        let t = t * libm::exp(40.0 * (rng.f64() - 0.5));
        match advance(1.0, &r, &v, t) {
            Ok([dr, dv]) => {
                let there = [r + dr, v + dv];
                let deep = 1.0 / there[0].norm() + 1.0 / r.norm() + v.norm_squared();
                let error = (energy(there) - energy([r, v])).abs() / deep;
                // Where the end is near the center, the distance is rounding of the start.
                assert!(
                    there[0].norm() < 1e-8 * r.norm() || error < 1e-7,
                    "{error:e} {r} {v} {t}"
                );
            }
            Err(_) => refused += 1,
        }
    }
    println!("{refused}");
    assert!(refused < 100, "{refused}");
}

#[test]
fn a_collision_is_an_error() {
    let still = Vector3::zeros();
    // From rest at 1 a body is at the center after π/√8.
    let fall = advance(1.0, &Vector3::x(), &still, PI / 8.0_f64.sqrt());
    println!("{fall:?}");
    assert!(!matches!(fall, Ok([moved, _]) if (moved + Vector3::x()).norm() > 1e-8));
    assert_eq!(
        advance(1.0, &still, &Vector3::x(), 1.0),
        Err(Obstacle::NotFinite)
    );
    assert_eq!(
        advance(1.0, &Vector3::x(), &Vector3::y(), f64::NAN),
        Err(Obstacle::NotFinite)
    );
}
