//! Plans at minimum fuel: against IPOPT on the same discrete problems (`tests/truth/minimum_fuel.json`), closed forms, and in
//! flight.

use fastrand::Rng;
use lgvi_control::constraint::{CommandLimit, ComponentLimit, NormLimit};
use lgvi_control::{
    Actuation, ActuationError, Constraint, Dynamics, Motion, NewtonSettings, Place, Plan,
    PlanError, Progress, Start, Transfer, solve,
};
use lgvi_dynamics::gravity::{Central, Sources};
use lgvi_dynamics::thrusters::Thruster;
use lgvi_dynamics::wheels::{ReactionWheel, Wheels};
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use lgvi_lie::exp;
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;

use crate::thrusters::{actuation, ends, flown, layout, limited, transfer};

pub(crate) fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

pub(crate) fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_fn(|i, _| number(&value[i]))
}

pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .expect("a list")
        .iter()
        .map(number)
        .collect()
}

pub(crate) fn references(name: &str, kind: &str) -> Vec<Value> {
    let path = format!(
        "{}/../../tests/truth/{name}.json",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(&path).expect(&path);
    let all: Value = serde_json::from_str(&text).expect(&path);
    all[kind].as_array().expect("cases").clone()
}

fn planned(transfer: &Transfer) -> Result<Plan, PlanError> {
    solve(transfer, Start::Cold, &NewtonSettings::default(), |_| true)
}

fn forces() -> Actuation {
    Actuation::full(&Matrix3::identity(), &Matrix3::identity()).expect("an actuation")
}

fn force_norm(limit: f64) -> Constraint {
    Constraint::commands(NormLimit::new(Place::Position, limit).expect("a limit"))
}

fn at(body: &RigidBody, position: Vector3<f64>, velocity: Vector3<f64>) -> BodyState {
    let (upright, still) = (Matrix3::identity(), Vector3::zeros());
    BodyState::from_velocities(body, position, velocity, upright, still)
}

fn unit_body() -> RigidBody {
    let inertia = Inertia::principal([1.0, 1.0, 1.0]).expect("inertia");
    RigidBody::new(1.0, inertia, Vec::new()).expect("a body")
}

/// A translation of a unit mass about a center of strength `gm`, between positions and velocities.
fn orbit(
    [start, end]: [[Vector3<f64>; 2]; 2],
    gm: f64,
    duration: f64,
    n: usize,
    limit: f64,
) -> Transfer {
    let body = unit_body();
    let [start, end] = [start, end].map(|[position, velocity]| at(&body, position, velocity));
    let h = duration / n as f64;
    let limit = [force_norm(limit)];
    let actuation = forces().minimizing_fuel(&limit).expect("limits");
    Transfer::new(body, Central { gm }, h, n, start, end, actuation)
        .expect("a transfer")
        .with_dynamics(Dynamics::Lgvi)
        .with_motion(Motion::Translation)
        .with_constraints(&limit)
}

#[test]
fn transfers_of_a_point_cost_what_ipopt_finds() {
    for case in references("minimum_fuel", "orbits") {
        let end = |which: &str| [vector(&case[which][0]), vector(&case[which][1])];
        let n = case["N"].as_u64().expect("N") as usize;
        let [duration, limit, expected] = ["T", "limit", "fuel"].map(|key| number(&case[key]));
        let transfer = orbit([end("start"), end("end")], 1.0, duration, n, limit);
        let plan = planned(&transfer).expect("a plan");
        compare(&case["name"], &plan, expected);
    }
}

#[test]
fn thrusters_of_a_rigid_body_cost_what_ipopt_finds() {
    for case in references("minimum_fuel", "bodies") {
        let inertia = Inertia::principal(vector(&case["inertia"]).into()).expect("inertia");
        let body = RigidBody::new(number(&case["mass"]), inertia, Vec::new()).expect("a body");
        let places = case["positions"].as_array().expect("positions").iter();
        let ways = case["directions"].as_array().expect("directions").iter();
        let thruster = |(place, way)| Thruster::new(vector(place), vector(way), 1.0);
        let thrusters: Vec<_> = places.zip(ways).map(thruster).collect();
        let n = case["N"].as_u64().expect("N") as usize;
        let still = Vector3::zeros();
        let start = at(&body, still, still);
        let turn = exp(&vector(&case["turn"]));
        let end = BodyState::from_velocities(&body, vector(&case["move"]), still, turn, still);
        let [duration, limit, expected] = ["T", "limit", "fuel"].map(|key| number(&case[key]));
        let limit = [limited(&[limit; 12])];
        let actuation = actuation(&thrusters, &numbers(&case["prices"]));
        let actuation = actuation.minimizing_fuel(&limit).expect("limits");
        let nothing = Sources::new(Vec::new());
        let h = duration / n as f64;
        let transfer = Transfer::new(body, nothing, h, n, start, end, actuation)
            .expect("a transfer")
            .with_dynamics(Dynamics::Lgvi)
            .with_constraints(&limit);
        let plan = planned(&transfer).expect("a plan");
        compare(&case["name"], &plan, expected);
    }
}

fn compare(name: &Value, plan: &Plan, expected: f64) {
    let dearer = plan.cost / expected - 1.0;
    assert!(dearer.abs() < 2e-6, "{name}: {} for {expected}", plan.cost);
    let certificate = &plan.certificate;
    assert!(
        certificate.terminal < 1e-12 && certificate.sufficient,
        "{name}: {certificate:?}"
    );
    let switching = certificate.switching.expect("a switching structure");
    assert!(
        switching.switches > 0 && switching.at_limit > 0,
        "{name}: {switching:?}"
    );
    assert!(switching.contradiction < 1e-4, "{name}: {switching:?}");
}

/// A unit mass moves by 1 from rest to rest in T = 3 with a force of 1 at most: it thrusts for t and then again, with t (T − t) = 1.
#[test]
fn a_motion_from_rest_to_rest_thrusts_coasts_and_thrusts() {
    let ends = [Vector3::y(), Vector3::y() + Vector3::x()].map(|at| [at, Vector3::zeros()]);
    let exact = 3.0 - 5.0_f64.sqrt();
    let mut errors = Vec::new();
    for n in [50, 100, 200] {
        let plan = planned(&orbit(ends, 0.0, 3.0, n, 1.0)).expect("a plan");
        let switching = plan.certificate.switching.expect("a switching structure");
        assert_eq!(
            (switching.switches, switching.longest),
            (2, 1),
            "{switching:?}"
        );
        let thrusting = (n as f64 * exact / 3.0).floor() as usize;
        assert!(thrusting.abs_diff(switching.at_limit) <= 2, "{switching:?}");
        errors.push(plan.cost - exact);
    }
    assert!(errors[0] < 2e-3, "{errors:?}");
    // Where the switch lies in its step varies, and the constant of h² with it.
    assert!(
        errors[2] > 0.0 && errors[2] < 0.15 * errors[0],
        "{errors:?}"
    );
}

/// With a strong engine the transfer between two circular orbits in half a period of the ellipse between them costs as much as
/// Hohmann's two impulses, which is the least of all transfers by two impulses.
#[test]
fn a_strong_engine_flies_hohmanns_transfer() {
    let (inner, outer) = (1.0_f64, 2.0_f64);
    let mean = 0.5 * (inner + outer);
    let speed = |radius: f64| (2.0 / radius - 1.0 / mean).sqrt();
    let impulses = [
        speed(inner) - inner.sqrt().recip(),
        outer.sqrt().recip() - speed(outer),
    ];
    let hohmann: f64 = impulses.iter().sum();
    let ends = [
        [inner * Vector3::x(), Vector3::y() / inner.sqrt()],
        [-outer * Vector3::x(), -Vector3::y() / outer.sqrt()],
    ];
    let duration = std::f64::consts::PI * mean.powf(1.5);
    let costs = [100, 200, 400].map(|n| {
        let plan = planned(&orbit(ends, 1.0, duration, n, 20.0)).expect("a plan");
        (plan.cost / hohmann - 1.0).abs()
    });
    assert!(costs[0] < 2e-2 && costs[2] < 2e-3, "{costs:?}");
}

/// The plan does not depend on the units of length, mass and time.
#[test]
fn fuel_is_the_same_in_si() {
    let plan = planned(&leo(1.0, 1.0, 1.0)).expect("a plan");
    let (length, mass, time) = (6.778e6, 850.0, 883.7);
    let si = planned(&leo(length, mass, time)).expect("a plan");
    let cost = si.cost / (mass * length / time);
    assert!(
        (cost / plan.cost - 1.0).abs() < 1e-6,
        "{cost} for {}",
        plan.cost
    );
}

/// A transfer by a quarter of an orbit, upwards by a twentieth.
fn leo(length: f64, mass: f64, time: f64) -> Transfer {
    let inertia = Inertia::principal([mass * length * length; 3]).expect("inertia");
    let body = RigidBody::new(mass, inertia, Vec::new()).expect("a body");
    let speed = length / time;
    let start = at(&body, length * Vector3::x(), speed * Vector3::y());
    let end = at(
        &body,
        1.05 * length * Vector3::y(),
        -speed / 1.05_f64.sqrt() * Vector3::x(),
    );
    let (field, n) = (
        Central {
            gm: length * length * length / (time * time),
        },
        80,
    );
    let h = 1.7 * time / n as f64;
    let limit = [force_norm(0.2 * mass * speed / time)];
    let actuation = forces().minimizing_fuel(&limit).expect("limits");
    Transfer::new(body, field, h, n, start, end, actuation)
        .expect("a transfer")
        .with_dynamics(Dynamics::Lgvi)
        .with_motion(Motion::Translation)
        .with_constraints(&limit)
}

/// Random layouts of thrusters and random targets: the plans are cheaper in fuel than those of least energy, and fly to the target.
#[test]
fn random_thrusters_save_fuel() {
    let mut rng = Rng::with_seed(61);
    let (mut unsolved, mut saved, mut between, mut steps) = (0, 0.0, 0, 0);
    let mut iterations = 0;
    for round in 0..8 {
        let count = 7 + round;
        let thrusters = layout(&mut rng, count);
        let [initial, target] = ends(&mut rng);
        let actuation = actuation(&thrusters, &vec![1.0; count]);
        let free = transfer(initial, target, actuation.clone()).with_constraints(&[limited(&[])]);
        let free = planned(&free).expect("a plan");
        let limit = 1.2 * free.commands.iter().map(|w| w.amax()).fold(0.0, f64::max);
        let limits = [limited(&vec![limit; count])];
        let by = |actuation| transfer(initial, target, actuation).with_constraints(&limits);
        let fuel = |plan: &Plan| plan.h * plan.commands.iter().map(|w| w.sum()).sum::<f64>();
        let energy = fuel(&planned(&by(actuation.clone())).expect("a plan of least energy"));
        let cheapest = by(actuation.minimizing_fuel(&limits).expect("limits"));
        let mut last = 0;
        let found = solve(&cheapest, Start::Cold, &NewtonSettings::default(), |now| {
            last = now.iteration;
            true
        });
        let Ok(plan) = found else {
            unsolved += 1;
            continue;
        };
        iterations += last;
        assert!(
            (fuel(&plan) / plan.cost - 1.0).abs() < 1e-9,
            "the cost is the fuel"
        );
        assert!(plan.certificate.terminal < 1e-11, "{:?}", plan.certificate);
        let switching = plan.certificate.switching.expect("a switching structure");
        assert!(switching.contradiction < 1e-3, "{switching:?}");
        between += switching.between;
        steps += count * plan.commands.len();
        for command in &plan.commands {
            assert!(command.min() > -1e-8 * limit && command.max() < limit * (1.0 + 1e-8));
        }
        saved += 1.0 - plan.cost / energy;
        let end = flown(&thrusters, initial, &plan, limit);
        let off = lgvi_control::miss(&target, &end).amax();
        assert!(off < 1e-7, "{round}: the flight misses by {off:e}");
    }
    println!(
        "{unsolved} unsolved, saved {saved}, {between} of {steps} between, {iterations} iterations"
    );
    assert!(iterations < 8 * 120, "{iterations}");
    assert!(unsolved <= 1, "{unsolved}");
    assert!(saved > 0.1 * 7.0, "{saved}");
    assert!(between < steps / 20, "{between} of {steps}");
}

#[test]
fn a_warm_start_takes_fewer_iterations() {
    let ends = [
        [Vector3::x(), Vector3::y()],
        [1.5 * Vector3::y(), -Vector3::x() / 1.5_f64.sqrt()],
    ];
    let count = |transfer: &Transfer, start: Start<'_>| {
        let mut last = 0;
        let observe = |now: &Progress| {
            last = now.iteration;
            true
        };
        let plan = solve(transfer, start, &NewtonSettings::default(), observe).expect("a plan");
        (plan, last)
    };
    let (plan, cold) = count(&orbit(ends, 1.0, 2.5, 100, 0.5), Start::Cold);
    let mut moved = ends;
    moved[0][0].z = 1e-3;
    let (near, warm) = count(&orbit(moved, 1.0, 2.5, 100, 0.5), Start::Warm(&plan));
    assert!(2 * warm < cold, "{warm} of {cold}");
    assert!((near.cost / plan.cost - 1.0).abs() < 1e-2);
}

/// Nothing needs to be done, and a drift that arrives by itself needs next to nothing.
#[test]
fn a_flight_that_arrives_by_itself_costs_nothing() {
    let (here, slow) = (Vector3::y(), 0.3 * Vector3::x());
    for [start, end] in [
        [[here, Vector3::zeros()], [here, Vector3::zeros()]],
        [[here, slow], [here + 3.0 * slow, slow]],
    ] {
        let plan = planned(&orbit([start, end], 0.0, 3.0, 40, 1.0)).expect("a plan");
        assert!(plan.cost.abs() < 1e-5, "{}", plan.cost);
        assert!(plan.certificate.terminal < 1e-12, "{:?}", plan.certificate);
    }
}

/// The constraints that the prices were made with have to be those of the transfer.
#[test]
fn a_transfer_without_the_limits_is_refused() {
    let transfer = orbit([[Vector3::y(); 2], [Vector3::x(); 2]], 0.0, 3.0, 40, 1.0);
    let refused = planned(&transfer.clone().with_constraints(&[]));
    assert_eq!(refused, Err(PlanError::Unlimited { command: 0 }));
    let soft = force_norm(1.0).priced(1.0).expect("a price");
    let refused = planned(&transfer.with_constraints(&[soft]));
    assert_eq!(refused, Err(PlanError::Unlimited { command: 0 }));
    let once = forces()
        .minimizing_fuel(&[force_norm(1.0)])
        .expect("limits");
    assert_eq!(once.minimizing_fuel(&[]), Ok(once));
}

#[test]
fn costs_that_are_not_of_fuel_are_refused() {
    let refused = |actuation: Actuation, constraints: &[Constraint]| {
        let refused = actuation.minimizing_fuel(constraints);
        refused.expect_err("a cost that is not of fuel")
    };
    let unlimited = |command| ActuationError::Unlimited { command };
    assert_eq!(refused(forces(), &[]), unlimited(0));
    let some = ComponentLimit::new(Place::Position, Vector3::new(1.0, f64::INFINITY, 1.0));
    let some = Constraint::commands(some.expect("limits"));
    assert_eq!(refused(forces(), &[some]), unlimited(1));
    let uneven = Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 1.0));
    let uneven = Actuation::full(&uneven, &Matrix3::identity()).expect("an actuation");
    let error = refused(uneven, &[force_norm(1.0)]).to_string();
    assert!(error.contains("expected one number"), "{error}");
    let five = Constraint::commands(CommandLimit::new(&[1.0; 5]).expect("limits"));
    let columns = [([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], 1.0); 6];
    let six = Actuation::actuators(&columns).expect("an actuation");
    assert_eq!(refused(six, &[five]), unlimited(5));
    let wheels = Wheels::new(vec![ReactionWheel::new(Vector3::z(), 0.1)]).expect("wheels");
    let wheels = Actuation::wheels(&wheels, &[1.0]).expect("an actuation");
    assert_eq!(refused(wheels, &[]), ActuationError::FuelOfWheels);
}
