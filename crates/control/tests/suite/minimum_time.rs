//! Minimum times compared with exact laws, published values and IPOPT.

use std::f64::consts::PI;

use lgvi_control::constraint::{CommandLimit, ComponentLimit, KeepOutCone, NormLimit, Place};
use lgvi_control::{
    Actuation, Chances, Constraint, Dynamics, FinalTimeError, MinimumTime, Motion, NewtonSettings,
    PlanError, SearchSettings, Start, TimeRange, Transfer, Uncertainty, search_minimum_time,
    solve_minimum_time,
};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;

const RANGE: TimeRange = TimeRange {
    shortest: 0.1,
    longest: 100.0,
    tolerance: 1e-6,
};

fn at_rest(x: f64, turn: Vector3<f64>) -> BodyState {
    BodyState {
        position: Vector3::new(x, 0.0, 0.0),
        linear_momentum: Vector3::zeros(),
        attitude: lgvi_lie::exp(&turn),
        angular_momentum: Vector3::zeros(),
    }
}

fn loads() -> Actuation {
    let identity = Matrix3::identity();
    Actuation::full(&identity, &identity).expect("weights")
}

fn transfer(
    inertia: [f64; 3],
    mass: f64,
    (n, duration): (usize, f64),
    target: BodyState,
    actuation: Actuation,
) -> Transfer {
    let inertia = Inertia::principal(inertia).expect("inertia");
    let body = RigidBody::new(mass, inertia, Vec::new()).expect("a body");
    let field = Central { gm: 0.0 };
    let start = at_rest(1.0, Vector3::zeros());
    Transfer::new(
        body,
        field,
        duration / n as f64,
        n,
        start,
        target,
        actuation,
    )
    .expect("a transfer")
    .with_dynamics(Dynamics::Lgvi)
}

/// A mass of 2 moves by 3.
fn line(n: usize, duration: f64) -> Transfer {
    transfer(
        [1.0; 3],
        2.0,
        (n, duration),
        at_rest(4.0, Vector3::zeros()),
        loads(),
    )
    .with_motion(Motion::Translation)
}

/// At most a force of 1.5: `T = 2 √(d m/f) = 4`.
fn line_under_norm(n: usize, duration: f64) -> Transfer {
    line(n, duration).with_constraints(&[norm(Place::Position, 1.5)])
}

fn norm(place: Place, limit: f64) -> Constraint {
    Constraint::commands(NormLimit::new(place, limit).expect("a limit"))
}

fn components(place: Place, limits: [f64; 3]) -> Constraint {
    Constraint::commands(ComponentLimit::new(place, limits.into()).expect("limits"))
}

fn turn(
    inertia: [f64; 3],
    n: usize,
    duration: f64,
    by: Vector3<f64>,
    limit: Constraint,
) -> Transfer {
    transfer(inertia, 1.0, (n, duration), at_rest(1.0, by), loads())
        .with_motion(Motion::Rotation)
        .with_constraints(&[limit])
}

fn fastest(transfer: &Transfer, range: &TimeRange) -> MinimumTime {
    let settings = NewtonSettings::default();
    let found = solve_minimum_time(transfer, range, Start::Cold, &settings, |_| true);
    let found = found.expect("a plan");
    println!(
        "{} in {}, {:?}: {:?}",
        found.final_time, found.solves, found.not_found, found.plan
    );
    let certificate = &found.plan.certificate;
    assert!(certificate.terminal < 1e-11 && certificate.inequality < 1e-9);
    assert!(found.lower_bound <= found.final_time);
    assert!((found.plan.h * transfer.intervals() as f64 / found.final_time - 1.0).abs() < 1e-14);
    found
}

fn refusal(transfer: &Transfer, range: &TimeRange) -> FinalTimeError {
    let settings = NewtonSettings::default();
    solve_minimum_time(transfer, range, Start::Cold, &settings, |_| true).expect_err("refused")
}

/// A force at its limit in steps of the same length: `d = (f/m) h² N²/4`, as in continuous time.
#[test]
fn a_straight_way_takes_the_time_of_the_double_integrator() {
    for duration in [4.5, 40.0, 1.0] {
        let found = fastest(&line_under_norm(40, duration), &RANGE);
        assert!(
            (4.0 - 1e-9..4.0 + 5e-6).contains(&found.final_time),
            "{}",
            found.final_time
        );
        // The bound is below the exact value, and closes the bracket.
        assert!(found.lower_bound < 4.0 + 1e-9 && found.lower_bound > 4.0 - 5e-6);
        let inner = found
            .plan
            .controls
            .iter()
            .filter(|u| u.force.norm() < 1.5 * 0.99);
        assert!(inner.count() <= 2);
    }
}

/// The switch falls into a step: `d = (f/m) h² (N² − 1)/4`.
#[test]
fn an_odd_number_of_steps_takes_a_little_longer_by_the_square_of_the_step() {
    for n in [11, 41, 81] {
        let found = fastest(&line_under_norm(n, 5.0), &RANGE);
        let steps = n as f64;
        let exact = 4.0 * steps / (steps * steps - 1.0).sqrt();
        assert!(
            (found.final_time / exact - 1.0).abs() < 2e-6,
            "{} for {exact}",
            found.final_time
        );
        let bound = found.lower_bound;
        assert!(
            bound < exact * (1.0 + 1e-9) && bound > exact * (1.0 - 2e-6),
            "{bound}"
        );
    }
}

/// Accelerations `a` and `b` to both sides: `T² = 2 d (1/a + 1/b)`.
#[test]
fn thrusters_that_push_to_one_side_brake_in_turn() {
    let column = |x: f64| ([x, 0.0, 0.0, 0.0, 0.0, 0.0], 1.0);
    let pair = Actuation::actuators(&[column(1.0), column(-1.0)]).expect("two actuators");
    let limit = CommandLimit::new(&[3.0, 1.0]).expect("limits").one_sided();
    let end = at_rest(4.0, Vector3::zeros());
    let transfer = transfer([1.0; 3], 2.0, (60, 7.0), end, pair)
        .with_motion(Motion::Translation)
        .with_constraints(&[Constraint::commands(limit)]);
    let found = fastest(&transfer, &RANGE);
    let exact = (2.0 * 3.0 * (2.0 / 3.0 + 2.0 / 1.0_f64)).sqrt();
    println!("{} for {exact}", found.final_time);
    // Near the shortest time the solver loses plans in which opposite thrusters hardly fire together.
    assert!((exact * (1.0 - 1e-9)..1.004 * exact).contains(&found.final_time));
    assert!(found.lower_bound < exact);
}

/// With the norm of the moment limited, a symmetric body turns fastest about one axis: `T = 2 √(θ J/M)`. The turn in a step of
/// the LGVI has `J sin φ = h P`, with the momentum `P = M h (k − ½)` in step `k` of the first half.
#[test]
fn a_limited_norm_of_the_moment_turns_a_symmetric_body_about_one_axis() {
    let (inertia, moment, angle) = (2.0, 0.8, 2.4_f64);
    let axis = Vector3::new(2.0, -1.0, 2.0) / 3.0;
    let continuous = 2.0 * (angle * inertia / moment).sqrt();
    let mut errors = Vec::new();
    for n in [20, 40, 80] {
        let turned = |final_time: f64| -> f64 {
            let h = final_time / n as f64;
            let steps = (1..=n / 2).map(|k| k as f64 - 0.5);
            2.0 * steps
                .map(|k| (moment * h * h * k / inertia).asin())
                .sum::<f64>()
        };
        let [mut low, mut high] = [0.9 * continuous, continuous];
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            *if turned(middle) < angle {
                &mut low
            } else {
                &mut high
            } = middle;
        }
        let transfer = turn(
            [inertia; 3],
            n,
            7.0,
            angle * axis,
            norm(Place::Attitude, moment),
        );
        let found = fastest(&transfer, &RANGE);
        assert!(
            (found.final_time / high - 1.0).abs() < 2e-6,
            "{} for {high}",
            found.final_time
        );
        assert!(found.plan.certificate.sufficient);
        errors.push(continuous - found.final_time);
    }
    let orders = errors.windows(2).map(|pair| (pair[0] / pair[1]).log2());
    for order in orders {
        assert!((order - 2.0).abs() < 0.05, "{order}: {errors:?}");
    }
}

/// Bilimoria and Wie, JGCD 16 (1993): 180° about an axis of a symmetric body under limits of each component take 3.2430, less
/// than 2 √π = 3.5449 about the axis.
#[test]
fn a_symmetric_body_reorients_faster_than_about_the_axis() {
    let limit = components(Place::Attitude, [1.0; 3]);
    let half = turn([1.0; 3], 50, 4.0, PI * Vector3::z(), limit.clone());
    let range = TimeRange {
        tolerance: 1e-5,
        ..RANGE
    };
    let plain = fastest(&half, &range);
    assert!(
        (plain.final_time - 2.0 * PI.sqrt()).abs() < 4e-3,
        "{}",
        plain.final_time
    );
    // The turn about the axis is no minimum, and nothing proves that it takes the least time.
    assert!(!plain.plan.certificate.sufficient);
    assert!(plain.lower_bound < 0.99 * plain.final_time);

    let fine = turn([1.0; 3], 100, 4.0, PI * Vector3::z(), limit);
    let settings = SearchSettings {
        starts: 16,
        ..SearchSettings::default()
    };
    let found = search_minimum_time(&fine, &range, &settings, |_| true).expect("a plan");
    println!(
        "{} above {}: {:?}",
        found.final_time, found.lower_bound, found.plan
    );
    assert!(
        (found.final_time - 3.2430).abs() < 1e-3,
        "{}",
        found.final_time
    );
    assert!(found.final_time - found.lower_bound < 3e-4);
    assert!(found.plan.certificate.sufficient);
    // Six terminal conditions and the final time leave at most six commands between their limits, and the tolerance a few.
    let commands = found
        .plan
        .controls
        .iter()
        .flat_map(|u| u.moment.iter().copied().collect::<Vec<_>>());
    let inner = commands.filter(|u| u.abs() < 0.99).count();
    assert!(inner <= 8, "{inner}");
}

/// The shortest time in `n` steps by IPOPT, and the transfer.
fn of_ipopt(name: &str, n: usize) -> (f64, Transfer) {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/truth/minimum_time.json"
    );
    let all: Value = serde_json::from_str(&std::fs::read_to_string(path).expect(path)).expect(path);
    let mut cases = all["cases"].as_array().expect("cases").iter();
    let case = cases.find(|case| case["name"] == name).expect(name);
    let vector = |value: &Value| Vector3::from_fn(|i, _| value[i].as_f64().expect("a number"));
    let limit = {
        let limit = case["limit"].as_array().expect("limits");
        Vector3::from_fn(|i, _| limit[i.min(limit.len() - 1)].as_f64().expect("a limit"))
    };
    let limit = match case["kind"].as_str() {
        Some("moment_norm") => norm(Place::Attitude, limit.x),
        _ => components(Place::Attitude, limit.into()),
    };
    let time = case["times"][n.to_string()].as_f64().expect("a time");
    let inertia = vector(&case["inertia"]).into();
    (
        time,
        turn(inertia, n, 1.3 * time, vector(&case["turn"]), limit),
    )
}

/// The relative difference between the shortest time of a search and that of IPOPT.
fn apart(name: &str, n: usize) -> f64 {
    let (time, transfer) = of_ipopt(name, n);
    let settings = SearchSettings {
        starts: 20,
        ..SearchSettings::default()
    };
    let found = search_minimum_time(&transfer, &RANGE, &settings, |_| true).expect("a plan");
    let apart = found.final_time / time - 1.0;
    println!(
        "{name} in {n}: {} above {}, {apart:.1e}",
        found.final_time, found.lower_bound
    );
    apart.abs()
}

#[test]
fn symmetric_bodies_turn_as_fast_as_by_ipopt() {
    assert!(apart("symmetric, 180 degrees", 50) < 2e-6);
    assert!(apart("symmetric, 90 degrees", 50) < 2e-6);
}

#[test]
fn asymmetric_bodies_turn_as_fast_as_by_ipopt() {
    assert!(apart("asymmetric, 150 degrees", 50) < 2e-6);
    assert!(apart("asymmetric under a norm", 50) < 2e-6);
}

/// Betts, Practical Methods for Optimal Control (2010), §6.8: 28.6304077 in continuous time.
#[test]
fn the_published_time_of_an_asymmetric_body_is_approached_by_the_square_of_the_step() {
    assert!(apart("asymmetric, 150 degrees", 100) < 2e-6);
    let errors = [50, 100].map(|n| 28.630_407_7 - of_ipopt("asymmetric, 150 degrees", n).0);
    let order = (errors[0] / errors[1]).log2();
    assert!(errors[1] < 2e-3 && (order - 2.0).abs() < 0.1, "{errors:?}");
}

#[test]
fn a_range_that_ends_too_early_or_begins_too_late_is_said() {
    let early = TimeRange {
        longest: 3.9,
        ..RANGE
    };
    let error = refusal(&line_under_norm(40, 3.0), &early);
    assert!(
        matches!(&error, FinalTimeError::Unreached { longest, source }
            if *longest == 3.9 && matches!(**source, PlanError::NotFound { .. })),
        "{error}"
    );
    let late = TimeRange {
        shortest: 4.2,
        ..RANGE
    };
    let found = fastest(&line_under_norm(40, 6.0), &late);
    assert_eq!((found.final_time, found.not_found), (4.2, None));
    assert!(found.lower_bound < 4.0);
}

#[test]
fn what_has_no_minimum_and_no_range_is_refused() {
    let error = refusal(&line(40, 6.0), &RANGE);
    assert!(
        matches!(error, FinalTimeError::Unlimited { command: 0 }),
        "{error}"
    );
    let open = components(Place::Position, [1.0, 1.0, f64::INFINITY]);
    let error = refusal(&line(40, 6.0).with_constraints(&[open]), &RANGE);
    assert!(
        matches!(error, FinalTimeError::Unlimited { command: 2 }),
        "{error}"
    );
    for (shortest, longest) in [(0.0, 1.0), (2.0, 1.0), (1.0, f64::NAN)] {
        let range = TimeRange {
            shortest,
            longest,
            ..RANGE
        };
        let error = refusal(&line_under_norm(40, 6.0), &range);
        assert!(matches!(error, FinalTimeError::Range { .. }), "{error}");
    }
    for tolerance in [0.0, f64::NAN, -1.0] {
        let error = refusal(&line_under_norm(40, 6.0), &TimeRange { tolerance, ..RANGE });
        assert!(matches!(error, FinalTimeError::Value { .. }), "{error}");
    }
}

#[test]
fn whoever_stops_it_gets_the_fastest_plan_so_far() {
    // Nothing proves that this one is the fastest, so that faster ones are looked for once it is found.
    let limit = components(Place::Attitude, [1.0; 3]);
    let transfer = turn([1.0; 3], 40, 8.0, PI * Vector3::z(), limit);
    let settings = NewtonSettings::default();
    let mut all = 0;
    let count = |_: &_| {
        all += 1;
        true
    };
    solve_minimum_time(&transfer, &RANGE, Start::Cold, &settings, count).expect("a plan");
    let mut seen = 0;
    let watch = |_: &_| {
        seen += 1;
        seen < all
    };
    let error =
        solve_minimum_time(&transfer, &RANGE, Start::Cold, &settings, watch).expect_err("stopped");
    let FinalTimeError::Plan { final_time, source } = error else {
        panic!("{error}");
    };
    let PlanError::Stopped { best: Some(best) } = *source else {
        panic!("{source}");
    };
    assert!((best.h * 40.0 - final_time).abs() < 1e-12 && final_time < 8.0);
    assert!(best.certificate.terminal < 1e-11);
}

/// A cone that the shortest turn crosses makes it longer, and holds between the ends of steps too.
#[test]
fn a_cone_in_the_way_takes_time() {
    let by = 1.5 * Vector3::z();
    let limit = norm(Place::Attitude, 1.0);
    let free = turn([1.0; 3], 24, 4.0, by, limit.clone());
    let direction = Vector3::new(0.75_f64.cos(), 0.75_f64.sin(), 0.1);
    let cone = KeepOutCone::new(Vector3::x(), direction, 0.3).expect("a cone");
    let around = free
        .clone()
        .with_constraints(&[limit, Constraint::state(cone)]);
    let range = TimeRange {
        tolerance: 1e-4,
        ..RANGE
    };
    let settings = NewtonSettings::default();
    let found = solve_minimum_time(&around, &range, Start::Cold, &settings, |_| true);
    let found = found.expect("a plan");
    let direct = fastest(&free, &range);
    println!("{found:?}");
    assert!(found.final_time > 1.01 * direct.final_time);
    assert!(found.plan.certificate.terminal < 1e-11);
    assert!(found.plan.certificate.inequality <= 1e-7);
}

#[test]
fn fuel_probabilities_and_prices_have_no_minimum_time() {
    let limit = norm(Place::Position, 1.5);
    let limits = std::slice::from_ref(&limit);
    let fuel = loads().minimizing_fuel(limits).expect("fuel");
    let end = at_rest(4.0, Vector3::zeros());
    let fuel = transfer([1.0; 3], 2.0, (40, 6.0), end, fuel)
        .with_motion(Motion::Translation)
        .with_constraints(limits);
    let chances = Chances::new(Uncertainty::default(), 0.99).expect("a probability");
    let chances = line_under_norm(40, 6.0).with_chances(chances);
    let soft = norm(Place::Position, 1.0).priced(2.0).expect("a price");
    let priced = line(40, 6.0).with_constraints(&[limit.clone(), soft.clone()]);
    for (transfer, word) in [(fuel, "fuel"), (chances, "probability"), (priced, "price")] {
        let error = refusal(&transfer, &RANGE);
        assert!(
            matches!(error, FinalTimeError::Beside { beside } if beside.contains(word)),
            "{error}"
        );
    }
    // What has a price limits nothing.
    let soft = line(40, 6.0).with_constraints(&[soft]);
    assert_eq!(soft.unlimited_command(), Some(0));
    assert_eq!(line_under_norm(40, 6.0).unlimited_command(), None);
}
