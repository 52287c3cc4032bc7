//! Plans under inequalities and into other terminal sets, compared with IPOPT on the same discrete problem
//! (`tests/truth/constrained_control.json`).

use lgvi_control::constraint::{
    AngularRate, CommandLimit, ComponentLimit, Corridor, KeepOutCone, KeepOutEllipsoid,
    KeepOutSphere, LineOfSight, NormLimit, Place, Plume, Speed,
};
use lgvi_control::terminal::{FinalAttitude, FinalPosition, KeplerOrbit, SpinAxis};
use lgvi_control::{
    Actuation, Constraint, Motion, NewtonSettings, Phase, Plan, PlanError, Start, Terminal,
    Transfer, solve,
};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;

use crate::case::Case;

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_fn(|i, _| number(&value[i]))
}

fn references() -> Value {
    let path = format!(
        "{}/../../tests/truth/constrained_control.json",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(&path).expect(&path);
    serde_json::from_str(&text).expect(&path)
}

fn constraint(c: &Value) -> Constraint {
    let limit = || number(&c["limit"]);
    let components = |place| {
        let limit = ComponentLimit::new(place, vector(&c["limit"]));
        Constraint::commands(limit.expect("limits"))
    };
    let axis = || vector(&c["axis"]);
    let constraint = match c["kind"].as_str().expect("a kind") {
        "angular_rate" => {
            let inertia = Case::load("C_i").body().inertia().clone();
            let rate = AngularRate::new(limit(), &inertia).expect("a rate");
            Constraint::state(match c["axis"].is_null() {
                true => rate,
                false => rate.about(axis()).expect("an axis"),
            })
        }
        "speed" => Constraint::state(Speed::new(limit(), 1.0).expect("a speed")),
        "keep_out_ellipsoid" => {
            let rotation = Matrix3::from_fn(|i, j| number(&c["rotation"][i][j]));
            let (center, semi_axes) = (vector(&c["center"]), vector(&c["semi_axes"]));
            let ellipsoid = KeepOutEllipsoid::new(center, semi_axes, rotation);
            Constraint::state(ellipsoid.expect("an ellipsoid"))
        }
        "line_of_sight" => {
            let sight = LineOfSight::new(axis(), vector(&c["point"]), number(&c["half_angle"]));
            Constraint::state(sight.expect("a sight"))
        }
        "plume" => {
            let (half_angle, distance) = (number(&c["half_angle"]), number(&c["distance"]));
            let plume = Plume::new(axis(), vector(&c["point"]), half_angle, distance);
            Constraint::state(plume.expect("a plume"))
        }
        "commands" => Constraint::commands(CommandLimit::new(&[limit(); 6]).expect("limits")),
        "force_components" => components(Place::Position),
        "moment_components" => components(Place::Attitude),
        "force_norm" => force_norm(limit()),
        "keep_out_sphere" => sphere(vector(&c["center"]), number(&c["radius"])),
        "keep_out_cone" => {
            let half_angle = number(&c["half_angle"]);
            let cone = KeepOutCone::new(vector(&c["axis"]), vector(&c["direction"]), half_angle);
            Constraint::state(cone.expect("a cone"))
        }
        "corridor" => {
            let half_angle = number(&c["half_angle"]);
            let corridor = Corridor::new(vector(&c["apex"]), vector(&c["axis"]), half_angle);
            Constraint::state(corridor.expect("a corridor"))
        }
        kind => panic!("{kind}"),
    };
    match c["price"].as_f64() {
        Some(price) => constraint.priced(price).expect("a price"),
        None => constraint,
    }
}

fn force_norm(limit: f64) -> Constraint {
    Constraint::commands(NormLimit::new(Place::Position, limit).expect("a limit"))
}

fn sphere(center: Vector3<f64>, radius: f64) -> Constraint {
    Constraint::state(KeepOutSphere::new(center, radius).expect("a sphere"))
}

/// The terminal set of a case, by the names in the file.
fn terminal(kinds: &Value, state: &BodyState) -> Terminal {
    let mut terminal = Terminal::try_from(*state).expect("a state");
    match kinds["translation"].as_str() {
        Some("position") => {
            let position = FinalPosition::new(state.position, None);
            terminal = terminal.with(position.expect("a position"));
        }
        Some("orbit") => terminal = terminal.with(orbit(state)),
        _ => (),
    }
    match kinds["rotation"].as_str() {
        Some("spin_axis") => terminal.with(spin(state, vector(&kinds["axis"]))),
        Some("free") => terminal.without(Place::Attitude),
        _ => terminal,
    }
}

/// The orbit of a state of unit mass about the origin.
fn orbit(state: &BodyState) -> KeplerOrbit {
    let (position, velocity) = (state.position, state.linear_momentum);
    KeplerOrbit::new(1.0, Vector3::zeros(), 1.0, position, velocity).expect("an orbit")
}

fn spin(state: &BodyState, axis: Vector3<f64>) -> SpinAxis {
    SpinAxis::new(axis, state.attitude * axis, state.angular_momentum).expect("a spin axis")
}

/// Wheels of unit weight about the first and the second axis.
fn wheels() -> Actuation {
    let [first, second] = [3, 4].map(|row| std::array::from_fn(|i| f64::from(u8::from(i == row))));
    Actuation::actuators(&[(first, 1.0), (second, 1.0)]).expect("actuators")
}

fn transfer(file: &Value, case: &Value) -> Transfer {
    let n = number(&case["N"]) as usize;
    let set = case["set"].as_str().expect("a set");
    let given = &file["sets"][set];
    let identity = Matrix3::identity();
    let actuation = Actuation::full(&identity, &identity).expect("weights");
    let free = if given.is_null() {
        let base = Case::load(set);
        let plain = base.transfer(n);
        let state = plain.target().state().expect("a state");
        Transfer::new(
            base.body(),
            Central { gm: 1.0 },
            plain.h(),
            n,
            *plain.initial(),
            terminal(&case["terminal"], &state),
            actuation,
        )
    } else {
        let inertia = Inertia::principal(vector(&given["J"]).into()).expect("inertia");
        let turns = given["bc"]["x0"] == given["bc"]["xN"];
        let still = |position: &Value, attitude: &Value| BodyState {
            position: if turns {
                Vector3::x()
            } else {
                vector(position)
            },
            linear_momentum: Vector3::zeros(),
            attitude: Matrix3::from_fn(|i, j| number(&attitude[i][j])),
            angular_momentum: Vector3::zeros(),
        };
        Transfer::new(
            RigidBody::new(1.0, inertia, Vec::new()).expect("a body"),
            Central { gm: 0.0 },
            number(&given["T"]) / n as f64,
            n,
            still(&given["bc"]["x0"], &given["bc"]["R0"]),
            still(&given["bc"]["xN"], &given["bc"]["RN"]),
            if turns { wheels() } else { actuation },
        )
        .map(|transfer| match turns {
            true => transfer.with_motion(Motion::Rotation),
            false => transfer,
        })
    };
    let constraints = case["constraints"].as_array().expect("constraints");
    let constraints: Vec<_> = constraints.iter().map(constraint).collect();
    free.expect("a transfer")
        .with_constraints_at_ends(&constraints)
}

fn planned(transfer: &Transfer, start: Start<'_>) -> (Plan, u32) {
    let mut iterations = 0;
    let plan = solve(transfer, start, &NewtonSettings::default(), |now| {
        iterations = now.iteration;
        true
    });
    (plan.expect("a plan"), iterations)
}

/// Checks a constraint at every sample by its definition.
fn assert_holds(constraint: &Constraint, plan: &Plan) {
    if let Some(limits) = constraint.downcast_ref::<ComponentLimit>() {
        for load in &plan.controls {
            let v = match constraint.place() {
                Some(Place::Position) => load.force,
                _ => load.moment,
            };
            assert!((0..3).all(|i| v[i].abs() <= limits.limit()[i]));
        }
    } else if let Some(norm) = constraint.downcast_ref::<NormLimit>() {
        let loads = &mut plan.controls.iter();
        assert!(loads.all(|load| load.force.norm() <= norm.limit()));
    } else if let Some(limits) = constraint.downcast_ref::<CommandLimit>() {
        let commands = &mut plan.commands.iter();
        assert!(commands.all(|command| command.amax() <= limits.limit()[0]));
    } else if let Some(sphere) = constraint.downcast_ref::<KeepOutSphere>() {
        for state in &plan.states {
            let distance = (state.position - sphere.center()).norm();
            assert!(distance >= sphere.radius() * (1.0 - 1e-9));
        }
    } else if let Some(cone) = constraint.downcast_ref::<KeepOutCone>() {
        for state in &plan.states {
            let angle = (state.attitude * cone.axis()).angle(&cone.direction());
            assert!(angle >= cone.half_angle() - 1e-9);
        }
    } else if let Some(corridor) = constraint.downcast_ref::<Corridor>() {
        for state in &plan.states {
            let arm = state.position - corridor.apex();
            let least = arm.norm() * corridor.half_angle().cos() - 1e-9;
            assert!(arm.dot(&corridor.axis()) >= least);
        }
    } else if let Some(rate) = constraint.downcast_ref::<AngularRate>() {
        let body = Case::load("C_i").body();
        for state in &plan.states {
            let omega = state.angular_velocity(&body);
            let found = rate
                .axis()
                .map_or(omega.norm(), |axis| axis.dot(&omega).abs());
            assert!(found <= rate.limit() * (1.0 + 1e-9));
        }
    } else if let Some(speed) = constraint.downcast_ref::<Speed>() {
        let speeds = &mut plan.states.iter().map(|state| state.linear_momentum.norm());
        assert!(speeds.all(|found| found <= speed.limit() * (1.0 + 1e-9)));
    } else if let Some(ellipsoid) = constraint.downcast_ref::<KeepOutEllipsoid>() {
        for state in &plan.states {
            let arm = ellipsoid
                .rotation()
                .tr_mul(&(state.position - ellipsoid.center()));
            assert!(arm.component_div(&ellipsoid.semi_axes()).norm() >= 1.0 - 1e-9);
        }
    } else if let Some(sight) = constraint.downcast_ref::<LineOfSight>() {
        for state in &plan.states {
            let arm = sight.point() - state.position;
            assert!((state.attitude * sight.axis()).angle(&arm) <= sight.half_angle() + 1e-9);
        }
    } else if let Some(plume) = constraint.downcast_ref::<Plume>() {
        for state in &plan.states {
            let arm = plume.point() - state.position;
            let outside = (state.attitude * plume.axis()).angle(&arm) >= plume.half_angle() - 1e-5;
            assert!(outside || arm.norm() >= plume.distance() * (1.0 - 1e-5));
        }
    } else {
        panic!("{constraint:?}");
    }
}

#[test]
fn constrained_costs_are_those_of_ipopt() {
    let file = references();
    for case in file["cases"].as_array().expect("cases") {
        let name = case["name"].as_str().expect("a name");
        let problem = transfer(&file, case);
        let (plan, cold) = planned(&problem, Start::Cold);
        // Without constraints, any of the minima that IPOPT found from several starts counts.
        let minima = match case["constraints"].as_array() {
            Some(none) if none.is_empty() => case["free_minima"].as_array().expect("minima"),
            _ => std::slice::from_ref(&case["cost"]),
        };
        let errors = minima.iter().map(|cost| plan.cost / number(cost) - 1.0);
        let error = errors
            .min_by(|a, b| a.abs().total_cmp(&b.abs()))
            .expect("a minimum");
        let found = &plan.certificate;
        let (again, warm) = planned(&problem, Start::Warm(&plan));
        println!(
            "{name}: cost {error:.1e}, {cold} iterations, {warm} from its own plan, {found:?}"
        );
        assert!(error.abs() < 1e-7, "{name}: {} by {error:e}", plan.cost);
        assert!((again.cost / plan.cost - 1.0).abs() < 1e-8, "{name}");
        // With two wheels, the conditions at rest depend on each other to first order.
        assert!(warm < cold || name.contains("wheels"), "{name}");
        assert!(
            found.terminal <= 1e-12 && found.inequality <= 1e-9,
            "{name}"
        );
        assert!(found.complementarity <= 1e-9, "{name}");
        // If a corridor ends at its apex, rounding limits the accuracy of the multipliers.
        let stationarity = if name == "corridor" { 1e-5 } else { 1e-8 };
        assert!(found.stationarity <= stationarity, "{name}: {found:?}");
        assert!(found.sufficient, "{name}");
        let constraints = case["constraints"].as_array().expect("constraints");
        let hard = |given: &&Value| given["price"].is_null();
        for given in constraints.iter().filter(hard) {
            assert_holds(&constraint(given), &plan);
        }
        if !constraints.is_empty() {
            assert!(plan.cost > number(&case["free_cost"]), "{name}");
        }
    }
}

/// The conditions of `|u| ≤ b` are `u + λ² = −y u` with `y ≥ 0`, and `y = 0` if `|u| < b`.
#[test]
fn bounded_forces_are_along_the_costate_and_at_the_bound_where_they_differ_from_it() {
    let free = Case::load("C_i").transfer(100);
    let (plan, _) = planned(&free, Start::Cold);
    let most = plan
        .controls
        .iter()
        .map(|u| u.force.norm())
        .fold(0.0, f64::max);
    let mut least = plan.cost;
    for part in [1.1, 0.95, 0.85, 0.75] {
        let limit = part * most;
        let bounded = free.clone().with_constraints(&[force_norm(limit)]);
        let (plan, _) = planned(&bounded, Start::Cold);
        let mut active = 0;
        for (load, lambda) in plan.controls.iter().zip(&plan.multipliers) {
            let force = load.force;
            let rest = force + lambda.fixed_rows::<3>(3);
            let y = -rest.dot(&force) / force.norm_squared();
            assert!((rest + y * force).norm() < 1e-8 * most, "{part}");
            assert!(
                y > -1e-9 && y * (limit - force.norm()) < 1e-6 * limit,
                "{part}: {y}"
            );
            active += usize::from(y > 1e-3);
        }
        if part > 1.0 {
            assert_eq!(active, 0);
            assert!((plan.cost / least - 1.0).abs() < 1e-8);
        } else {
            assert!(active > 2 && plan.cost > least, "{part}: {active}");
        }
        least = plan.cost;
    }
}

/// A unit mass moves a unit of length in 2 units of time. The least peak force is one unit, first in one direction,
/// then in the other.
#[test]
fn limits_down_to_the_least_peak_have_plans_and_below_it_the_least_excess_is_told() {
    let rest = |x: f64| BodyState {
        position: Vector3::new(x, 0.0, 0.0),
        linear_momentum: Vector3::zeros(),
        attitude: Matrix3::identity(),
        angular_momentum: Vector3::zeros(),
    };
    let under = |limit: f64| {
        let inertia = Inertia::principal([1.0; 3]).expect("inertia");
        let body = RigidBody::new(1.0, inertia, Vec::new()).expect("a body");
        let identity = Matrix3::identity();
        let actuation = Actuation::full(&identity, &identity).expect("weights");
        let field = Central { gm: 0.0 };
        let transfer = Transfer::new(body, field, 0.02, 100, rest(1.0), rest(2.0), actuation)
            .expect("a transfer")
            .with_constraints(&[force_norm(limit)])
            .with_motion(Motion::Translation);
        solve(&transfer, Start::Cold, &NewtonSettings::default(), |_| true)
    };
    let plan = under(1.01).expect("a plan");
    let forces = plan.controls.iter().map(|control| control.force.norm());
    assert!(forces.fold(0.0, f64::max) <= 1.01 + 1e-8);
    match under(0.5) {
        Err(PlanError::NotFound { violation, .. }) => {
            assert!((0.99..1.1).contains(&violation), "{violation}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn only_what_is_proved_is_infeasible_and_the_rest_is_not_found_with_the_place() {
    let cold = |transfer: &Transfer| {
        let settings = NewtonSettings::default();
        solve(transfer, Start::Cold, &settings, |_| true)
    };
    let infeasible = |transfer: &Transfer| match cold(transfer) {
        Err(PlanError::Infeasible {
            constraint,
            step,
            violation,
        }) => (constraint, step, violation),
        other => panic!("{other:?}"),
    };
    let free = Case::load("C_i").transfer(100);
    let far = Constraint::commands(NormLimit::new(Place::Attitude, 100.0).expect("a limit"));
    let weak = [far.clone(), force_norm(4.0)];
    match cold(&free.clone().with_constraints(&weak)) {
        Err(PlanError::NotFound {
            constraint,
            violation,
            ..
        }) => assert!(constraint == 1 && violation > 0.1),
        other => panic!("{other:?}"),
    }

    // The start fixes the end of the first step, the target fixes that of the last.
    let blocked = |center: Vector3<f64>| {
        let constraints = [far.clone(), sphere(center, 0.05)];
        infeasible(&free.clone().with_constraints(&constraints))
    };
    let (constraint, step, _) = blocked(free.initial().position);
    assert_eq!((constraint, step), (1, 0));
    let target = free.target().state().expect("a state");
    let (constraint, step, violation) = blocked(target.position);
    assert!((constraint, step) == (1, 99) && (violation - 1.0).abs() < 1e-12);
}

#[test]
fn an_observer_stops_a_constrained_plan_with_what_there_is() {
    let sphere = sphere(Vector3::new(0.4, 0.44, 0.46), 0.12);
    let transfer = Case::load("C_i").transfer(100).with_constraints(&[sphere]);
    let stopped = solve(&transfer, Start::Cold, &NewtonSettings::default(), |now| {
        now.phase != Phase::Constrained
    });
    assert!(matches!(stopped, Err(PlanError::Stopped { best: Some(_) })));
}

/// Every kind of terminal set is reached, and freer ends cost less.
#[test]
fn all_kinds_of_ends_are_reached_cold() {
    for set in ["C_i", "C_ii"] {
        let case = Case::load(set);
        let plain = case.transfer(50);
        let state = plain.target().state().expect("a state");
        let fixed = Terminal::try_from(state).expect("a state");
        let position = FinalPosition::new(state.position, None).expect("a position");
        let attitude = FinalAttitude::new(state.attitude, None).expect("an attitude");
        for translation in [
            fixed.clone(),
            fixed.clone().with(position),
            fixed.clone().with(orbit(&state)),
            fixed.without(Place::Position),
        ] {
            let rotations = [
                translation.clone(),
                translation.clone().with(attitude),
                translation.clone().without(Place::Attitude),
                translation.clone().with(spin(&state, Vector3::x())),
                translation.with(spin(&state, Vector3::z())),
            ];
            let costs = rotations.map(|terminal| {
                let name = format!("{set}: {terminal:?}");
                let identity = Matrix3::identity();
                let transfer = Transfer::new(
                    case.body(),
                    Central { gm: 1.0 },
                    plain.h(),
                    50,
                    *plain.initial(),
                    terminal,
                    Actuation::full(&identity, &identity).expect("weights"),
                );
                let (plan, iterations) = planned(&transfer.expect("a transfer"), Start::Cold);
                assert!(iterations <= 60, "{name}: {iterations}");
                let found = &plan.certificate;
                assert!(
                    found.terminal <= 1e-12 && found.stationarity <= 1e-8 && found.sufficient,
                    "{name}: {found:?}"
                );
                plan.cost
            });
            assert!(costs[1] <= costs[0] && costs[2] <= costs[1]);
        }
    }
}
