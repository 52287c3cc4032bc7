//! Random maneuvers from a cold start.

use lgvi_control::{NewtonSettings, Start, certified, shooting, solve};
use lgvi_truth::maneuvers::{Class, SEED, Varied, maneuver, varied};
use nalgebra::SVector;

/// At least 99 % of 1000 maneuvers are solved (`lgvi_bench maneuvers`). Of the first 60 at most one fails, while plain
/// shooting solves far fewer.
#[test]
fn random_maneuvers_are_solved_from_nothing() {
    const COUNT: u64 = 60;
    let mut failed = Vec::new();
    let mut shot = 0;
    for index in 0..COUNT {
        let maneuver = maneuver(SEED, index).expect("a maneuver");
        let settings = NewtonSettings::default();
        match solve(&maneuver.transfer, Start::Cold, &settings, |_| true) {
            Ok(plan) => {
                let found = plan.certificate;
                assert!(found.terminal <= 1e-11 && found.defect <= 1e-11, "{index}");
                assert!(found.stationarity <= 1e-6, "{index}: {found:?}");
            }
            Err(error) => failed.push((index, error.to_string())),
        }
        // Few iterations, because shooting is slow where it fails.
        let settings = shooting::Settings {
            max_iterations: 40,
            ..shooting::Settings::default()
        };
        let zero = SVector::zeros();
        let shooting = shooting::solve(&maneuver.transfer, zero, &settings, |_| true);
        shot += u32::from(maneuver.class == Class::OrbitToOrbit && shooting.is_ok());
    }
    assert!(failed.len() <= 1, "{failed:?}");
    assert!(shot < 15, "shooting solves {shot} of 30 in orbit");
}

/// None of them is solved from a smooth path between both ends.
#[test]
fn transfers_over_revolutions_are_solved_by_way_of_the_free_flight() {
    for index in [325, 463, 512] {
        let transfer = varied(SEED, index, 100).expect("a maneuver").transfer;
        let plan = solve(&transfer, Start::Cold, &NewtonSettings::default(), |_| true);
        let found = plan.expect("a plan").certificate;
        assert!(found.terminal <= 1e-11 && found.stationarity <= 1e-6);
        assert!(found.sufficient, "{index}");
    }
}

/// Imposed at once, they lead to commands that cannot be flown, which was once taken for a stop by the observer.
#[test]
fn inequalities_that_cannot_be_imposed_at_once_are_imposed_little_by_little() {
    let Varied {
        transfer,
        constraints,
        ..
    } = varied(SEED, 448, 100).expect("a maneuver");
    assert_eq!(constraints.len(), 1);
    let plan = solve(&transfer, Start::Cold, &NewtonSettings::default(), |_| true);
    let plan = plan.expect("a plan");
    assert!(plan.certificate.sufficient && plan.certificate.inequality <= 1e-9);
    let shown = format!("{plan:?}");
    assert!(shown.len() < 1000, "{shown}");
}

/// Shooting converges to a saddle here.
#[test]
fn an_extremal_that_is_no_minimum_is_left_for_a_cheaper_one() {
    let transfer = maneuver(SEED, 38).expect("a maneuver").transfer;
    let zero = SVector::zeros();
    let shot = shooting::solve(&transfer, zero, &shooting::Settings::default(), |_| true)
        .expect("a saddle");
    let saddle = certified(&transfer, &shot.extremal).expect("a plan");
    assert!(saddle.certificate.stationarity < 1e-8 && !saddle.certificate.sufficient);
    let settings = NewtonSettings::default();
    let lower = solve(&transfer, Start::Warm(&saddle), &settings, |_| true).expect("a plan");
    assert!(lower.certificate.sufficient && lower.cost < 0.99 * saddle.cost);
}
