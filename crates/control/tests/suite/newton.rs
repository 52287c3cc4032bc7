//! The structured solver on reference solutions and slender bodies, and its certificate.

use lgvi_control::{NewtonSettings, Phase, Plan, PlanError, Start, Transfer, solve};

use crate::case::Case;

/// Moments of inertia about the dumbbell's axis; the other two are 0.0315.
const AXIAL: [f64; 9] = [
    0.009, 0.007, 0.005, 0.004, 0.003, 0.002, 0.001, 0.0007, 0.0005,
];

fn cold(transfer: &Transfer) -> Plan {
    solve(transfer, Start::Cold, &NewtonSettings::default(), |_| true).expect("a plan")
}

#[test]
fn cold_plans_have_the_reference_costs() {
    for set in ["C_i", "C_ii", "Q_i", "B_i", "B_ii"] {
        let case = Case::load(set);
        for reference in case.references() {
            let plan = cold(&case.transfer(reference.n));
            let cost = (plan.cost / reference.cost - 1.0).abs();
            let lambda =
                (plan.multipliers[0] - reference.lambda0).norm() / reference.lambda0.norm();
            let found = &plan.certificate;
            println!(
                "{set} N = {}: cost {cost:.1e}, λ {lambda:.1e}, {found:?}",
                reference.n
            );
            assert!(cost <= 1e-9, "{set}, N = {}: {}", reference.n, plan.cost);
            assert!(lambda <= 1e-6, "{set}, N = {}: {lambda:e}", reference.n);
            assert!(found.terminal <= 1e-12 && found.defect == 0.0);
            assert!(found.stationarity <= 1e-8 && found.sufficient);
        }
    }
}

#[test]
fn slender_bodies_are_solved_cold() {
    for set in ["C_i", "C_ii"] {
        let case = Case::load(set);
        for axial in AXIAL {
            for n in [100, 1000] {
                let transfer = case.with_axial(n, Some(axial));
                match solve(&transfer, Start::Cold, &NewtonSettings::default(), |_| true) {
                    Ok(plan) => {
                        let found = &plan.certificate;
                        assert!(found.terminal <= 1e-12 && found.stationarity <= 1e-8);
                        assert!(found.sufficient, "{set}, axial inertia {axial}, N = {n}");
                    }
                    Err(error) => panic!("{set}, axial inertia {axial}, N = {n}: {error}"),
                }
            }
        }
    }
}

#[test]
fn time_is_linear_in_the_intervals_and_precision_stays() {
    let case = Case::load("C_i");
    let plan = cold(&case.transfer(20_000));
    assert!(plan.certificate.terminal <= 1e-12 && plan.certificate.stationarity <= 1e-8);
    let steps = |n: usize| {
        let mut stages = 0;
        let observe = |now: &lgvi_control::Progress| {
            stages += usize::from(now.phase == Phase::Fine);
            true
        };
        solve(
            &case.transfer(n),
            Start::Cold,
            &NewtonSettings::default(),
            observe,
        )
        .expect("a plan");
        stages
    };
    assert!(steps(20_000) <= steps(500));
}

/// A warm start from the solution of nearly the same transfer takes few Newton steps.
#[test]
fn warm_starts_take_few_steps() {
    let case = Case::load("C_ii");
    let transfer = case.transfer(200);
    let plan = cold(&transfer);
    let mut iterations = 0;
    let again = solve(
        &transfer,
        Start::Warm(&plan),
        &NewtonSettings::default(),
        |now| {
            iterations = now.iteration;
            true
        },
    )
    .expect("a plan");
    assert!(iterations <= 1 && (again.cost / plan.cost - 1.0).abs() < 1e-12);
}

#[test]
fn an_observer_ends_it_at_once_with_what_there_is() {
    let transfer = Case::load("C_i").transfer(100);
    for last in [0, 2, 7] {
        let mut calls = 0;
        let stopped = solve(&transfer, Start::Cold, &NewtonSettings::default(), |_| {
            calls += 1;
            calls <= last
        });
        assert!(
            matches!(stopped, Err(PlanError::Stopped { best: Some(_) })),
            "{stopped:?}"
        );
        assert_eq!(calls, last + 1);
    }
}

#[test]
fn a_cap_ends_it_with_the_best_iterate() {
    let transfer = Case::load("B_ii").transfer(100);
    let settings = NewtonSettings {
        iterations: 2,
        ..NewtonSettings::default()
    };
    match solve(&transfer, Start::Cold, &settings, |_| true) {
        Err(PlanError::NotConverged {
            best, iterations, ..
        }) => {
            assert!(iterations >= 2);
            let best = best.expect("a flight");
            assert_eq!(best.states.len(), 101);
        }
        other => panic!("{other:?}"),
    }
}

/// A rough plan: its certificate must state its actual errors.
#[test]
fn certificates_see_what_is_wrong() {
    let transfer = Case::load("C_i").transfer(100);
    let mut first = None;
    let settings = NewtonSettings {
        violation: 1.0,
        stationarity: 1.0,
        ..NewtonSettings::default()
    };
    let rough = solve(&transfer, Start::Cold, &settings, |now| {
        first = first.or(Some(now.violation));
        true
    })
    .expect("a rough plan");
    let target = transfer.target().state().expect("a state");
    let end = rough.states.last().expect("an end");
    let terminal = rough.certificate.terminal;
    // All sizes are 1, except for the angular momentum that turns the body by a radian: 0.08, rounded down to 1/16.
    let mut miss = lgvi_control::miss(&target, end);
    miss.fixed_rows_mut::<3>(9).scale_mut(16.0);
    assert!((terminal - miss.norm()).abs() < 1e-15);
    assert!(
        rough.certificate.stationarity > 1e-6,
        "{:?}",
        rough.certificate
    );
}
