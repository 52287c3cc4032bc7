//! The preprocessed discrete Moser–Veselov step against reference trajectories and closed forms.

use crate::case::Case;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::rotation::{PreprocessedDmv, PreprocessedOrder};
use lgvi_dynamics::{BodyState, Inertia, Method, Simulation, System};
use lgvi_lie::{compose, exp, hat, rotate_back};
use nalgebra::{Matrix3, Vector3};

const ORDERS: [(PreprocessedOrder, f64); 4] = [
    (PreprocessedOrder::Four, 4.0),
    (PreprocessedOrder::Six, 6.0),
    (PreprocessedOrder::Eight, 8.0),
    (PreprocessedOrder::Ten, 10.0),
];

/// R and Π after `steps` steps of size `h`.
fn fly(
    dmv: &PreprocessedDmv,
    mut r: Matrix3<f64>,
    mut pi: Vector3<f64>,
    h: f64,
    steps: u32,
) -> (Matrix3<f64>, Vector3<f64>) {
    for _ in 0..steps {
        let f = dmv.step(&pi, h).expect("a step").cayley;
        r = compose(&r, &f);
        pi = rotate_back(&f, &pi);
    }
    (r, pi)
}

/// Asserts the order over each halving from `steps` steps, of the errors of R and Π (relative) each, down to the error
/// `floor` of rounding and of the reference.
fn assert_order(
    order: f64,
    (steps, halvings): (u32, u32),
    floor: f64,
    errors: impl Fn(u32) -> [f64; 2],
) {
    let errors: Vec<_> = (0..=halvings).map(|n| errors(steps << n)).collect();
    println!("order {order}: {errors:?}");
    for pair in errors.windows(2) {
        for (coarse, fine) in pair[0].iter().zip(pair[1]) {
            // The orders are two apart, and the coarsest steps turn by up to 0.9 rad.
            let observed = (coarse / fine).log2();
            assert!(
                (observed - order).abs() < 0.6 || fine < floor,
                "expected {order}: {errors:?}"
            );
        }
    }
    assert!(errors[0][0] > 50.0 * floor, "nothing measured: {errors:?}");
}

/// Body axes turned against the principal axes.
fn turned_axes() -> Matrix3<f64> {
    exp(&Vector3::new(0.3, 0.5, -0.2))
}

/// Coarsest number of steps over the whole flight and halvings, such that all is above rounding and at most 0.9 rad a step.
const STEPS: [(u32, u32); 4] = [(40, 3), (28, 3), (20, 3), (20, 1)];

#[test]
fn each_order_is_reached_on_the_reference_trajectories_in_any_body_axes() {
    let method = Method::Lgvi(Rotor::default());
    for (name, turned) in [
        ("b1_free_asymmetric", false),
        ("b1_free_asymmetric", true),
        ("b2_dzhanibekov", false),
        ("b2_dzhanibekov", true),
    ] {
        let case = Case::load(name);
        let start = case.simulation(method, 1.0);
        let body = &start.system().bodies()[0];
        let state = start.states()[0];
        let axes = if turned {
            turned_axes()
        } else {
            Matrix3::identity()
        };
        let matrix = axes * body.inertia().matrix() * axes.transpose();
        let inertia = Inertia::new(matrix).expect("an inertia");
        for ((order, expected), (steps, halvings)) in ORDERS.into_iter().zip(STEPS) {
            let dmv = PreprocessedDmv::new(&inertia, order);
            assert_order(expected, (steps, halvings), 2e-12, |steps| {
                let h = 10.0 / f64::from(steps);
                let (r, pi) = fly(
                    &dmv,
                    state.attitude * axes.transpose(),
                    axes * state.angular_momentum,
                    h,
                    steps,
                );
                let end = BodyState {
                    attitude: r * axes,
                    angular_momentum: axes.transpose() * pi,
                    ..state
                };
                let system = System::new(vec![body.clone()], vec![]);
                let end = Simulation::new(system, vec![end], method, 1.0).expect("a method");
                let errors = case.compare(10.0, &end);
                [errors.attitude, errors.angular_velocity]
            });
        }
    }
}

/// Bodies of revolution, where the motion is two rotations: `R = R_0 exp(t Π_0/J_⊥) exp(t Ω_a (1 − J_a/J_⊥) e_a)`.
#[test]
fn each_order_is_reached_on_bodies_of_revolution_and_spheres() {
    let omega = Vector3::new(0.6, -0.5, 0.7);
    for (axis, axial, across) in [
        (2, 0.5, 1.0),
        (1, 2.0, 1.0),
        (0, 1.0, 1.0),
        (0, 1e-3, 0.7),
        (2, 1e-4, 1.0),
    ] {
        let mut moments = Vector3::repeat(across);
        moments[axis] = axial;
        let pi = moments.component_mul(&omega);
        // A rounding of Π is one of the spin of a thin rod times the ratio of moments.
        let floor = 2e-12 + 1e-15 / axial;
        let spin = omega[axis] * (1.0 - axial / across) * Vector3::ith(axis, 1.0);
        for ((order, expected), (steps, halvings)) in ORDERS.into_iter().zip(STEPS) {
            let inertia = Inertia::principal(moments.into()).expect("an inertia");
            let dmv = PreprocessedDmv::new(&inertia, order);
            assert_order(expected, (steps, halvings), floor, |steps| {
                let t = 10.0;
                let h = t / f64::from(steps);
                let (r, found) = fly(&dmv, Matrix3::identity(), pi, h, steps);
                let exact = exp(&(t / across * pi)) * exp(&(t * spin));
                let momentum = exact.transpose() * pi;
                [
                    (r - exact).norm(),
                    (found - momentum).norm() / momentum.norm(),
                ]
            });
        }
    }
}

/// A thin rod that is not quite a body of revolution, against the classical Runge–Kutta method with tiny steps.
#[test]
fn each_order_is_reached_on_an_asymmetric_rod() {
    let inertia = Inertia::principal([1e-3, 0.7, 0.7008]).expect("an inertia");
    let start = inertia.matrix() * Vector3::new(0.6, -0.5, 0.7);
    let rate = |(r, pi): (Matrix3<f64>, Vector3<f64>)| {
        let omega = inertia.inverse() * pi;
        (r * hat(&omega), pi.cross(&omega))
    };
    let (mut r, mut pi) = (Matrix3::identity(), start);
    let h = 10.0 / 10_000.0;
    for _ in 0..10_000 {
        let a = rate((r, pi));
        let b = rate((r + 0.5 * h * a.0, pi + 0.5 * h * a.1));
        let c = rate((r + 0.5 * h * b.0, pi + 0.5 * h * b.1));
        let d = rate((r + h * c.0, pi + h * c.1));
        r += h / 6.0 * (a.0 + 2.0 * (b.0 + c.0) + d.0);
        pi += h / 6.0 * (a.1 + 2.0 * (b.1 + c.1) + d.1);
    }
    for ((order, expected), (steps, halvings)) in ORDERS.into_iter().zip(STEPS) {
        let dmv = PreprocessedDmv::new(&inertia, order);
        assert_order(expected, (steps, halvings), 2e-12, |steps| {
            let h = 10.0 / f64::from(steps);
            let (found, momentum) = fly(&dmv, Matrix3::identity(), start, h, steps);
            [(found - r).norm(), (momentum - pi).norm() / pi.norm()]
        });
    }
}

#[test]
fn a_long_flight_keeps_momentum_and_energy_to_rounding() {
    for moments in [[1.0, 2.0, 2.5], [1e-3, 0.7, 0.7008]] {
        let inertia = Inertia::principal(moments).expect("an inertia");
        let start = inertia.matrix() * Vector3::new(0.6, -0.5, 0.7);
        let energy = |pi: &Vector3<f64>| 0.5 * pi.dot(&(inertia.inverse() * pi));
        for (order, _) in ORDERS {
            let dmv = PreprocessedDmv::new(&inertia, order);
            let (r, pi) = fly(&dmv, Matrix3::identity(), start, 0.3, 100_000);
            let momentum = (r * pi - start).norm() / start.norm();
            let energy = (energy(&pi) / energy(&start) - 1.0).abs();
            println!("{moments:?} {order:?}: {momentum:.1e} {energy:.1e}");
            // A random walk of roundings over 1e5 steps is 1e-13.
            assert!(momentum < 1e-12 && energy < 1e-12);
        }
    }
}
