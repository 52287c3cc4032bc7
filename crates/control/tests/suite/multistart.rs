//! Local minima of an inclination change.

use lgvi_control::constraint::KeepOutCone;
use lgvi_control::{
    Actuation, Constraint, Dynamics, Minimum, Motion, NewtonSettings, PlanError, SearchSettings,
    Start, Transfer, search, shooting, solve,
};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use lgvi_truth::maneuvers::{SEED, varied};
use nalgebra::{Matrix3, Vector3};

use crate::case::Case;

fn transfer() -> Transfer {
    let transfer = Case::load("C_i").transfer(100);
    transfer.with_final_time(0.9046).expect("a time")
}

fn minima(settings: &SearchSettings) -> Vec<Minimum> {
    search(&transfer(), settings, |_| true).expect("minima")
}

/// Costs found by another solver.
const KNOWN: [f64; 4] = [12.9478, 12.9611, 13.0054, 13.0373];

#[test]
fn the_minima_that_are_known_are_found_and_ranked() {
    let found = minima(&SearchSettings::default());
    for minimum in &found {
        let Minimum {
            plan,
            winding,
            starts,
        } = minimum;
        let [x, y, z] = winding.rotation.into();
        println!(
            "{:.4} from {starts} starts, ∫Ω dt ({x:.2}, {y:.2}, {z:.2}), ∫|Ω| dt {:.2}",
            plan.cost, winding.angle
        );
        assert!(plan.certificate.sufficient);
        assert!(plan.certificate.terminal <= 1e-12);
    }
    for cost in KNOWN {
        let same = |minimum: &&Minimum| (minimum.plan.cost - cost).abs() <= 5e-5;
        assert_eq!(found.iter().filter(same).count(), 1, "{cost}");
    }
    for pair in found.windows(2) {
        assert!(pair[0].plan.cost < pair[1].plan.cost);
        let apart = pair[0].winding.rotation - pair[1].winding.rotation;
        assert!(apart.norm() > 0.1);
    }
}

/// Shooting integrates the necessary conditions forward and confirms each minimum from its multipliers.
#[test]
fn minima_are_extremals() {
    let transfer = transfer();
    for Minimum { plan, .. } in minima(&SearchSettings::default()).iter().take(5) {
        let multipliers = plan.multipliers[0];
        let found = shooting::solve(
            &transfer,
            multipliers,
            &shooting::Settings::default(),
            |_| true,
        )
        .expect("an extremal");
        let moved = (found.multipliers - multipliers).norm() / multipliers.norm();
        assert!(found.last.iteration <= 3 && moved < 1e-6, "{moved:e}");
        assert!((found.extremal.cost / plan.cost - 1.0).abs() < 1e-9);
    }
}

#[test]
fn a_search_is_a_function_of_its_seed_and_of_nothing_else() {
    let few = |seed| {
        let settings = SearchSettings {
            starts: 20,
            seed,
            ..SearchSettings::default()
        };
        let minima = minima(&settings);
        minima.iter().map(|m| m.plan.cost).collect::<Vec<_>>()
    };
    assert_eq!(few(3), few(3));
    assert_ne!(few(3), few(4));
}

#[test]
fn a_search_that_is_stopped_returns_what_is_refined_or_says_so() {
    let mut all = 0;
    let whole = search(&transfer(), &SearchSettings::default(), |_| {
        all += 1;
        true
    })
    .expect("minima");
    let stopped = |after: u32| {
        let mut seen = 0;
        let found = search(&transfer(), &SearchSettings::default(), |_| {
            seen += 1;
            seen < after
        });
        assert!(seen <= after + whole.len() as u32);
        found
    };
    // The last iterations may belong to minima that turn out to be known already.
    let some = [5, 10, 20, 40, 80]
        .into_iter()
        .map(|before| stopped(all - before).expect("minima"))
        .find(|some| some.len() < whole.len())
        .expect("fewer minima");
    assert!(!some.is_empty());
    assert!(some[0].plan == whole[0].plan);
    assert!(matches!(stopped(1), Err(PlanError::Stopped { .. })));
    assert_eq!(stopped(30).expect("the first start").len(), 1);
}

#[test]
fn iterations_of_all_solutions_are_counted_through() {
    let count = |starts| {
        let settings = SearchSettings {
            starts,
            ..SearchSettings::default()
        };
        let mut last = 0;
        search(&transfer(), &settings, |now| {
            assert!(now.iteration >= last, "{} after {last}", now.iteration);
            last = now.iteration;
            true
        })
        .expect("minima");
        last
    };
    let (one, three) = (count(1), count(3));
    assert!(three >= one + 2, "{three} and {one}");
}

/// Over few intervals these maneuvers have other minima, or only more expensive ones.
#[test]
fn a_search_is_never_dearer_than_the_plan_without_one() {
    for index in [133, 254, 277] {
        let transfer = varied(SEED, index, 100).expect("a maneuver").transfer;
        let newton = NewtonSettings::default();
        let plan = solve(&transfer, Start::Cold, &newton, |_| true).expect("a plan");
        let settings = SearchSettings {
            starts: 3,
            ..SearchSettings::default()
        };
        let minima = search(&transfer, &settings, |_| true).expect("minima");
        assert!(minima[0].plan.cost <= plan.cost, "{index}");
    }
}

/// A slender body turns through a cone, or the other way round: out of the plane it is too heavy.
#[test]
fn the_cheapest_minimum_pays_for_its_violations() {
    let resting = |angle: f64| BodyState {
        position: Vector3::x(),
        linear_momentum: Vector3::zeros(),
        attitude: lgvi_lie::exp(&(angle * Vector3::z())),
        angular_momentum: Vector3::zeros(),
    };
    let inertia = Inertia::principal([10.0, 10.0, 1.0]).expect("inertia");
    let body = RigidBody::new(1.0, inertia, Vec::new()).expect("a body");
    let weight = Matrix3::identity();
    let actuation = Actuation::full(&weight, &weight).expect("weights");
    let field = Central { gm: 0.0 };
    let [start, end] = [-1.3, 1.3].map(resting);
    let free = Transfer::new(body, field, 0.1, 40, start, end, actuation)
        .expect("a transfer")
        .with_dynamics(Dynamics::Lgvi)
        .with_motion(Motion::Rotation);
    let cone = KeepOutCone::new(Vector3::x(), Vector3::x(), 0.9).expect("a cone");
    let cone = Constraint::state(cone);
    let minima = |price: f64| {
        let cone = cone.clone().priced(price).expect("a price");
        let settings = SearchSettings {
            starts: 12,
            ..SearchSettings::default()
        };
        let found = search(&free.clone().with_constraints(&[cone]), &settings, |_| true);
        let found = found.expect("minima");
        for Minimum { plan, winding, .. } in &found {
            println!(
                "{price}: {} + {}, {:.2} rad",
                plan.cost, plan.paid, winding.angle
            );
        }
        found
    };
    let cheap = minima(0.1);
    assert!(cheap[0].winding.angle < 3.0 && cheap[0].plan.paid > 0.01);
    let dear = minima(2.0);
    assert!(dear[0].winding.angle > 3.0 && dear[0].plan.paid < 1e-6);
    let through = dear.iter().find(|minimum| minimum.winding.angle < 3.0);
    let through = &through.expect("a way through").plan;
    assert!(through.cost < dear[0].plan.cost);
    assert!(through.total_cost() > dear[0].plan.total_cost());
}
