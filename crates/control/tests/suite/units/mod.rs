//! Plans do not depend on the units of their maneuver nor on the scale of its weights.

mod families;
mod stated;

use lgvi_control::{Dynamics, NewtonSettings, Plan, PlanError, Start, shooting, solve};

use families::FAMILIES;
use stated::{Factors, Stated, assert_same};

/// The plan and its number of Newton iterations.
fn planned(stated: &Stated) -> (Result<Plan, PlanError>, u32) {
    let mut iterations = 0;
    let settings = NewtonSettings::default();
    let found = solve(&stated.transfer(), Start::Cold, &settings, |now| {
        iterations = now.iteration;
        true
    });
    (found, iterations)
}

/// A random power of two with an exponent of at most `most` in size.
fn power(rng: &mut fastrand::Rng, most: i32) -> f64 {
    f64::from(rng.i32(-most..=most)).exp2()
}

#[test]
fn powers_of_two_of_the_units_and_of_the_weights_change_no_bit() {
    let mut rng = fastrand::Rng::with_seed(4);
    for (family, maneuver) in FAMILIES {
        let mut solved = 0;
        for index in 0..12 {
            let stated = maneuver(&mut rng);
            let (plan, iterations) = planned(&stated);
            let name = format!("{family} {index}");
            for _ in 0..2 {
                let by = Factors {
                    length: power(&mut rng, 20),
                    time: power(&mut rng, 20),
                    mass: power(&mut rng, 20),
                    cost: power(&mut rng, 30),
                };
                let (other, others) = planned(&stated.times(&by));
                assert_eq!(others, iterations, "{name}");
                match (&plan, &other) {
                    (Ok(plan), Ok(other)) => assert_same(plan, other, &by, 0.0, &name),
                    (Err(error), Err(other)) => assert_eq!(error.to_string(), other.to_string()),
                    (plan, other) => panic!("{name}: {plan:?} and {other:?}"),
                }
            }
            solved += u32::from(plan.is_ok());
        }
        assert!(solved >= 11, "{family}: {solved} of 12 are solved");
    }
}

/// In kilometers, in kilometers, hours and tons, with a smaller cost, and in units of the maneuver's own size.
#[test]
fn plans_are_the_same_in_any_units() {
    let mut rng = fastrand::Rng::with_seed(5);
    for (family, maneuver) in FAMILIES {
        for index in 0..6 {
            let stated = maneuver(&mut rng);
            let (plan, iterations) = planned(&stated);
            let name = format!("{family} {index}");
            let Ok(plan) = plan else {
                panic!("{name}: {plan:?}");
            };
            let length = stated.initial.position.norm();
            let kilometers = Factors {
                length: 1e-3,
                ..Factors::NONE
            };
            let tons = Factors {
                length: 1e-3,
                time: 1.0 / 3600.0,
                mass: 1e-3,
                cost: 1e6,
            };
            let cheap = Factors {
                cost: 1e-9,
                ..Factors::NONE
            };
            let own = Factors {
                length: 1.0 / length,
                time: 1.0 / stated.duration,
                mass: 1.0 / stated.mass,
                cost: 1.0,
            };
            for by in [kilometers, tons, cheap, own] {
                let (other, others) = planned(&stated.times(&by));
                let Ok(other) = other else {
                    panic!("{name}, {by:?}: {other:?}");
                };
                // Rounding leads long iterations along other paths.
                assert!(
                    others.abs_diff(iterations) <= 2 + iterations / 4,
                    "{name}: {others} for {iterations}"
                );
                assert_same(&plan, &other, &by, 1e-5, &name);
            }
        }
    }
}

/// Shooting in meters accepts the solutions of Newton's method.
#[test]
fn shooting_reaches_a_low_orbit_in_metres() {
    let mut rng = fastrand::Rng::with_seed(6);
    for _ in 0..5 {
        let stated = Stated {
            dynamics: Dynamics::LieEuler,
            ..families::low_orbit(&mut rng)
        };
        let (plan, _) = planned(&stated);
        let plan = plan.expect("a plan");
        let settings = shooting::Settings::default();
        let start = plan.multipliers[0];
        let found = shooting::solve(&stated.transfer(), start, &settings, |_| true);
        let found = found.expect("a solution");
        assert!(found.last.iteration <= 2, "{}", found.last.iteration);
        assert!((found.extremal.cost / plan.cost - 1.0).abs() < 1e-9);
    }
}
