//! The discrete rotation compared with the same equation in the exponential chart (2.3), continued from `F = I`.

use lgvi_dynamics::Inertia;
use lgvi_dynamics::rotation::{Unsolvable, solve};
use lgvi_lie::{exp, hat, to_cayley};
use nalgebra::{Matrix3, Vector3};

/// Inertias from spherical to slender and flat, each in its principal axes and rotated out of them.
fn inertias() -> Vec<Inertia> {
    let turned = exp(&Vector3::new(0.3, 0.5, -0.2));
    let moments = [
        [1.0, 1.0, 1.0],
        [1.0, 2.0, 3.0],
        [0.1, 1.0, 1.0],
        [1e-3, 0.7, 0.7],
        [0.7, 0.700_001, 1e-2],
        [2.0, 1.5, 0.8],
    ];
    let both = moments.into_iter().flat_map(|moments| {
        let diagonal = Matrix3::from_diagonal(&Vector3::from(moments));
        [diagonal, turned * diagonal * turned.transpose()]
    });
    both.map(|matrix| Inertia::new(matrix).expect("an inertia"))
        .collect()
}

fn directions(count: usize) -> impl Iterator<Item = Vector3<f64>> {
    let mut rng = fastrand::Rng::with_seed(7);
    (0..count).map(move |_| Vector3::from_fn(|_, _| 2.0 * rng.f64() - 1.0).normalize())
}

fn residual(inertia: &Inertia, g: &Vector3<f64>, f: &Matrix3<f64>) -> f64 {
    let j_d = inertia.nonstandard();
    (f * j_d - j_d * f.transpose() - hat(g)).norm() / (inertia.matrix().norm() + g.norm())
}

/// `G(f) = (sin θ/θ) J f + ((1 − cos θ)/θ²) f × J f` (2.3), `θ = |f|`, and its Jacobian by central differences.
fn exponential(inertia: &Inertia, f: &Vector3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    let value = |f: &Vector3<f64>| {
        let half = 0.5 * f.norm();
        let sinc = |x: f64| if x == 0.0 { 1.0 } else { libm::sin(x) / x };
        let jf = inertia.matrix() * f;
        sinc(2.0 * half) * jf + 0.5 * sinc(half).powi(2) * f.cross(&jf)
    };
    let step = 1e-6;
    let columns = [0, 1, 2].map(|axis| {
        let change = Vector3::ith(axis, step);
        (value(&(f + change)) - value(&(f - change))) / (2.0 * step)
    });
    (value(f), Matrix3::from_columns(&columns))
}

/// The rotation vector for `g`, by continuation from 0 with Newton's method at many points, or `None` beyond a fold.
fn follow(inertia: &Inertia, g: &Vector3<f64>, points: u32) -> Option<Vector3<f64>> {
    let mut f = Vector3::zeros();
    for point in 1..=points {
        let goal = g * (f64::from(point) / f64::from(points));
        let before = f;
        for _ in 0..8 {
            let (value, jacobian) = exponential(inertia, &f);
            f += jacobian.lu().solve(&(goal - value))?;
        }
        let (value, _) = exponential(inertia, &f);
        let solved = (goal - value).norm() < 1e-12 * g.norm();
        // A jump leads to another branch.
        if !solved || (f - before).norm() > 0.2 {
            return None;
        }
    }
    Some(f)
}

#[test]
fn the_equation_is_solved_to_rounding_up_to_the_sufficient_bound() {
    for inertia in inertias() {
        for direction in directions(300) {
            for turn in [1e-9, 1e-3, 0.1, 0.5, 0.999] {
                let g = inertia.matrix() * direction * turn;
                let found = solve(&inertia, &g).expect("a solution");
                let residual = residual(&inertia, &g, &found.matrix());
                assert!(residual < 2e-15, "{turn}: {residual:e}");
            }
        }
    }
}

/// Continuation in the chart of (2.3) leads to the same rotation, and has a solution only where `solve` has one.
#[test]
fn the_solution_is_the_one_that_grows_from_the_identity() {
    let (mut solved, mut unsolvable) = (0, 0);
    for inertia in inertias() {
        for (n, direction) in directions(60).enumerate() {
            let g = inertia.matrix() * direction * (0.1 + 0.04 * n as f64);
            match (solve(&inertia, &g), follow(&inertia, &g, 400)) {
                (Ok(found), Some(expected)) => {
                    solved += 1;
                    let cayley = to_cayley(&expected);
                    let difference = (found.cayley - cayley).norm();
                    assert!(difference < 1e-6 * cayley.norm(), "{g}: {difference:e}");
                    assert!(residual(&inertia, &g, &found.matrix()) < 1e-13);
                }
                (Err(error), None) => {
                    unsolvable += 1;
                    assert!(error.margin < 0.0);
                }
                // So close to the fold that the continuation steps over it.
                (Ok(_), None) => {
                    assert!(solve(&inertia, &(1.02 * g)).is_err(), "{g}");
                }
                (Err(_), Some(expected)) => panic!("{g}: {expected}"),
            }
        }
    }
    assert!(solved > 200 && unsolvable > 200, "{solved}, {unsolvable}");
}

#[test]
fn on_a_principal_axis_the_limit_is_a_quarter_turn() {
    let inertia = Inertia::principal([1.0, 2.0, 2.5]).expect("an inertia");
    for (axis, moment) in [1.0, 2.0, 2.5].into_iter().enumerate() {
        let f = solve(&inertia, &Vector3::ith(axis, moment * (1.0 - 1e-9))).expect("a solution");
        let angle = 2.0 * libm::atan(f.cayley.norm());
        assert!((libm::sin(angle) - (1.0 - 1e-9)).abs() < 1e-14);
        assert!(angle < std::f64::consts::FRAC_PI_2);
        let Unsolvable { turn, margin } =
            solve(&inertia, &Vector3::ith(axis, moment * 1.0001)).expect_err("past the limit");
        assert!((turn - 1.0001).abs() < 1e-12 && margin < 0.0);
    }
}

/// The rotation does not depend on the unit of inertia, even near the ends of the range of double precision.
#[test]
fn solutions_do_not_depend_on_the_unit() {
    let of = |unit: f64| {
        let inertia = Inertia::principal([unit, 2.0 * unit, 2.5 * unit]).expect("an inertia");
        let g = inertia.matrix() * Vector3::new(0.1, 0.2, -0.3);
        solve(&inertia, &g).expect("a solution").cayley
    };
    let expected = of(1.0);
    for unit in [1e-170, 1e-160, 1e160, 1e170, 1e250, 1e-290] {
        assert!((of(unit) - expected).norm() < 1e-15, "{unit:e}");
    }
}

#[test]
fn no_momentum_is_no_rotation() {
    let inertia = Inertia::principal([1.0, 2.0, 2.5]).expect("an inertia");
    let found = solve(&inertia, &Vector3::zeros()).expect("a solution");
    assert_eq!(found.cayley, Vector3::zeros());
}
