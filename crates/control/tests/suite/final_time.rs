//! Free final times compared with reference solutions, and the derivative used to find them.

use lgvi_control::constraint::{NormLimit, Place};
use lgvi_control::{
    Actuation, Constraint, Dynamics, FinalTime, FinalTimeError, Motion, NewtonSettings,
    SearchSettings, Start, TimeOptimality, TimedPlan, Transfer, search, solve, solve_final_time,
};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use nalgebra::{Matrix3, Vector3};

use crate::case::Case;

fn settings() -> NewtonSettings {
    NewtonSettings {
        stationarity: 1e-11,
        ..NewtonSettings::default()
    }
}

fn between(shortest: f64, longest: f64) -> FinalTime {
    FinalTime {
        shortest,
        longest,
        weight: 0.0,
        tolerance: 1e-11,
    }
}

fn transfer(n: usize, duration: f64) -> Transfer {
    let transfer = Case::load("B_i").transfer(n);
    transfer.with_final_time(duration).expect("a time")
}

fn free(n: usize, duration: f64, time: &FinalTime) -> TimedPlan {
    let transfer = transfer(n, duration);
    solve_final_time(&transfer, time, Start::Cold, &settings(), |_| true).expect("a plan")
}

#[test]
fn free_final_times_are_those_of_the_references() {
    for (n, final_time, cost) in Case::free_final_times() {
        // Other local minima exist; the reference continues the best plan of set B.
        let set = Case::load("B_i").transfer(n);
        let minima = search(&set, &SearchSettings::default(), |_| true).expect("minima");
        let plan = &minima[0].plan;
        for start in [2.4, 3.1, 2.2] {
            let (from, time) = (transfer(n, start), between(1.0, 5.0));
            let found = solve_final_time(&from, &time, Start::Warm(plan), &settings(), |_| true)
                .expect("a plan");
            println!(
                "N = {n} from {start}: T {:.1e}, J {:.1e}, {} transfers",
                found.final_time - final_time,
                found.plan.cost - cost,
                found.solves
            );
            assert_eq!(found.optimality, TimeOptimality::Stationary);
            assert!((found.final_time - final_time).abs() < 1e-9);
            assert!((found.plan.cost - cost).abs() < 1e-9);
            assert!((found.plan.h * n as f64 - final_time).abs() < 1e-9);
            assert!(found.solves <= 12, "{}", found.solves);
        }
    }
}

/// The slope at a bound is the derivative of the cost, by central differences of sixth order.
#[test]
fn the_slope_is_the_derivative_of_the_cost_by_time_in_all_classes() {
    for motion in [Motion::Full, Motion::Translation, Motion::Rotation] {
        for dynamics in [Dynamics::LieEuler, Dynamics::Lgvi] {
            let duration = 1.2;
            let at = |duration: f64| {
                transfer(60, duration)
                    .with_motion(motion)
                    .with_dynamics(dynamics)
            };
            let cost = |duration: f64| {
                let plan = solve(&at(duration), Start::Cold, &settings(), |_| true);
                plan.expect("a plan").cost
            };
            let step = 1e-2;
            let pair = |times: f64| cost(duration + times * step) - cost(duration - times * step);
            let difference = (45.0 * pair(1.0) - 9.0 * pair(2.0) + pair(3.0)) / (60.0 * step);
            let bounds = between(duration, duration);
            let found =
                solve_final_time(&at(duration), &bounds, Start::Cold, &settings(), |_| true)
                    .expect("a plan");
            let error = (found.slope / difference - 1.0).abs();
            println!(
                "{motion:?}, {dynamics:?}: {} differs by {error:.1e}",
                found.slope
            );
            assert!(error < 1e-8, "{} for {difference}", found.slope);
        }
    }
}

/// A force limit that is active most of the way does not depend on the step size either.
#[test]
fn the_slope_is_the_derivative_of_the_cost_under_inequalities() {
    let free = solve(&transfer(60, 1.2), Start::Cold, &settings(), |_| true).expect("a plan");
    let forces = free.controls.iter().map(|control| control.force.norm());
    let limit = 0.8 * forces.fold(0.0, f64::max);
    let at = |duration: f64| {
        let limit = NormLimit::new(Place::Position, limit).expect("a limit");
        transfer(60, duration).with_constraints(&[Constraint::commands(limit)])
    };
    let plan = |duration: f64| {
        let plan = solve(&at(duration), Start::Cold, &settings(), |_| true);
        plan.expect("a plan")
    };
    assert!(plan(1.2).cost > 1.001 * free.cost);
    // The second derivative jumps where the limit becomes active at another step, hence the small difference step.
    let step = 5e-5;
    let difference = (plan(1.2 + step).cost - plan(1.2 - step).cost) / (2.0 * step);
    let bounds = between(1.2, 1.2);
    let found = solve_final_time(&at(1.2), &bounds, Start::Cold, &settings(), |_| true);
    let slope = found.expect("a plan").slope;
    let error = (slope / difference - 1.0).abs();
    println!("{slope} for {difference}: {error:.1e}");
    assert!(error < 1e-5, "{slope} for {difference}");
}

#[test]
fn bounds_that_hold_the_time_back_are_named() {
    let longest = free(60, 1.6, &between(1.0, 2.0));
    assert_eq!(longest.optimality, TimeOptimality::Longest);
    assert!(longest.final_time == 2.0 && longest.slope < 0.0);
    let shortest = free(60, 3.4, &between(3.2, 4.0));
    assert_eq!(shortest.optimality, TimeOptimality::Shortest);
    assert!(shortest.final_time == 3.2 && shortest.slope > 0.0);
}

#[test]
fn time_that_costs_is_saved() {
    let free_of_cost = free(60, 2.2, &between(1.0, 5.0));
    let dear = free(
        60,
        2.2,
        &FinalTime {
            weight: 1.0,
            ..between(1.0, 5.0)
        },
    );
    assert_eq!(dear.optimality, TimeOptimality::Stationary);
    assert!(dear.final_time < 0.9 * free_of_cost.final_time);
    assert!(dear.plan.cost + dear.final_time < free_of_cost.plan.cost + free_of_cost.final_time);
}

/// A unit mass moves a unit of length with at most a unit of force: no plan exists for less than 2 units of time.
#[test]
fn durations_without_a_feasible_plan_are_left_for_longer_ones() {
    let rest = |x: f64| BodyState {
        position: Vector3::new(x, 0.0, 0.0),
        linear_momentum: Vector3::zeros(),
        attitude: Matrix3::identity(),
        angular_momentum: Vector3::zeros(),
    };
    let inertia = Inertia::principal([1.0; 3]).expect("inertia");
    let body = RigidBody::new(1.0, inertia, Vec::new()).expect("a body");
    let identity = Matrix3::identity();
    let actuation = Actuation::full(&identity, &identity).expect("weights");
    let field = Central { gm: 0.0 };
    let transfer = Transfer::new(body, field, 0.0575, 40, rest(1.0), rest(2.0), actuation)
        .expect("a transfer")
        .with_constraints(&[Constraint::commands(
            NormLimit::new(Place::Position, 1.0).expect("a limit"),
        )])
        .with_motion(Motion::Translation);
    let time = FinalTime {
        weight: 3.0,
        tolerance: 1e-6,
        ..between(1.0, 4.0)
    };
    let settings = NewtonSettings::default();
    let found = solve_final_time(&transfer, &time, Start::Cold, &settings, |_| true);
    let found = found.expect("a plan");
    assert_eq!(found.optimality, TimeOptimality::Stationary);
    assert!(
        (2.0..2.2).contains(&found.final_time),
        "{}",
        found.final_time
    );
}

#[test]
fn what_is_no_range_and_no_tolerance_is_refused() {
    let transfer = Case::load("B_i").transfer(60);
    let refused = |time: FinalTime| {
        solve_final_time(&transfer, &time, Start::Cold, &settings(), |_| true).expect_err("refused")
    };
    for (shortest, longest) in [
        (0.0, 1.0),
        (2.0, 1.0),
        (1.0, f64::INFINITY),
        (f64::NAN, 1.0),
    ] {
        let error = refused(between(shortest, longest));
        assert!(matches!(error, FinalTimeError::Range { .. }), "{error}");
    }
    for tolerance in [0.0, f64::NAN] {
        let error = refused(FinalTime {
            tolerance,
            ..between(1.0, 2.0)
        });
        assert!(matches!(error, FinalTimeError::Value { .. }), "{error}");
    }
}
