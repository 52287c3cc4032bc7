//! Behavior of methods at their limits.

use super::{ALL, B1, attracting, pairs, point_mass, sphere};
use crate::case::Case;
use lgvi_dynamics::{
    BodyState, Load, Method, MethodError, Mobility, Simulation, StepError, System,
};
use nalgebra::{Matrix3, Vector3};

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

/// Two point masses of mass 1, at rest at distance 1, collide after `π/4`.
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
    for tolerance in [0.0, -1e-8, 1e-18, 0.2, f64::NAN, f64::INFINITY] {
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

#[test]
fn a_system_in_which_nothing_moves_stays_as_it_is() {
    for method in ALL {
        let (body, state) = sphere();
        let fixed = body.clone().with_mobility(Mobility::Fixed);
        let states = vec![state; 2];
        let system = System::new(vec![body, fixed], vec![]);
        let mut simulation =
            Simulation::new(system, states.clone(), method, 1.0).expect("a method");
        for _ in 0..1000 {
            simulation.advance(&[Load::default(); 2]).expect("a step");
        }
        assert_eq!(simulation.states(), states, "{method:?}");
    }
}

#[test]
fn a_step_without_an_end_is_refused_where_nothing_moves() {
    for method in pairs(1e-10) {
        let mut system = System::new(vec![], vec![]);
        let mut integrator = method.integrator(&system).expect("a method");
        integrator.start(&mut system, &[]);
        let error = integrator.step(&mut system, &mut [], &[], f64::INFINITY);
        assert!(
            matches!(error, Err(StepError::StepSizeUnderflow { .. })),
            "{error:?}"
        );
    }
}

/// After a step of zero length, the backward motion must not be extrapolated from the forward motion.
#[test]
fn error_control_turns_back_over_a_step_of_no_length() {
    let case = Case::load(B1);
    for method in pairs(1e-12) {
        let (mut system, begun) = case.system();
        let mut states = begun.clone();
        let mut integrator = method.integrator(&system).expect("a method");
        integrator.start(&mut system, &states);
        for h in [10.0, 0.0, -10.0] {
            integrator
                .step(&mut system, &mut states, &[Load::default()], h)
                .expect("a step");
        }
        let error = (states[0].attitude - begun[0].attitude).norm();
        assert!(error < 1e-9, "{method:?}: {error:e}");
    }
}
