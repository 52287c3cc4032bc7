//! Plans with drag: against IPOPT on the same discrete problems, against the published height of Goddard's rocket
//! (`tests/truth/drag.json`), and in flight.

use std::sync::Arc;

use fastrand::Rng;
use lgvi_control::constraint::NormLimit;
use lgvi_control::shooting::{self, ExtremalError, ShootingError};
use lgvi_control::{
    Actuation, Constraint, Dynamics, Motion, NewtonSettings, Place, Plan, PlanError, Start,
    Transfer, miss, solve,
};
use lgvi_dynamics::drag::{Atmosphere, Drag};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::thrusters::{Engine, Propellant, Thrusters};
use lgvi_dynamics::{BodyState, Inertia, Load, Method, RigidBody, Simulation, System};
use lgvi_lie::exp;
use nalgebra::{Matrix3, SVector, Vector3};
use serde_json::Value;

use crate::fuel::{number, numbers, references, vector};
use crate::thrusters::{limited, pairs};

fn planned(transfer: &Transfer) -> Result<Plan, PlanError> {
    solve(transfer, Start::Cold, &NewtonSettings::default(), |_| true)
}

fn drag(case: &Value) -> Drag {
    let layers = case["layers"].as_array().expect("layers").iter();
    let layers: Vec<_> = layers
        .map(|layer| {
            let layer = numbers(layer);
            [layer[0], layer[1]]
        })
        .collect();
    let [radius, height, area] = ["radius", "scale_height", "area"].map(|key| number(&case[key]));
    let omega = vector(&case["omega"]);
    let air = Atmosphere::new(Vector3::zeros(), omega, radius, &layers, height);
    Drag::new(Arc::new(air.expect("an atmosphere")), area).expect("drag")
}

fn body(case: &Value) -> RigidBody {
    let mass = number(&case["mass"]);
    let inertia = Inertia::principal([0.1 * mass, 0.14 * mass, 0.19 * mass]).expect("inertia");
    let body = RigidBody::new(mass, inertia, Vec::new()).expect("a body");
    body.with_drag(drag(case))
}

fn ends(case: &Value, body: &RigidBody) -> [BodyState; 2] {
    ["start", "end"].map(|which| {
        let [place, velocity] = [0, 1].map(|i| vector(&case[which][i]));
        let still = Vector3::zeros();
        BodyState::from_velocities(body, place, velocity, Matrix3::identity(), still)
    })
}

fn goddard() -> Value {
    let text = include_str!("../../../../tests/truth/drag.json");
    let all: Value = serde_json::from_str(text).expect("references");
    all["goddard"].clone()
}

/// Goddard's rocket to the greatest height, in steps over a duration.
fn rocket(case: &Value, steps: usize, duration: f64) -> (RigidBody, Transfer) {
    let [thrust, exhaust_velocity] = ["limit", "exhaust_velocity"].map(|key| number(&case[key]));
    let engine = Engine {
        thrust,
        exhaust_velocity,
    };
    let propellant = Propellant {
        mass: 0.9,
        inertia: None,
    };
    let thrusters = Thrusters::new(Vec::new(), propellant).and_then(|all| all.with_engine(engine));
    let body = body(case).with_thrusters(thrusters.expect("an engine"));
    let body = body.expect("a body");
    let [start, end] = ends(case, &body);
    let limits = [Constraint::commands(
        NormLimit::new(Place::Position, thrust).expect("a limit"),
    )];
    let price = Matrix3::identity() / exhaust_velocity;
    let actuation = Actuation::full(&price, &Matrix3::identity()).expect("an actuation");
    let actuation = actuation.minimizing_fuel(&limits).expect("limits");
    let field = Central {
        gm: number(&case["gm"]),
    };
    let h = duration / steps as f64;
    let transfer = Transfer::new(body.clone(), field, h, steps, start, end, actuation)
        .expect("a transfer")
        .with_dynamics(Dynamics::Lgvi)
        .with_motion(Motion::Translation)
        .with_constraints(&limits);
    (body, transfer)
}

/// Flies a plan by an engine. Returns the propellant that it used.
fn flown(case: &Value, body: &RigidBody, plan: &Plan) -> f64 {
    let gravity = Central {
        gm: number(&case["gm"]),
    };
    let system = System::new(vec![body.clone()], vec![Box::new(gravity)]);
    let method = Method::Lgvi(Rotor::default());
    let simulation = Simulation::new(system, vec![plan.states[0]], method, plan.h);
    let mut simulation = simulation.expect("a simulation");
    for (k, control) in plan.controls.iter().enumerate() {
        let moment = simulation.command(0, *control);
        simulation.advance(&[moment]).expect("a step");
        let apart = miss(&plan.states[k + 1], &simulation.states()[0]);
        assert!(apart.rows(0, 6).amax() < 1e-9, "step {k}: {apart:?}");
    }
    body.mass() - simulation.system().bodies()[0].mass()
}

/// Goddard's rocket has 0.6 of its mass left at a height of 1.01283; here it is asked for that height. It burns at full thrust,
/// then between the limits on the singular arc, and coasts.
#[test]
fn goddards_rocket_burns_what_is_published() {
    let case = goddard();
    assert!((number(&case["height"]) - 1.01283).abs() < 1e-5);
    let [few, many] = [100, 200].map(|steps| {
        let (body, transfer) = rocket(&case, steps, number(&case["T"]));
        let plan = planned(&transfer).expect("a plan");
        let used = flown(&case, &body, &plan);
        assert!(plan.certificate.sufficient, "{:?}", plan.certificate);
        let force = |part: f64| plan.controls[(part * steps as f64) as usize].force.x;
        assert!(force(0.05) > 3.499, "{}", force(0.05));
        assert!(force(0.5).abs() < 1e-3, "{}", force(0.5));
        for step in steps / 5..3 * steps / 10 {
            let [before, now] = [step - 1, step].map(|step| plan.controls[step].force.x);
            assert!((1.8..2.8).contains(&now), "step {step}: {now}");
            assert!((now - before).abs() < 0.2, "step {step}: {before}, {now}");
        }
        used
    });
    let limit = many + (many - few) / 3.0;
    println!("{few} {many} {limit}");
    assert!((limit - 0.4).abs() < 2e-6, "{limit}");
}

#[test]
fn goddards_rocket_burns_what_ipopt_finds_in_the_same_steps() {
    let case = goddard();
    let steps = case["N"].as_u64().expect("N") as usize;
    let (body, transfer) = rocket(&case, steps, number(&case["T"]));
    let plan = planned(&transfer).expect("a plan");
    let masses = plan.masses(&transfer);
    let scaled = |(k, force): (usize, &Load)| {
        let middle = 0.5 * (masses[k] + masses[k + 1]);
        force.force.norm() * masses[0] / middle
    };
    let scaled = plan.controls.iter().enumerate().map(scaled).sum::<f64>();
    let minimum = plan.h * scaled / number(&case["exhaust_velocity"]);
    let reference = &case["fuel"];
    let dearer = minimum / number(&reference["minimum"]) - 1.0;
    let used = flown(&case, &body, &plan) / number(&reference["propellant"]) - 1.0;
    println!("{dearer:e} {used:e}");
    assert!(dearer.abs() < 1e-6, "{dearer:e}");
    assert!(used.abs() < 1e-5, "{used:e}");
}

/// The best duration is the one that another method has found.
#[test]
fn goddards_rocket_burns_more_in_other_durations() {
    let case = goddard();
    let best = number(&case["T"]);
    let cost = |duration: f64| {
        let (_, transfer) = rocket(&case, 100, duration);
        let plan = planned(&transfer);
        plan.unwrap_or_else(|error| panic!("{duration}: {error}"))
            .cost
    };
    let least = cost(best);
    for factor in [0.95, 0.98, 1.02, 1.05, 1.1] {
        let dearer = cost(factor * best) - least;
        assert!(dearer > 1e-4, "{factor}: {dearer:e}");
    }
}

#[test]
fn transfers_cost_what_ipopt_finds() {
    for case in references("drag", "transfers") {
        let body = body(&case);
        let [start, end] = ends(&case, &body);
        let steps = case["N"].as_u64().expect("N") as usize;
        let field = Central {
            gm: number(&case["gm"]),
        };
        let identity = Matrix3::identity();
        let actuation = Actuation::full(&identity, &identity).expect("an actuation");
        let h = number(&case["T"]) / steps as f64;
        let transfer = Transfer::new(body, field, h, steps, start, end, actuation)
            .expect("a transfer")
            .with_dynamics(Dynamics::Lgvi)
            .with_motion(Motion::Translation);
        let plan = planned(&transfer).expect("a plan");
        assert!(plan.certificate.sufficient);
        let dearer = plan.cost / number(&case["energy"]) - 1.0;
        println!("{}: {dearer:e}", case["name"]);
        assert!(dearer.abs() < 1e-7, "{}: {dearer:e}", case["name"]);
    }
}

/// By twelve thrusters that use propellant, between states that turn, up to a third of the mass flows out.
#[test]
fn thrusters_that_use_propellant_arrive_through_the_air() {
    let mut rng = Rng::with_seed(19);
    for case in references("drag", "transfers").iter().take(3) {
        let mut thrusters = pairs();
        for thruster in &mut thrusters {
            thruster.thrust = 12.0;
            thruster.exhaust_velocity = 6.0;
        }
        let mut any = || Vector3::from_fn(|_, _| rng.f64() - 0.5);
        let propellant = Propellant {
            mass: 1.2,
            inertia: None,
        };
        let thrusters = Thrusters::new(thrusters, propellant).expect("thrusters");
        let actuation = Actuation::thrusters(&thrusters, &[1.0; 12]).expect("an actuation");
        let body = body(case).with_thrusters(thrusters).expect("a body");
        let [start, end] = ends(case, &body).map(|state| {
            let rate = 0.3 * any();
            let turned = exp(&any());
            BodyState::from_velocities(&body, state.position, state.velocity(&body), turned, rate)
        });
        let field = Central {
            gm: number(&case["gm"]),
        };
        let h = number(&case["T"]) / 40.0;
        let transfer = Transfer::new(body.clone(), field, h, 40, start, end, actuation)
            .expect("a transfer")
            .with_dynamics(Dynamics::Lgvi)
            .with_constraints(&[limited(&[12.0; 12])]);
        let plan = planned(&transfer).expect("a plan");
        let system = System::new(vec![body], vec![Box::new(field)]);
        let method = Method::Lgvi(Rotor::default());
        let simulation = Simulation::new(system, vec![start], method, h);
        let mut simulation = simulation.expect("a simulation");
        for command in &plan.commands {
            simulation.set_thruster_commands(0, &command.as_slice()[..12]);
            simulation.advance(&[Load::default()]).expect("a step");
        }
        let mass = simulation.system().bodies()[0].mass();
        let reached = simulation.states()[0];
        let whole = number(&case["mass"]) / mass;
        let reached = BodyState {
            linear_momentum: whole * reached.linear_momentum,
            angular_momentum: whole * reached.angular_momentum,
            ..reached
        };
        let apart = miss(&end, &reached).amax();
        println!("{}: {apart:e}, {} of the mass", case["name"], 1.0 / whole);
        assert!(apart < 1e-7, "{}: {apart:e}", case["name"]);
    }
}

#[test]
fn shooting_has_no_drag() {
    let case = &references("drag", "transfers")[0];
    let body = body(case);
    let [start, end] = ends(case, &body);
    let identity = Matrix3::identity();
    let actuation = Actuation::full(&identity, &identity).expect("an actuation");
    let field = Central { gm: 1.0 };
    let transfer = Transfer::new(body, field, 0.1, 10, start, end, actuation).expect("a transfer");
    let settings = shooting::Settings::default();
    let refused = shooting::solve(&transfer, SVector::zeros(), &settings, |_| true);
    assert!(matches!(
        refused.err(),
        Some(ShootingError::Start(ExtremalError::Unsupported))
    ));
}
