//! The methods to compare with: their orders, error control and dense output against reference trajectories, and what
//! they keep.

use crate::case::Case;
use lgvi_dynamics::gravity::{Central, Gravity, Mutual};
use lgvi_dynamics::integrator::{Adaptive, RungeKutta};
use lgvi_dynamics::{
    BodyState, Drive, Inertia, Integrator, Load, Method, MethodError, Mobility, PointMass,
    RigidBody, Simulation, StepError, System,
};
use nalgebra::{Matrix3, Vector3};

const A1: &str = "a1_two_dumbbells_regular";
const B1: &str = "b1_free_asymmetric";
const B2: &str = "b2_dzhanibekov";
const D: &str = "d_dumbbell_central";

/// The observed order over each halving of the step.
fn orders(errors: &[f64]) -> Vec<f64> {
    errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect()
}

fn assert_order(what: &str, errors: &[f64], order: f64, within: f64) {
    let orders = orders(errors);
    println!(
        "{what}: orders {orders:.3?}, finest {:.2e}",
        errors[errors.len() - 1]
    );
    for observed in &orders {
        assert!((observed - order).abs() < within, "{what}: {orders:?}");
    }
}

#[test]
fn fixed_step_methods_have_their_order() {
    let second = [
        Method::ExplicitMidpoint,
        Method::ImplicitMidpoint,
        Method::CrouchGrossman,
    ];
    for (case, t, steps) in [
        (A1, 2.0, 2_000),
        (B1, 10.0, 1_000),
        (B2, 10.0, 1_000),
        (D, 10.0, 4_000),
    ] {
        let reference = Case::load(case);
        let errors = |method, steps: u32| {
            [0, 1, 2, 3].map(|halving| reference.errors_at(t, steps << halving, method).greatest())
        };
        for method in second {
            assert_order(
                &format!("{case} {method:?}"),
                &errors(method, steps),
                2.0,
                0.05,
            );
        }
        let method = Method::RungeKutta4;
        assert_order(
            &format!("{case} {method:?}"),
            &errors(method, steps / 4),
            4.0,
            0.1,
        );
    }
}

#[test]
fn embedded_methods_are_of_eighth_order_with_fixed_steps() {
    for (case, t, steps) in [(A1, 1.0, 10), (B1, 10.0, 12), (D, 1.0, 4)] {
        let reference = Case::load(case);
        for make in [RungeKutta::fehlberg8, RungeKutta::dormand_prince8] {
            let errors = [0, 1, 2].map(|halving| {
                let (mut system, mut states) = reference.system();
                let controls = vec![Load::default(); states.len()];
                let mut method = make(system.bodies());
                let steps = steps << halving;
                let h = t / f64::from(steps);
                for _ in 0..steps {
                    method
                        .step(&mut system, &mut states, &controls, h)
                        .expect("a step");
                }
                reference.compare(t, system.bodies(), &states).greatest()
            });
            assert_order(case, &errors, 8.0, 0.5);
        }
    }
}

fn pairs(tolerance: f64) -> [Method; 2] {
    [
        Method::Fehlberg78 { tolerance },
        Method::DormandPrince853 { tolerance },
    ]
}

/// The sum of the local errors, each at most the tolerance, grows as the number of steps times how the motion amplifies
/// it; over eight
/// decades the ratio of error and tolerance stays within a factor.
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

fn sphere() -> (RigidBody, BodyState) {
    let inertia = Inertia::principal([2.0; 3]).expect("inertia");
    let body = RigidBody::new(4.0, inertia, vec![]).expect("body");
    let zero = Vector3::zeros();
    let state = BodyState::from_velocities(&body, zero, zero, Matrix3::identity(), zero);
    (body, state)
}

const ALL: [Method; 6] = [
    Method::ExplicitMidpoint,
    Method::ImplicitMidpoint,
    Method::CrouchGrossman,
    Method::RungeKutta4,
    Method::Fehlberg78 { tolerance: 1e-12 },
    Method::DormandPrince853 { tolerance: 1e-12 },
];

/// A sphere under constant force and a moment along its spin axis has closed-form motion, and under the opposite ones
/// it comes to rest again: no internal step reaches over the change.
#[test]
fn controls_act_as_constant_force_and_moment_and_may_change_between_steps() {
    let control = Load {
        force: Vector3::new(8.0, 0.0, 0.0),
        moment: Vector3::new(0.0, 0.0, 1.0),
    };
    let opposite = Load {
        force: -control.force,
        moment: -control.moment,
    };
    for method in ALL {
        let (body, state) = sphere();
        let system = System::new(vec![body], vec![]);
        let mut simulation = Simulation::new(system, vec![state], method, 0.01).expect("a method");
        for _ in 0..100 {
            simulation.advance(&[control]).expect("a step");
        }
        let middle = simulation.states()[0];
        assert!((middle.linear_momentum.x - 8.0).abs() < 1e-13, "{method:?}");
        assert!(
            (middle.angular_momentum.z - 1.0).abs() < 1e-13,
            "{method:?}"
        );
        assert!((middle.position.x - 1.0).abs() < 1e-13, "{method:?}");
        for _ in 0..100 {
            simulation.advance(&[opposite]).expect("a step");
        }
        let end = simulation.states()[0];
        assert!(end.linear_momentum.norm() < 1e-13, "{method:?}: {end:?}");
        assert!(end.angular_momentum.norm() < 1e-13, "{method:?}: {end:?}");
        assert!((end.position.x - 2.0).abs() < 1e-13, "{method:?}: {end:?}");
        // The turn t²/4 up to t = 1 and as much again: half a radian.
        let turned = lgvi_lie::log(&end.attitude).z;
        let miss = (turned - 0.5).abs();
        let allowed = match method {
            Method::ExplicitMidpoint | Method::ImplicitMidpoint => 2e-6,
            Method::CrouchGrossman => 1e-14,
            _ => 2e-12,
        };
        assert!(miss < allowed, "{method:?}: {miss:e}");
    }
}

/// `|RᵀR − I|` after n steps of a method whose stability function on the imaginary axis is `|P(iz)|² = 1 + c z^{p+2}`.
#[test]
fn orthogonality_is_kept_by_the_implicit_midpoint_rule_and_drifts_as_the_order_of_the_others_tells()
{
    let reach = |case: &Case, method, h| {
        let mut simulation = case.simulation(method, h);
        let mut greatest = 0.0_f64;
        for _ in 0..10_000 {
            simulation.advance(&[Load::default()]).expect("a step");
            greatest = greatest.max(simulation.invariants().orthogonality_error);
        }
        greatest
    };
    for name in [B1, D] {
        let case = Case::load(name);
        for method in [Method::ImplicitMidpoint, Method::CrouchGrossman] {
            for h in [0.02, 0.01] {
                let error = reach(&case, method, h);
                println!("{name} {method:?}, h = {h}: {error:.1e}");
                assert!(error < 1e-13, "{name}, {method:?}, h = {h}: {error:e}");
            }
        }
    }
    let case = Case::load(B1);
    for (method, order) in [(Method::ExplicitMidpoint, 2.0), (Method::RungeKutta4, 4.0)] {
        let errors = [0.02, 0.01].map(|h| reach(&case, method, h));
        assert_order(&format!("{method:?}"), &errors, order + 2.0, 0.1);
    }
}

#[test]
fn the_implicit_midpoint_rule_retraces_its_path_and_keeps_the_momentum_of_a_free_body() {
    let (mut system, mut states) = Case::load(B2).system();
    let start = states.clone();
    let momentum = states[0].angular_momentum.norm_squared();
    let mut method = lgvi_dynamics::integrator::ImplicitMidpoint::new(system.bodies());
    for h in [0.1, -0.1] {
        for _ in 0..1000 {
            method
                .step(&mut system, &mut states, &[Load::default()], h)
                .expect("a step");
        }
        let drift = (states[0].angular_momentum.norm_squared() / momentum - 1.0).abs();
        assert!(drift < 1e-13, "{drift:e}");
    }
    let missed = (states[0].attitude - start[0].attitude).norm();
    println!("missed by {missed:e}");
    assert!(missed < 1e-10, "{missed:e}");
}

#[test]
fn implicit_equations_are_solved_beyond_where_their_iteration_contracts_or_the_step_fails() {
    let case = Case::load(B1);
    let mut simulation = case.simulation(Method::ImplicitMidpoint, 2.0);
    for _ in 0..100 {
        simulation.advance(&[Load::default()]).expect("a step");
    }
    let error = simulation.invariants().orthogonality_error;
    println!("RᵀR − I: {error:e}");
    assert!(error < 1e-12, "{error:e}");

    let mut simulation = case.simulation(Method::ImplicitMidpoint, 1e6);
    let before = simulation.states().to_vec();
    match simulation.advance(&[Load::default()]) {
        Err(StepError::NotConverged {
            iterations,
            residual,
            tolerance,
        }) => {
            assert!(iterations > 0 && residual > tolerance);
        }
        other => panic!("{other:?}"),
    }
    assert_eq!(simulation.states(), before);
}

fn point_mass() -> RigidBody {
    let point = PointMass {
        mass: 1.0,
        position: Vector3::zeros(),
    };
    let inertia = Inertia::principal([1.0; 3]).expect("inertia");
    RigidBody::new(1.0, inertia, vec![point]).expect("body")
}

fn attracting(bodies: Vec<RigidBody>) -> System {
    let gravity: Vec<Box<dyn Gravity>> = vec![Box::new(Mutual::new(1.0))];
    System::new(bodies, gravity)
}

/// Two points of mass 1 at rest at distance 1 meet after `π/4`.
#[test]
fn a_collision_stops_the_error_control_and_leaves_the_state() {
    for method in pairs(1e-10) {
        let body = point_mass();
        let at = |x| {
            let (x, zero) = (Vector3::new(x, 0.0, 0.0), Vector3::zeros());
            BodyState::from_velocities(&body, x, zero, Matrix3::identity(), zero)
        };
        let states = vec![at(0.5), at(-0.5)];
        let system = attracting(vec![body.clone(); 2]);
        let mut simulation = Simulation::new(system, states, method, 0.75).expect("a method");
        let controls = [Load::default(); 2];
        simulation.advance(&controls).expect("a step up to before");
        let before = simulation.states().to_vec();
        match simulation.advance(&controls) {
            Err(StepError::StepSizeUnderflow { step, least }) => assert!(step < least),
            other => panic!("{method:?}: {other:?}"),
        }
        assert_eq!(simulation.states(), before);
        assert_eq!(simulation.step(), 1);
    }
}

#[test]
fn a_tolerance_out_of_range_is_refused() {
    for tolerance in [0.0, -1e-8, 1e-16, 0.2, f64::NAN, f64::INFINITY] {
        for method in pairs(tolerance) {
            let (body, state) = sphere();
            let made = Simulation::new(System::new(vec![body], vec![]), vec![state], method, 0.1);
            match made.err() {
                Some(MethodError::Parameter {
                    parameter, value, ..
                }) => {
                    assert_eq!(
                        (parameter, value.to_bits()),
                        ("tolerance", tolerance.to_bits())
                    );
                }
                other => panic!("{method:?}: {other:?}"),
            }
        }
    }
}

/// A body driven on a circle attracts a pivoted and a free dumbbell. A driven body at any time but that of the stage
/// would cost the methods their order.
#[test]
fn driven_bodies_are_where_they_are_at_every_stage() {
    let build = || {
        let dumbbell = |mass: f64| {
            let points = [0.1, -0.1].map(|x| PointMass {
                mass: 0.5 * mass,
                position: Vector3::new(x, 0.0, 0.0),
            });
            let moments = [0.005, 0.012, 0.012].map(|moment| moment * mass);
            let inertia = Inertia::principal(moments).expect("inertia");
            RigidBody::new(mass, inertia, points.to_vec()).expect("body")
        };
        let centre = Vector3::new(0.0, 0.1, 0.0);
        let drive = Drive::circle(
            centre,
            Vector3::new(0.0, 0.3, 1.0),
            Vector3::new(0.4, 0.0, 0.0),
        );
        let bodies = vec![
            dumbbell(2.0).with_mobility(Mobility::Driven(drive)),
            dumbbell(1.0).with_mobility(Mobility::Pivoted),
            dumbbell(0.5),
            dumbbell(1.0).with_mobility(Mobility::Fixed),
        ];
        let at = |index: usize, x: [f64; 3], v: [f64; 3]| {
            let omega = Vector3::new(0.3, -0.2, 0.5);
            let attitude = lgvi_lie::exp(&omega);
            BodyState::from_velocities(&bodies[index], x.into(), v.into(), attitude, omega)
        };
        let states = vec![
            at(0, [0.7, 0.0, 0.0], [0.0; 3]),
            at(1, [-0.6, 0.2, 0.3], [0.0; 3]),
            at(2, [0.0, 2.5, 0.0], [-0.9, 0.0, 0.3]),
            at(3, [0.0, -1.0, -0.8], [0.0; 3]),
        ];
        (attracting(bodies), states)
    };
    let t = 2.0;
    let end = |method, steps: u32| {
        let (system, states) = build();
        let mut simulation =
            Simulation::new(system, states, method, t / f64::from(steps)).expect("a method");
        for _ in 0..steps {
            simulation.advance(&[Load::default(); 4]).expect("a step");
        }
        simulation.states().to_vec()
    };
    let error = |a: &[BodyState], b: &[BodyState]| {
        let one = |(a, b): (&BodyState, &BodyState)| {
            (a.position - b.position)
                .norm()
                .max((a.attitude - b.attitude).norm())
        };
        a.iter().zip(b).map(one).fold(0.0, f64::max)
    };
    let fine = end(Method::DormandPrince853 { tolerance: 1e-13 }, 1);
    for (method, order) in [
        (Method::ExplicitMidpoint, 2.0),
        (Method::ImplicitMidpoint, 2.0),
        (Method::CrouchGrossman, 2.0),
        (Method::RungeKutta4, 4.0),
    ] {
        let errors = [0, 1, 2, 3].map(|halving| error(&end(method, 50 << halving), &fine));
        assert_order(&format!("{method:?}"), &errors, order, 0.2);
    }
    let (system, mut start) = build();
    system.constrain(&mut start);
    assert_eq!(fine[3], start[3], "fixed");
    assert_eq!(fine[1].position, start[1].position, "pivoted");
    for steps in [1, 7, 1000] {
        let other = error(&end(Method::Fehlberg78 { tolerance: 1e-12 }, steps), &fine);
        println!("both pairs, {steps} outputs: {other:e}");
        assert!(other < 1e-10, "{steps} outputs: {other:e}");
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
    // The start, 11 stages an attempt and the derivative at the end of each step; three for dense output.
    assert_eq!(once.evaluations, 1 + 11 * steps + once.accepted + 3);
    assert_eq!(often.evaluations, 1 + 11 * steps + 4 * often.accepted);
}

/// A spacecraft at rest in its orbit, 7000 km and 1 m in size: the gradient of gravity is 1e-7 of it, and rounding of the
/// moments 1e-9 of them; they must not be taken for an error of a momentum that is next to nothing.
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
