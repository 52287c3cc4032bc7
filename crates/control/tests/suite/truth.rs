//! Both maneuvers of §4.7 compared with reference solutions of independent solvers.

use lgvi_control::shooting;
use lgvi_control::shooting::ExtremalError;
use lgvi_control::shooting::{Settings, ShootingError};
use nalgebra::SVector;

use crate::case::Case;

const SETS: [&str; 5] = ["C_i", "C_ii", "Q_i", "B_i", "B_ii"];

#[test]
fn cold_starts_reach_the_reference_costs_and_multipliers() {
    for set in SETS {
        let case = Case::load(set);
        for reference in case.references() {
            let transfer = case.transfer(reference.n);
            let found =
                shooting::solve(&transfer, SVector::zeros(), &Settings::default(), |_| true)
                    .unwrap_or_else(|error| panic!("{set}, N = {}: {error}", reference.n));
            let cost = (found.extremal.cost / reference.cost - 1.0).abs();
            let multipliers =
                (found.multipliers - reference.lambda0).norm() / reference.lambda0.norm();
            println!(
                "{set} N = {}: {} iterations, {} trials, violation {:.1e}, cost {cost:.1e}, λ {multipliers:.1e}",
                reference.n, found.last.iteration, found.last.trials, found.last.violation
            );
            assert!(found.last.violation <= 1e-12);
            assert!(
                cost <= 1e-9,
                "{set}, N = {}: cost {}",
                reference.n,
                found.extremal.cost
            );
            assert!(
                multipliers <= 1e-13,
                "{set}, N = {}: {}",
                reference.n,
                found.multipliers
            );
        }
    }
}

#[test]
fn an_observer_can_stop_the_iteration_and_a_cap_ends_it_with_the_last_iterate() {
    let transfer = Case::load("C_i").transfer(100);
    let stopped = shooting::solve(&transfer, SVector::zeros(), &Settings::default(), |now| {
        now.iteration < 3
    });
    assert!(matches!(stopped, Err(ShootingError::Stopped(now)) if now.iteration == 3));

    let settings = Settings {
        max_iterations: 5,
        ..Settings::default()
    };
    let capped = shooting::solve(&transfer, SVector::zeros(), &settings, |_| true);
    match capped {
        Err(ShootingError::MaxIterations { last, tolerance }) => {
            assert_eq!((last.iteration, tolerance), (5, 1e-12));
            assert!(last.violation > 1.0 && last.violation < 2.0);
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_start_that_turns_too_far_is_an_error_with_its_step() {
    let transfer = Case::load("C_i").transfer(100);
    let wild = SVector::from_element(1e3);
    match shooting::solve(&transfer, wild, &Settings::default(), |_| true) {
        Err(ShootingError::Start(ExtremalError::Unsolvable { step, source })) => {
            assert!(step > 0 && source.turn > 1.0);
        }
        other => panic!("{other:?}"),
    }
}
