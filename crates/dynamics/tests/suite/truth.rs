//! Accuracy and order of convergence against reference trajectories from independent methods (`tests/truth`).

use crate::case::Case;
use lgvi_dynamics::Method;
use lgvi_dynamics::integrator::Rotor;
use lgvi_truth::Errors;

/// The observed order for each of three halvings of the step size, from the largest error of the state, and the errors
/// at the finest step.
fn orders(case: &Case, t: f64, steps: u32, method: Method) -> (Vec<f64>, Errors) {
    let mut errors: Vec<_> = (0..4)
        .map(|halving| case.errors_at(t, steps << halving, method))
        .collect();
    let size = |e: &Errors| {
        e.position
            .max(e.velocity)
            .max(e.attitude)
            .max(e.angular_velocity)
    };
    let orders = errors
        .windows(2)
        .map(|pair| (size(&pair[0]) / size(&pair[1])).log2())
        .collect();
    (orders, errors.pop().expect("four runs"))
}

fn assert_order(case: &str, t: f64, steps: u32, method: Method, order: f64) -> Errors {
    let (orders, finest) = orders(&Case::load(case), t, steps, method);
    println!("{case} t = {t}, {method:?}: orders {orders:.4?}, finest {finest:?}");
    for observed in &orders {
        assert!(
            (observed - order).abs() < 0.05,
            "{case}, {method:?}: orders {orders:?}"
        );
    }
    finest
}

/// Case, time, smallest number of steps, and the errors of position, attitude and angular velocity for eight times as
/// many steps.
const CASES: [(&str, f64, u32, [f64; 3]); 7] = [
    (
        "a1_two_dumbbells_regular",
        10.0,
        5_000,
        [1.152e-6, 8.101e-5, 1.707e-4],
    ),
    ("b1_free_asymmetric", 10.0, 1_000, [0.0, 8.090e-6, 5.180e-6]),
    ("b2_dzhanibekov", 10.0, 1_000, [0.0, 3.705e-6, 3.311e-7]),
    (
        "d_dumbbell_central",
        10.0,
        2_000,
        [1.975e-6, 9.449e-6, 9.636e-6],
    ),
    ("c1_3d_pendulum", 2.0, 2_000, [0.0, 9.195e-7, 2.261e-6]),
    (
        "c3_3d_pendulum_regular_small",
        10.0,
        4_000,
        [0.0, 2.132e-7, 2.181e-6],
    ),
    (
        "e_kw4_like",
        86_400.0,
        2_000,
        [2.017e-3, 1.494e-4, 3.694e-11],
    ),
];

#[test]
fn lgvi_is_second_order_with_the_stated_error() {
    for (case, t, steps, stated) in CASES {
        let finest = assert_order(case, t, steps, Method::Lgvi(Rotor::Discrete), 2.0);
        let found = [finest.position, finest.attitude, finest.angular_velocity];
        for (found, stated) in found.iter().zip(stated) {
            assert!(
                (found - stated).abs() <= 1e-3 * stated,
                "{case}: {finest:?}"
            );
        }
    }
}

#[test]
fn lie_euler_is_first_order_and_on_a_free_body_the_lgvi_itself() {
    let method = Method::LieEuler(Rotor::Discrete);
    assert_order("d_dumbbell_central", 1.0, 4_000, method, 1.0);
    let free = Case::load("b1_free_asymmetric");
    let lgvi = free.errors_at(10.0, 1_000, Method::Lgvi(Rotor::Discrete));
    let lie_euler = free.errors_at(10.0, 1_000, method);
    assert_eq!(format!("{lie_euler:?}"), format!("{lgvi:?}"));
}
