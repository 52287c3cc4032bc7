//! Constraints that hold in some steps, and commands that are off in others: against IPOPT on the same discrete problems
//! (`tests/truth/phases.json`), closed forms, transfers that never have the commands, and along their steps.

use std::ops::Range;

use fastrand::Rng;
use lgvi_control::constraint::{
    AngularRate, FrameMotion, FramePose, KeepInSphere, KeepOutSphere, Moving, NormLimit, Speed,
};
use lgvi_control::{
    Actuation, Command, Constraint, Dynamics, Motion, NewtonSettings, Place, Plan, PlanError,
    Start, TimeRange, Transfer, solve, solve_minimum_time,
};
use lgvi_dynamics::gravity::{Central, Sources};
use lgvi_dynamics::thrusters::Thruster;
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use lgvi_lie::exp;
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;

use crate::thrusters::{actuation, ends, limited, transfer};

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_fn(|i, _| number(&value[i]))
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn references() -> Value {
    let path = format!(
        "{}/../../tests/truth/phases.json",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(&path).expect(&path);
    serde_json::from_str(&text).expect(&path)
}

fn planned(transfer: &Transfer) -> Result<Plan, PlanError> {
    solve(transfer, Start::Cold, &NewtonSettings::default(), |_| true)
}

/// The steps of each phase, the commands that are off in it, and its constraints.
type Phase = (Range<usize>, Vec<usize>, Vec<Constraint>);

fn phases(case: &Value, body: &RigidBody) -> Vec<Phase> {
    let mut begin = 0;
    let n = number(&case["N"]) as usize;
    let h = number(&case["T"]) / n as f64;
    let phase = |phase: &Value| {
        let steps = begin..begin + number(&phase["steps"]) as usize;
        begin = steps.end;
        let mut constraints = Vec::new();
        if let Some(limit) = phase["force_norm"].as_f64() {
            let limit = NormLimit::new(Place::Position, limit).expect("a limit");
            constraints.push(Constraint::commands(limit));
        }
        if let [center, radius] = list(&phase["keep_in_sphere"]) {
            let sphere = KeepInSphere::new(vector(center), number(radius)).expect("a sphere");
            constraints.push(Constraint::state(sphere));
        }
        if let [center, radius] = list(&phase["keep_out_sphere"]) {
            let sphere = KeepOutSphere::new(vector(center), number(radius)).expect("a sphere");
            constraints.push(Constraint::state(sphere));
        }
        if let Some(limit) = phase["speed"].as_f64() {
            let speed = Speed::new(limit, body.mass()).expect("a speed");
            constraints.push(Constraint::state(speed));
        }
        if let [limit, rest @ ..] = list(&phase["relative_speed"]) {
            let [origin, velocity, turn] = [0, 1, 2].map(|at| vector(&rest[at]));
            let motion = |step: usize| FrameMotion {
                pose: FramePose {
                    origin: origin + h * step as f64 * velocity,
                    rotation: Matrix3::identity(),
                },
                velocity,
                turn,
            };
            let speed = Speed::new(number(limit), body.mass()).expect("a speed");
            let speed = Moving::new(speed, (0..=n).map(motion), h).expect("a moving frame");
            constraints.push(Constraint::state(speed));
        }
        if let Some(limit) = phase["angular_rate"].as_f64() {
            let rate = AngularRate::new(limit, body.inertia()).expect("a rate");
            constraints.push(Constraint::state(rate));
        }
        let off = list(&phase["off"]).iter().map(|at| number(at) as usize);
        (steps, off.collect(), constraints)
    };
    list(&case["phases"]).iter().map(phase).collect()
}

/// The transfer in phases, whose constraints hold at the ends of steps, as in the reference.
fn in_phases(free: Transfer, phases: &[Phase], always: &[Constraint]) -> Transfer {
    let own = phases.iter().flat_map(|(steps, _, constraints)| {
        let each = constraints.iter().cloned();
        each.map(|one| one.during(steps.clone()).expect("steps"))
    });
    let constraints: Vec<_> = own.chain(always.iter().cloned()).collect();
    let all = free.with_constraints_at_ends(&constraints);
    phases.iter().fold(all, |all, (steps, off, _)| {
        all.without_commands(steps.clone(), off).expect("steps")
    })
}

fn point(case: &Value) -> (Transfer, Vec<Phase>) {
    let inertia = Inertia::principal([1.0; 3]).expect("inertia");
    let body = RigidBody::new(number(&case["mass"]), inertia, Vec::new()).expect("a body");
    let end = |which: &str| {
        let [position, velocity] = [0, 1].map(|at| vector(&case[which][at]));
        let (upright, still) = (Matrix3::identity(), Vector3::zeros());
        BodyState::from_velocities(&body, position, velocity, upright, still)
    };
    let phases = phases(case, &body);
    let n = number(&case["N"]) as usize;
    let (h, gm) = (number(&case["T"]) / n as f64, number(&case["gm"]));
    let identity = Matrix3::identity();
    let actuation = Actuation::full(&identity, &identity).expect("weights");
    let (start, end) = (end("start"), end("end"));
    let transfer = match gm {
        0.0 => Transfer::new(body, Sources::new(Vec::new()), h, n, start, end, actuation),
        _ => Transfer::new(body, Central { gm }, h, n, start, end, actuation),
    };
    let free = transfer
        .expect("a transfer")
        .with_dynamics(Dynamics::Lgvi)
        .with_motion(Motion::Translation);
    (in_phases(free, &phases, &[]), phases)
}

fn check(name: &Value, plan: &Plan, phases: &[Phase], expected: f64) {
    let error = plan.cost / expected - 1.0;
    println!("{name}: {error:.1e}, {:?}", plan.certificate);
    assert!(error.abs() < 1e-6, "{name}: {} for {expected}", plan.cost);
    let found = &plan.certificate;
    assert!(
        found.terminal < 1e-11 && found.sufficient,
        "{name}: {found:?}"
    );
    assert!(found.stationarity < 1e-6, "{name}: {found:?}");
    for (steps, off, _) in phases {
        for command in &plan.commands[steps.clone()] {
            assert!(off.iter().all(|at| command[*at] == 0.0), "{name}");
        }
    }
}

#[test]
fn points_in_phases_cost_what_ipopt_finds() {
    for case in list(&references()["points"]) {
        let (transfer, phases) = point(case);
        let plan = planned(&transfer).unwrap_or_else(|error| panic!("{}: {error}", case["name"]));
        check(&case["name"], &plan, &phases, number(&case["cost"]));
        let again = solve(
            &transfer,
            Start::Warm(&plan),
            &NewtonSettings::default(),
            |_| true,
        );
        let again = again.expect("a plan");
        assert!((again.cost / plan.cost - 1.0).abs() < 1e-7);
    }
}

/// All schedules of a problem whose switching times are free, from nothing and from the path of the schedule before; where IPOPT finds
/// no plan, there is none.
#[test]
fn all_schedules_of_a_problem_cost_what_ipopt_finds() {
    let near = NewtonSettings {
        falls_back: false,
        ..NewtonSettings::default()
    };
    let mut before: Option<([usize; 2], Plan)> = None;
    let search = &references()["search"];
    for row in list(&search["costs"]) {
        let [first, second] = [0, 1].map(|at| number(&row[at]) as usize);
        let n = number(&search["N"]) as usize;
        let mut case = search.clone();
        for (phase, steps) in [first, second - first, n - second].into_iter().enumerate() {
            case["phases"][phase]["steps"] = Value::from(steps);
        }
        let (transfer, phases) = point(&case);
        match (planned(&transfer), row[2].as_f64()) {
            (Ok(plan), Some(cost)) => {
                check(row, &plan, &phases, cost);
                let switches = [first, second];
                if let Some((from, path)) = before.replace((switches, plan)) {
                    let path = path.rescheduled(&from, &switches).expect("a path");
                    let found = solve(&transfer, Start::Warm(&path), &near, |_| true);
                    check(row, &found.expect("a plan"), &phases, cost);
                }
            }
            (Err(PlanError::NotFound { .. }), None) => (),
            (found, expected) => panic!("{row}: {found:?} for {expected:?}"),
        }
    }
}

#[test]
fn bodies_by_thrusters_in_phases_cost_what_ipopt_finds() {
    for case in list(&references()["bodies"]) {
        let inertia = Inertia::principal(vector(&case["inertia"]).into()).expect("inertia");
        let body = RigidBody::new(number(&case["mass"]), inertia, Vec::new()).expect("a body");
        let places = list(&case["positions"]).iter();
        let ways = list(&case["directions"]).iter();
        let thruster = |(place, way)| Thruster::new(vector(place), vector(way), 1.0);
        let thrusters: Vec<_> = places.zip(ways).map(thruster).collect();
        let n = number(&case["N"]) as usize;
        let still = Vector3::zeros();
        let at = |position, turn| BodyState::from_velocities(&body, position, still, turn, still);
        let start = at(still, Matrix3::identity());
        let end = at(vector(&case["move"]), exp(&vector(&case["turn"])));
        let phases = phases(case, &body);
        let h = number(&case["T"]) / n as f64;
        let actuation = actuation(&thrusters, &[1.0; 12]);
        let nothing = Sources::new(Vec::new());
        let free = Transfer::new(body, nothing, h, n, start, end, actuation)
            .expect("a transfer")
            .with_dynamics(Dynamics::Lgvi);
        let always = limited(&[number(&case["limit"]); 12]);
        let transfer = in_phases(free, &phases, &[always]);
        let plan = planned(&transfer).unwrap_or_else(|error| panic!("{}: {error}", case["name"]));
        check(&case["name"], &plan, &phases, number(&case["cost"]));
    }
}

/// From rest to rest by the impulses of the steps in which the force is on. With `τ_k` the time from the middle of step k to the end, the
/// least `Σ (h/2) u_k²` with `Σ h u_k = 0` and `Σ h τ_k u_k = m d` is that of `u_k = c (τ_k − τ̄)`, `(m d)²/(2 Σ h (τ_k − τ̄)²)`.
#[test]
fn a_force_that_is_off_in_between_costs_what_least_squares_say() {
    let mut rng = Rng::with_seed(8);
    for _ in 0..8 {
        let n = rng.usize(12..60);
        let from = rng.usize(2..n - 6);
        let to = rng.usize(from + 1..n - 2);
        let (h, distance, mass) = (0.1, 1.5, 2.0);
        let case = serde_json::json!({
            "mass": mass, "N": n, "T": h * n as f64, "gm": 0.0,
            "start": [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]], "end": [[1.0 + distance, 0.0, 0.0], [0.0, 0.0, 0.0]],
            "phases": [{ "steps": from }, { "steps": to - from, "off": [0] }, { "steps": n - to }],
        });
        let (transfer, phases) = point(&case);
        let plan = planned(&transfer).expect("a plan");
        let on: Vec<_> = (0..n)
            .filter(|k| !(from..to).contains(k))
            .map(|k| h * (n as f64 - k as f64 - 0.5))
            .collect();
        let mean = on.iter().sum::<f64>() / on.len() as f64;
        let moment: f64 = on
            .iter()
            .map(|time| h * (time - mean) * (time - mean))
            .sum();
        let expected = (mass * distance) * (mass * distance) / (2.0 * moment);
        check(&Value::from(n), &plan, &phases, expected);
        assert!((plan.cost / expected - 1.0).abs() < 1e-10, "{}", plan.cost);
    }
}

/// Commands that are off in all steps are as if they did not exist, with gains and multipliers.
#[test]
fn commands_that_are_always_off_are_as_if_there_were_none() {
    let mut rng = Rng::with_seed(81);
    let thrusters = crate::thrusters::layout(&mut rng, 9);
    let more = crate::thrusters::layout(&mut rng, 7);
    let both: Vec<_> = thrusters[..4]
        .iter()
        .chain(&more[..3])
        .chain(&thrusters[4..])
        .copied()
        .collect();
    for constrained in [false, true] {
        let [initial, target] = ends(&mut rng);
        let constraints = match constrained {
            true => vec![limited(&[])],
            false => Vec::new(),
        };
        let make = |thrusters: &[Thruster]| {
            let own = actuation(thrusters, &vec![1.0; thrusters.len()]);
            transfer(initial, target, own).with_constraints(&constraints)
        };
        let expected = planned(&make(&thrusters)).expect("a plan");
        let whole = make(&both);
        let n = whole.intervals();
        let whole = whole.without_commands(0..n, &[4, 5, 6]).expect("steps");
        let plan = planned(&whole).expect("a plan");
        assert!(
            (plan.cost / expected.cost - 1.0).abs() < 1e-8,
            "{} {}",
            plan.cost,
            expected.cost
        );
        assert_eq!(plan.certificate.sufficient, expected.certificate.sufficient);
        // Where a command and its multiplier vanish together, each is as large as the barrier lets it be.
        let least = |plan: &Plan| plan.certificate.complementarity * plan.cost / whole.h();
        let bound = 1e-5 + least(&plan).max(least(&expected)).sqrt();
        let mut off: f64 = 0.0;
        for (found, expected) in plan.commands.iter().zip(&expected.commands) {
            assert_eq!(found.rows(4, 3).amax(), 0.0);
            off = off.max((found.rows(0, 4) - expected.rows(0, 4)).amax());
            off = off.max((found.rows(7, 5) - expected.rows(4, 5)).amax());
        }
        assert!(off < bound, "{off} {bound}");
        // Gains are those of a model near the plan. The weight of a limit depends on β where a command is neither clearly at it nor
        // clearly off it, and gains up to there depend on that weight.
        let between = |w: &Command| (0..9).any(|i| (0.1 * bound..10.0 * bound).contains(&w[i]));
        let weak = expected.commands.iter().rposition(between);
        let from = weak.filter(|_| constrained).map_or(0, |step| step + 1);
        assert!(from < n / 2, "{from} of {n}");
        let gains = plan.feedback.iter().zip(&expected.feedback);
        for (found, expected) in gains.skip(from) {
            let off = (found - expected).amax() / expected.amax();
            assert!(off < 1e-3, "{off}");
        }
    }
}

/// The rest of a plan from where it leads is its rest: windows and commands that are off have shifted, and those of phases that are
/// over are gone. Without inequalities the policies of the whole are taken over.
#[test]
fn the_rest_of_a_plan_in_phases_is_the_plan_of_the_rest() {
    let file = references();
    for case in &list(&file["points"])[..3] {
        let (transfer, phases) = point(case);
        let whole = planned(&transfer).expect("a plan");
        for (steps, ..) in &phases {
            let step = (steps.start + steps.end) / 2;
            let state = whole.states[step];
            let rest = transfer.remaining(step, state).expect("a rest");
            let guess = whole.remaining(&transfer, step).expect("a rest");
            let mut iterations = 0;
            let plan = solve(
                &rest,
                Start::Warm(&guess),
                &NewtonSettings::default(),
                |now| {
                    iterations = now.iteration;
                    true
                },
            );
            let plan = plan.expect("a plan");
            println!("{} after {step}: {iterations} iterations", case["name"]);
            let cold = planned(&rest).expect("a plan");
            for found in [plan, cold] {
                for (one, other) in found.commands.iter().zip(&whole.commands[step..]) {
                    assert!((one - other).amax() < 1e-4, "{} {step}", case["name"]);
                }
            }
        }
    }
}

/// The point in its phases, whose limits hold along its steps too: between states of windows, and not beyond.
#[test]
fn limits_hold_along_the_steps_of_their_phase_and_not_beyond() {
    let file = references();
    let case = &list(&file["points"])[1];
    let (ends_only, phases) = point(case);
    let constraints = phases.iter().flat_map(|(steps, _, constraints)| {
        let each = constraints.iter().cloned();
        each.map(|one| one.during(steps.clone()).expect("steps"))
    });
    let constraints: Vec<_> = constraints.collect();
    let transfer = ends_only.with_constraints(&constraints);
    let plan = planned(&transfer).expect("a plan");
    let mass = number(&case["mass"]);
    let h = plan.h;
    let mut beyond = [false; 2];
    let sphere = KeepInSphere::new(Vector3::new(-1.2, 0.1, 0.0), 0.2).expect("a sphere");
    for k in 0..transfer.intervals() {
        let (from, to) = (&plan.states[k], &plan.states[k + 1]);
        let speed = to.linear_momentum.norm() / mass;
        for part in 0..=100 {
            let s = f64::from(part) / 100.0;
            // The force is constant in a step, so that the motion is a parabola.
            let force = plan.controls[k].force;
            let position = from.position
                + s * h / mass * from.linear_momentum
                + 0.5 * s * s * h * h / mass * force;
            let out = (position - sphere.center()).norm() / sphere.radius() - 1.0;
            match k {
                26..38 => assert!(out < 1e-6, "step {k} + {s}: {out:e}"),
                _ => beyond[0] |= out > 0.1,
            }
            if k < 26 {
                assert!(position.norm() > 0.8 - 1e-6, "step {k} + {s}");
            }
        }
        match k {
            38.. => assert!(speed < 0.7 + 1e-6, "step {k}: {speed}"),
            _ => beyond[1] |= speed > 0.75,
        }
    }
    assert_eq!(beyond, [true; 2]);
}

/// Thrusters at minimum fuel that are off in a phase are zero there, and the others switch as Pontryagin's principle says.
#[test]
fn at_minimum_fuel_thrusters_switch_beside_others_that_are_off() {
    let mut rng = Rng::with_seed(82);
    let prices = [1.0; 12];
    let thrusters = crate::thrusters::layout(&mut rng, 12);
    let mut solved = 0;
    for _ in 0..4 {
        let [initial, target] = ends(&mut rng);
        let free = transfer(initial, target, actuation(&thrusters, &prices));
        let free = planned(&free.with_constraints(&[limited(&[])])).expect("a plan");
        let most = free.commands.iter().map(|w| w.amax()).fold(0.0, f64::max);
        let limit = [limited(&[1.5 * most; 12])];
        let fuel = actuation(&thrusters, &prices).minimizing_fuel(&limit);
        let fuel = fuel.expect("limits");
        let transfer = transfer(initial, target, fuel)
            .with_constraints(&limit)
            .without_commands(20..45, &[1, 5, 8])
            .expect("steps");
        let Ok(plan) = planned(&transfer) else {
            continue;
        };
        solved += 1;
        let switching = plan.certificate.switching.expect("a switching structure");
        println!("{}, {switching}", plan.cost);
        assert!(
            switching.switches > 0 && switching.contradiction < 1e-3,
            "{switching}"
        );
        let off = plan.commands[20..45].iter();
        for command in off {
            assert_eq!([1, 5, 8].map(|at| command[at]), [0.0; 3]);
        }
    }
    assert!(solved >= 3, "{solved}");
}

/// A mass that thrusts in the first and the last third, at the limit, and coasts between: `d = 2 (f/m) (T/3)²`.
#[test]
fn the_shortest_time_with_a_coasting_third_is_exact() {
    let (mass, distance, force) = (2.0, 1.5, 1.2);
    for n in [30, 60] {
        let case = serde_json::json!({
            "mass": mass, "N": n, "T": 6.0, "gm": 0.0,
            "start": [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]], "end": [[1.0 + distance, 0.0, 0.0], [0.0, 0.0, 0.0]],
            "phases": [{ "steps": n / 3 }, { "steps": n / 3, "off": [0, 1, 2] }, { "steps": n / 3 }],
        });
        let limit = NormLimit::new(Place::Position, force).expect("a limit");
        let (transfer, _) = point(&case);
        let transfer = transfer.with_constraints(&[Constraint::commands(limit)]);
        let range = TimeRange {
            shortest: 0.1,
            longest: 100.0,
            tolerance: 1e-6,
        };
        let settings = NewtonSettings::default();
        let found = solve_minimum_time(&transfer, &range, Start::Cold, &settings, |_| true);
        let found = found.expect("a plan");
        let exact = 3.0 * (distance * mass / (2.0 * force)).sqrt();
        println!("{} for {exact}", found.final_time);
        assert!(
            (found.final_time / exact - 1.0).abs() < 2e-6,
            "{} for {exact}",
            found.final_time
        );
        let coasting = n / 3..2 * n / 3;
        assert!(
            found.plan.commands[coasting]
                .iter()
                .all(|w| w.amax() == 0.0)
        );
    }
}

/// Two spheres that exclude each other, and a phase without the commands that its sphere asks for, are not planned.
#[test]
fn phases_that_contradict_each_other_are_not_planned() {
    let file = references();
    let case = &list(&file["points"])[1];
    let (free, _) = point(case);
    let keep_in = |x: f64, steps: Range<usize>| {
        let sphere = KeepInSphere::new(Vector3::new(x, 0.0, 0.0), 0.2).expect("a sphere");
        let constraint = Constraint::state(sphere);
        constraint.during(steps).expect("steps")
    };
    let apart = [keep_in(-1.5, 20..30), keep_in(-0.5, 30..40)];
    let error = planned(&free.clone().with_constraints(&apart)).expect_err("no plan");
    assert!(matches!(error, PlanError::NotFound { .. }), "{error}");
    let far = free.clone().with_constraints(&[keep_in(-1.5, 5..40)]);
    let drifting = far.without_commands(0..20, &[0, 1, 2]).expect("steps");
    let error = planned(&drifting).expect_err("no plan");
    assert!(
        matches!(error, PlanError::NotFound { constraint: 0, .. }),
        "{error}"
    );
}
