//! Replanning during the flight.

use lgvi_control::{Dynamics, NewtonSettings, Plan, Start, Sweep, TooLate, Transfer, solve};
use lgvi_dynamics::BodyState;
use lgvi_lie::exp;
use nalgebra::{SVector, Vector3};

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

/// A state that is off by `size`, relative to the units of the case.
fn shifted(state: &BodyState, size: f64) -> BodyState {
    let off = size * Vector3::new(1.0, -2.0, 1.5).normalize();
    BodyState {
        position: state.position + off,
        linear_momentum: state.linear_momentum - off,
        attitude: state.attitude * exp(&off),
        angular_momentum: state.angular_momentum + 0.03 * off,
    }
}

/// Largest difference relative to the largest entry.
fn apart<const D: usize>(found: &[SVector<f64, D>], expected: &[SVector<f64, D>]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let largest = expected.iter().map(SVector::amax).fold(0.0, f64::max);
    let pairs = found.iter().zip(expected);
    pairs.map(|(a, b)| (a - b).amax()).fold(0.0, f64::max) / largest
}

/// The gains of the first nine tenths of two plans differ by this.
fn gains_apart(found: &Plan, expected: &Plan) -> f64 {
    let most = expected.feedback.len() * 9 / 10;
    let pairs = found.feedback.iter().zip(&expected.feedback).take(most);
    let difference = pairs.map(|(a, b)| (a - b).norm() / b.norm());
    difference.fold(0.0, f64::max)
}

/// Plans from the policies of the plan before are those of the solver without them, also where the transfer's own units
/// differ: they halve with its duration.
#[test]
fn plans_by_the_policies_of_the_plan_before_are_those_from_nothing() {
    for set in ["C_i", "C_ii"] {
        let transfer = Case::load(set).transfer(200);
        let (whole, _) = plan(&transfer, Start::Cold);
        for step in [0, 20, 100, 160] {
            for size in [1e-4, 1e-3, 2e-2] {
                let state = shifted(&whole.states[step], size);
                let rest = transfer.remaining(step, state).expect("a transfer");
                let before = whole.remaining(&transfer, step).expect("a plan");
                let (warm, iterations) = plan(&rest, Start::Warm(&before));
                let without = Plan {
                    sweep: Sweep::default(),
                    ..before.clone()
                };
                let (expected, _) = plan(&rest, Start::Warm(&without));
                let what = format!("{set}, {step}, {size}");
                let inherited = warm.feedback == before.feedback;
                assert_eq!(inherited, size < 1e-2 && step <= 50, "{what}");
                assert!(iterations <= 3, "{what}: {iterations}");
                assert_eq!(warm.states[0], state);
                assert!((warm.cost / expected.cost - 1.0).abs() < 1e-10, "{what}");
                let commands = apart(&warm.commands, &expected.commands);
                assert!(commands < 1e-7, "{what}: {commands:e}");
                let multipliers = apart(&warm.multipliers, &expected.multipliers);
                assert!(multipliers < 1e-6, "{what}: {multipliers:e}");
                let gains = gains_apart(&warm, &expected);
                assert!(gains < 0.1, "{what}: {gains}");
                let [found, expected] = [warm.certificate, expected.certificate];
                assert!(found.sufficient && found.stationarity <= 1e-8, "{what}");
                assert!(found.terminal <= 1e-12 && found.defect == 0.0, "{what}");
                let condition = found.condition / expected.condition - 1.0;
                assert!(condition.abs() < 0.05, "{what}: {condition}");
            }
        }
    }
}

/// Gains and convexity are taken over from plan to plan only as long as all plans are near the one that they belong to.
#[test]
fn a_chain_of_plans_finds_new_gains_before_it_has_strayed_too_far() {
    let transfer = Case::load("C_i").transfer(200);
    let (mut last, _) = plan(&transfer, Start::Cold);
    let mut from = transfer;
    let mut inherited = 0;
    for _ in 0..8 {
        let state = shifted(&last.states[10], 1e-3);
        let rest = from.remaining(10, state).expect("a transfer");
        let before = last.remaining(&from, 10).expect("a plan");
        let (next, _) = plan(&rest, Start::Warm(&before));
        let (cold, _) = plan(&rest, Start::Cold);
        assert!((next.cost / cold.cost - 1.0).abs() < 1e-10);
        let gains = gains_apart(&next, &cold);
        assert!(gains < 0.1, "{gains}");
        inherited += u32::from(next.feedback == before.feedback);
        (from, last) = (rest, next);
    }
    assert!((3..8).contains(&inherited), "{inherited}");
}

/// Policies of another problem are not used, and the plan is that of the transfer.
#[test]
fn the_plan_of_another_transfer_is_no_more_than_a_guess() {
    let case = Case::load("C_i");
    let transfer = case.transfer(100);
    let (first, _) = plan(&transfer, Start::Cold);
    let lgvi = case.transfer(100).with_dynamics(Dynamics::Lgvi);
    for other in [lgvi, case.with_axial(100, Some(0.0095))] {
        let (warm, _) = plan(&other, Start::Warm(&first));
        let (cold, _) = plan(&other, Start::Cold);
        assert!((warm.cost / cold.cost - 1.0).abs() < 1e-10);
        assert!(apart(&warm.commands, &cold.commands) < 1e-7);
        assert!(warm.feedback != first.feedback);
    }
}
