//! Error control and dense output.

use super::{A1, B1, D, pairs};
use crate::case::Case;
use lgvi_dynamics::gravity::{Central, Gravity};
use lgvi_dynamics::integrator::Adaptive;
use lgvi_dynamics::{BodyState, Inertia, Integrator, Load, Method, PointMass, RigidBody, System};
use nalgebra::Vector3;

/// The global error is the sum of the local errors, each at most the tolerance. It grows with the number of steps times
/// their amplification by the motion. Over eight decades, the ratio of error and tolerance stays within a constant
/// factor.
#[test]
fn errors_are_proportional_to_the_tolerance() {
    for (case, t) in [(A1, 10.0), (B1, 100.0), (D, 10.0)] {
        let reference = Case::load(case);
        for exponent in 5..=12 {
            let tolerance = 10f64.powi(-exponent);
            for method in pairs(tolerance) {
                let error = reference.errors_at(t, 1, method).greatest();
                println!("{case} {method:?}: {error:.2e}");
                assert!(
                    (10.0 * tolerance..120.0 * tolerance).contains(&error),
                    "{case}, {method:?}: {error:e}"
                );
            }
        }
    }
}

/// The solution is bitwise independent of the output interval, and output within a step is as accurate as the solution.
/// Before many steps have accumulated, the error is that of the continuous extension, which is also proportional to the
/// tolerance, with a factor that depends on the pair.
#[test]
fn states_shown_often_are_those_of_the_same_solution() {
    let (t, outputs) = (8.0, 1024);
    let reference = Case::load(A1);
    let controls = [Load::default(); 2];
    let fly = |method| {
        let mut simulation = reference.simulation(method, t / f64::from(outputs));
        let path: Vec<_> = (0..outputs)
            .map(|_| {
                simulation.advance(&controls).expect("a step");
                simulation.states().to_vec()
            })
            .collect();
        path
    };
    let distance = |a: &[BodyState], b: &[BodyState]| {
        let one = |(a, b): (&BodyState, &BodyState)| {
            let momenta = (a.linear_momentum - b.linear_momentum)
                .norm()
                .max((a.angular_momentum - b.angular_momentum).norm());
            momenta
                .max((a.position - b.position).norm())
                .max((a.attitude - b.attitude).norm())
        };
        a.iter().zip(b).map(one).fold(0.0, f64::max)
    };
    let fine = pairs(1e-14).map(fly);
    let both = fine[0].iter().zip(&fine[1]).map(|(a, b)| distance(a, b));
    let uncertainty = both.fold(0.0, f64::max);
    println!("uncertainty {uncertainty:e}");
    for exponent in [4, 6, 8, 10, 12] {
        let tolerance = 10f64.powi(-exponent);
        for method in pairs(tolerance) {
            let path = fly(method);
            let errors: Vec<_> = path
                .iter()
                .zip(&fine[0])
                .map(|(a, b)| distance(a, b))
                .collect();
            let greatest = errors.iter().copied().fold(0.0, f64::max);
            let first = errors[..64].iter().copied().fold(0.0, f64::max);
            println!("{method:?}: {first:.2e} in the first half second, {greatest:.2e} in all");
            let extension = match method {
                Method::Fehlberg78 { .. } => 5.0,
                _ => 80.0,
            };
            assert!(first < extension * tolerance, "{method:?}: {first:e}");
            assert!(greatest < 100.0 * tolerance, "{method:?}: {greatest:e}");

            let mut once = reference.simulation(method, t);
            once.advance(&controls).expect("a step");
            assert_eq!(once.states(), path[path.len() - 1], "{method:?}");
        }
    }
}

#[test]
fn the_work_does_not_depend_on_how_often_states_are_shown() {
    let reference = Case::load(D);
    let work = |outputs: u32| {
        let (mut system, mut states) = reference.system();
        let mut method = Adaptive::dormand_prince853(1e-9, system.bodies()).expect("a method");
        for _ in 0..outputs {
            let h = 16.0 / f64::from(outputs);
            method
                .step(&mut system, &mut states, &[Load::default()], h)
                .expect("a step");
        }
        method.work()
    };
    let (once, often) = (work(1), work(4096));
    println!("{once:?}, {often:?}");
    assert_eq!(
        (once.accepted, once.rejected),
        (often.accepted, often.rejected)
    );
    let steps = once.accepted + once.rejected;
    // One evaluation at the start, 11 stages per attempt, the derivative at the end of each step, and three for dense
    // output.
    assert_eq!(once.evaluations, 1 + 11 * steps + once.accepted + 3);
    assert_eq!(often.evaluations, 1 + 11 * steps + 4 * often.accepted);
}

/// A spacecraft of 1 m in size, at rotational rest on its orbit of 7000 km. The gravity gradient is 1e-7 of the
/// gravity, and the rounding of the moments is 1e-9 of them. This must not be treated as an error of a momentum that is
/// nearly zero.
#[test]
fn rounding_of_a_small_moment_does_not_stop_the_error_control() {
    let points = [1.0, -1.0].map(|x| PointMass {
        mass: 250.0,
        position: Vector3::new(x, 0.0, 0.0),
    });
    let inertia = Inertia::principal([100.0, 550.0, 550.0]).expect("inertia");
    let body = RigidBody::new(500.0, inertia, points.to_vec()).expect("body");
    let (gm, radius) = (3.986e14, 7.0e6_f64);
    let state = BodyState::from_velocities(
        &body,
        Vector3::new(radius, 0.0, 0.0),
        Vector3::new(0.0, (gm / radius).sqrt(), 0.0),
        lgvi_lie::exp(&Vector3::new(0.1, 0.2, 0.3)),
        Vector3::zeros(),
    );
    for tolerance in [1e-6, 1e-9, 1e-12] {
        for make in [Adaptive::fehlberg78, Adaptive::dormand_prince853] {
            let gravity: Vec<Box<dyn Gravity>> = vec![Box::new(Central { gm })];
            let mut system = System::new(vec![body.clone()], gravity);
            let mut states = [state];
            let mut method = make(tolerance, system.bodies()).expect("a method");
            let period = 2.0 * std::f64::consts::PI * (radius.powi(3) / gm).sqrt();
            method
                .step(&mut system, &mut states, &[Load::default()], period)
                .expect("an orbit");
            let missed = (states[0].position - state.position).norm() / radius;
            println!("{tolerance:e}: {:?}, missed by {missed:e}", method.work());
            assert!(missed < 100.0 * tolerance, "{missed:e}");
            assert!(method.work().accepted < 1000, "{:?}", method.work());
        }
    }
}
