//! Quantities that the methods conserve, and quantities that drift.

use super::{ALL, B1, B2, D, assert_order, sphere};
use crate::case::Case;
use lgvi_dynamics::integrator::{Adaptive, ImplicitMidpoint};
use lgvi_dynamics::{Integrator, Load, Method, Simulation, System};
use nalgebra::Vector3;

/// A sphere under constant force and a moment along its spin axis has closed-form motion, and under the opposite loads
/// it returns to rest. No internal step may span the change.
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
        // The rotation angle t²/4 up to t = 1, and the same again: half a radian.
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

/// Stepping backwards changes the direction within an internal step, so the solution restarts.
#[test]
fn adaptive_methods_find_their_way_back() {
    let tolerance = 1e-10;
    for make in [Adaptive::fehlberg78, Adaptive::dormand_prince853] {
        let (mut system, mut states) = Case::load(D).system();
        let start = states.clone();
        let mut method = make(tolerance, system.bodies()).expect("a method");
        for h in [0.01, -0.01] {
            for _ in 0..500 {
                method
                    .step(&mut system, &mut states, &[Load::default()], h)
                    .expect("a step");
            }
        }
        let missed = (states[0].position - start[0].position)
            .norm()
            .max((states[0].attitude - start[0].attitude).norm());
        assert!(missed > 0.0 && missed < 100.0 * tolerance, "{missed:e}");
    }
}

#[test]
fn the_implicit_midpoint_rule_retraces_its_path_and_keeps_the_momentum_of_a_free_body() {
    let (mut system, mut states) = Case::load(B2).system();
    let start = states.clone();
    let momentum = states[0].angular_momentum.norm_squared();
    let mut method = ImplicitMidpoint::new(system.bodies());
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
