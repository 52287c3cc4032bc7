//! Replanning during the flight.

use lgvi_control::{NewtonSettings, Plan, Start, TooLate, Transfer, solve};
use lgvi_dynamics::BodyState;
use lgvi_lie::exp;
use nalgebra::Vector3;

use crate::case::Case;

/// A plan and its number of Newton steps.
fn plan(transfer: &Transfer, start: Start<'_>) -> (Plan, u32) {
    let mut iterations = 0;
    let plan = solve(transfer, start, &NewtonSettings::default(), |now| {
        iterations = now.iteration;
        true
    });
    (plan.expect("a plan"), iterations)
}

fn shaken(state: &BodyState) -> BodyState {
    let off = Vector3::new(1e-3, -2e-3, 1.5e-3);
    BodyState {
        position: state.position + off,
        linear_momentum: state.linear_momentum - off,
        attitude: state.attitude * exp(&(3.0 * off)),
        angular_momentum: state.angular_momentum + 0.03 * off,
    }
}

/// Bellman's principle: the rest of an optimal plan is the optimal plan of the rest.
#[test]
fn without_disturbance_the_rest_of_a_plan_is_optimal() {
    for set in ["C_i", "C_ii"] {
        let transfer = Case::load(set).transfer(100);
        let (whole, _) = plan(&transfer, Start::Cold);
        for step in [1, 40, 90] {
            let state = whole.states[step];
            let rest = transfer.remaining(step, state).expect("a transfer");
            let expected = whole.remaining(&transfer, step).expect("a plan");
            let (found, iterations) = plan(&rest, Start::Warm(&expected));
            assert!(iterations <= 2, "{set}, {step}: {iterations}");
            assert!((found.cost - expected.cost).abs() <= 1e-9 * whole.cost);
            for (found, expected) in found.commands.iter().zip(&expected.commands) {
                assert!((found - expected).norm() < 1e-8 * (1.0 + expected.norm()));
            }
        }
    }
}

#[test]
fn a_disturbed_flight_is_planned_again_in_few_iterations_to_the_same_end() {
    for set in ["C_i", "C_ii"] {
        let transfer = Case::load(set).transfer(100);
        let (whole, cold) = plan(&transfer, Start::Cold);
        for step in [0, 30, 60, 80] {
            let state = shaken(&whole.states[step]);
            let rest = transfer.remaining(step, state).expect("a transfer");
            assert_eq!(rest.intervals(), 100 - step);
            let shifted = whole.remaining(&transfer, step).expect("a plan");
            let (found, iterations) = plan(&rest, Start::Warm(&shifted));
            assert!(
                iterations <= 4 && 2 * iterations < cold,
                "{set}, {step}: {iterations} of {cold}"
            );
            assert_eq!(found.states[0], state);
            assert!(found.certificate.terminal <= 1e-12);
            let (from_nothing, _) = plan(&rest, Start::Cold);
            assert!(found.cost <= from_nothing.cost * (1.0 + 1e-8));
        }
    }
}

#[test]
fn too_little_that_remains_is_an_error() {
    let transfer = Case::load("C_i").transfer(50);
    let (whole, _) = plan(&transfer, Start::Cold);
    let state = whole.states[48];
    assert!(transfer.remaining(48, state).is_ok());
    for (step, remaining) in [(49, 1), (50, 0), (70, 0)] {
        let error = TooLate {
            step,
            intervals: 50,
            remaining,
        };
        assert_eq!(transfer.remaining(step, state).err(), Some(error));
        assert_eq!(whole.remaining(&transfer, step), Err(error));
    }
}
