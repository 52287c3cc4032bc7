//! Plans whose commands are the torques of reaction wheels.

use std::sync::Arc;

use fastrand::Rng;
use lgvi_control::constraint::{AngularRate, CommandLimit, LineOfSight};
use lgvi_control::{
    Actuation, Constraint, Dynamics, FinalTime, Minimum, MinimumTime, Motion, NewtonSettings,
    Place, Plan, PlanError, SearchSettings, Start, Terminal, TimeRange, Transfer, TransferError,
    miss, search, search_minimum_time, solve, solve_final_time, solve_minimum_time,
};
use lgvi_dynamics::drag::{Atmosphere, Drag};
use lgvi_dynamics::gravity::{Central, Uniform};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::wheels::{ReactionWheel, Wheels};
use lgvi_dynamics::{BodyState, Inertia, Load, Method, PointMass, RigidBody, Simulation, System};
use lgvi_lie::exp;
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;

use crate::fuel::{number, numbers, references, vector as three};

fn vector(rng: &mut Rng, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| size * (2.0 * rng.f64() - 1.0))
}

/// A body in orbit at a distance of 1, with a gravity gradient if it has points.
fn body(inertia: [f64; 3], points: Vec<PointMass>, wheels: &[ReactionWheel]) -> RigidBody {
    let inertia = Inertia::principal(inertia).expect("inertia");
    let wheels = Wheels::new(wheels.to_vec()).expect("wheels");
    RigidBody::new(1.0, inertia, points)
        .and_then(|body| body.with_wheels(wheels))
        .expect("a body")
}

const INERTIA: [f64; 3] = [1.0, 1.4, 1.9];

fn orthogonal() -> [ReactionWheel; 3] {
    [0, 1, 2].map(|axis| ReactionWheel::new(Vector3::ith(axis, 1.0), 0.02))
}

fn still(attitude: Matrix3<f64>) -> BodyState {
    BodyState {
        position: Vector3::x(),
        linear_momentum: Vector3::y(),
        attitude,
        angular_momentum: Vector3::zeros(),
    }
}

fn attitude_of(target: BodyState) -> Terminal {
    let target = Terminal::try_from(target).expect("a target");
    target.without(Place::Position)
}

const DURATION: f64 = 2.0;

fn transfer(body: RigidBody, n: usize, initial: BodyState, target: BodyState) -> Transfer {
    let wheels = body.wheels().expect("wheels");
    let weights = vec![1.0; wheels.wheels().len()];
    let actuation = Actuation::wheels(wheels, &weights).expect("an actuation");
    let (h, field) = (DURATION / n as f64, Central { gm: 1.0 });
    Transfer::new(body, field, h, n, initial, attitude_of(target), actuation)
        .expect("a transfer")
        .with_dynamics(Dynamics::Lgvi)
        .with_motion(Motion::Rotation)
}

fn planned(transfer: &Transfer) -> Result<Plan, PlanError> {
    solve(transfer, Start::Cold, &NewtonSettings::default(), |_| true)
}

/// The flight of the commands by the propagator's integrator: states and momenta of the wheels at `0 … N`.
fn flown(body: &RigidBody, plan: &Plan) -> Vec<(BodyState, Vec<f64>)> {
    let count = body.wheels().expect("wheels").wheels().len();
    let system = System::new(vec![body.clone()], vec![Box::new(Central { gm: 1.0 })]);
    let method = Method::Lgvi(Rotor::default());
    let mut simulation =
        Simulation::new(system, vec![plan.states[0]], method, plan.h).expect("a simulation");
    let now = |simulation: &Simulation| {
        let wheels = simulation.system().bodies()[0].wheels().expect("wheels");
        let momenta = wheels.states().iter().map(|wheel| wheel.momentum);
        (simulation.states()[0], momenta.collect())
    };
    let mut all = vec![now(&simulation)];
    for command in &plan.commands {
        simulation.set_wheel_commands(0, &command.as_slice()[..count]);
        simulation.advance(&[Load::default()]).expect("a step");
        all.push(now(&simulation));
    }
    all
}

/// Asserts that the propagator flies a plan to its states and momenta.
fn assert_flown(body: &RigidBody, transfer: &Transfer, plan: &Plan) {
    let momenta = plan.wheel_momenta(transfer);
    for (k, (state, wheels)) in flown(body, plan).iter().enumerate() {
        let apart = miss(&plan.states[k], state).amax();
        assert!(apart < 1e-13, "step {k}: {apart:e}");
        for (planned, flown) in momenta[k].iter().zip(wheels) {
            assert!(
                (planned - flown).abs() < 1e-13,
                "step {k}: {planned}, {flown}"
            );
        }
    }
}

fn with_momenta(mut body: RigidBody, momenta: &[f64]) -> RigidBody {
    let wheels = body.wheels_mut().expect("wheels");
    let mut states = wheels.states().to_vec();
    for (state, momentum) in states.iter_mut().zip(momenta) {
        state.momentum = *momentum;
    }
    wheels.set_states(&states);
    body
}

#[test]
fn random_slews_are_planned_and_flown() {
    let mut rng = Rng::with_seed(61);
    for case in 0..80 {
        let count = 3 + case % 4;
        let wheels: Vec<_> = (0..count)
            .map(|_| ReactionWheel::new(vector(&mut rng, 1.0), 0.01 + 0.02 * rng.f64()))
            .collect();
        let [a, b, c] = [(); 3].map(|()| 0.1 + rng.f64());
        let body = body([b + c, c + a, a + b], Vec::new(), &wheels);
        let bias = [0.0, 1.5, 5.0, 10.0][case / 4 % 4];
        let momenta: Vec<_> = (0..count).map(|_| bias * (2.0 * rng.f64() - 1.0)).collect();
        let body = with_momenta(body, &momenta);
        let mut initial = still(exp(&vector(&mut rng, 3.0)));
        let mut target = still(exp(&vector(&mut rng, 3.0)));
        if case % 2 == 1 {
            initial.angular_momentum = vector(&mut rng, 0.5);
            target.angular_momentum = vector(&mut rng, 0.5);
        }
        let transfer = transfer(body.clone(), 100, initial, target);
        let plan = planned(&transfer).unwrap_or_else(|error| panic!("case {case}: {error}"));
        assert!(plan.certificate.terminal < 1e-12, "{:?}", plan.certificate);
        assert!(
            plan.certificate.stationarity < 1e-8,
            "{:?}",
            plan.certificate
        );
        assert!(plan.certificate.sufficient);
        assert_flown(&body, &transfer, &plan);
        let end = plan.states.last().expect("an end");
        let missed = miss(&target, end).rows(6, 6).amax();
        assert!(missed < 1e-11, "case {case}: {missed:e}");
        // The total angular momentum is constant.
        let momenta = plan.wheel_momenta(&transfer);
        let total = |k: usize| {
            let stored = wheels.iter().zip(momenta[k].iter());
            let stored: Vector3<f64> = stored.map(|(one, h)| *h * one.axis.normalize()).sum();
            plan.states[k].attitude * (plan.states[k].angular_momentum + stored)
        };
        for k in 0..=100 {
            let drift = (total(k) - total(0)).norm();
            assert!(
                drift < 2e-14 * (1.0 + total(0).norm()),
                "case {case}, {k}: {drift:e}"
            );
        }
    }
}

/// About a principal axis nothing is gyroscopic, and rest to rest `Π̇ = −Σ a u` alone remains: the cost is that of a moment,
/// `6 (J φ)²/T³` in the limit. In steps of a turn θ, `J tan θ = h Π` takes the place of `J sin θ = h Π`, of second order in h.
#[test]
fn a_turn_about_a_principal_axis_costs_that_of_a_moment() {
    let angle = 2.0;
    let exact = 6.0 * (INERTIA[2] - 0.02) * (INERTIA[2] - 0.02) * angle * angle
        / (DURATION * DURATION * DURATION);
    let (initial, target) = (
        still(Matrix3::identity()),
        still(exp(&Vector3::new(0.0, 0.0, angle))),
    );
    let errors = [100, 200].map(|n| {
        let by_wheels = transfer(body(INERTIA, Vec::new(), &orthogonal()), n, initial, target);
        let rest = Inertia::principal(INERTIA.map(|moment| moment - 0.02)).expect("inertia");
        let rigid = RigidBody::new(1.0, rest, Vec::new()).expect("a body");
        let unit = Matrix3::identity();
        let actuation = Actuation::full(&unit, &unit).expect("an actuation");
        let (h, field) = (DURATION / n as f64, Central { gm: 1.0 });
        let target = attitude_of(target);
        let by_moment = Transfer::new(rigid, field, h, n, initial, target, actuation)
            .expect("a transfer")
            .with_dynamics(Dynamics::Lgvi)
            .with_motion(Motion::Rotation);
        let [wheels, moment] = [by_wheels, by_moment].map(|transfer| {
            let plan = planned(&transfer).expect("a plan");
            let off = plan.commands.iter().map(|u| u.fixed_rows::<2>(0).amax());
            assert!(transfer.target().condition(Place::Position).is_none());
            assert!(plan.controls[0].moment.z > 0.0 && off.fold(0.0, f64::max) < 1e-9);
            plan.cost
        });
        [wheels / exact - 1.0, wheels / moment - 1.0]
    });
    for (coarse, fine) in errors[0].iter().zip(&errors[1]) {
        assert!(coarse.abs() < 1e-2, "{coarse:e}");
        let order = (coarse / fine).abs().log2();
        assert!((order - 2.0).abs() < 0.05, "{coarse:e}, {fine:e}");
    }
}

/// Two points of mass.
fn pair() -> Vec<PointMass> {
    let point = |position: Vector3<f64>| PointMass {
        mass: 0.5,
        position,
    };
    let along = Vector3::new(0.3, 0.1, 0.0);
    vec![point(along), point(-along)]
}

/// Drag slows the body down on its orbit, along which the gravity gradient turns it.
#[test]
fn a_body_in_air_is_turned_by_its_wheels() {
    let air = Atmosphere::new(
        Vector3::zeros(),
        Vector3::new(0.0, 0.1, 0.2),
        0.9,
        &[[0.0, 0.6]],
        0.2,
    );
    let drag = Drag::new(Arc::new(air.expect("an atmosphere")), 0.5).expect("drag");
    let body = body(INERTIA, pair(), &orthogonal()).with_drag(drag);
    let target = still(exp(&Vector3::new(0.4, -0.7, 0.5)));
    let transfer = transfer(body.clone(), 50, still(Matrix3::identity()), target);
    let plan = planned(&transfer).expect("a plan");
    assert_flown(&body, &transfer, &plan);
    let [start, end] = [0, 50].map(|k| &plan.states[k]);
    let energy = |state: &BodyState| {
        0.5 * state.linear_momentum.norm_squared() - 1.0 / state.position.norm()
    };
    let lost = energy(start) - energy(end);
    assert!(lost > 0.1, "{lost}");
}

/// Points of mass feel a gravity gradient, and turned elsewhere they are pulled elsewhere.
#[test]
fn gravity_that_couples_attitude_and_orbit_is_planned_for() {
    let body = body([0.5, 0.6, 0.7], pair(), &orthogonal());
    let body = with_momenta(body, &[0.3, -0.2, 0.1]);
    let target = still(exp(&Vector3::new(0.4, -1.0, 1.5)));
    let transfer = transfer(body.clone(), 100, still(Matrix3::identity()), target);
    let plan = planned(&transfer).expect("a plan");
    assert_flown(&body, &transfer, &plan);
    let end = plan.states.last().expect("an end");
    assert!(miss(&target, end).rows(6, 6).amax() < 1e-11);
    let idle = Plan {
        commands: vec![lgvi_control::Command::zeros(); 100],
        ..plan.clone()
    };
    let (idle, _) = flown(&body, &idle).pop().expect("an end");
    let apart = (idle.position - end.position).norm();
    assert!(apart > 1e-3, "{apart:e}");
}

#[test]
fn torques_keep_within_limits() {
    let mut rng = Rng::with_seed(62);
    for case in 0..8 {
        let count = 3 + case % 3;
        let wheels: Vec<_> = (0..count)
            .map(|_| ReactionWheel::new(vector(&mut rng, 1.0), 0.01))
            .collect();
        let body = body(INERTIA, Vec::new(), &wheels);
        let momenta: Vec<_> = (0..count).map(|_| 2.0 * rng.f64() - 1.0).collect();
        let body = with_momenta(body, &momenta);
        let target = still(exp(&vector(&mut rng, 2.0)));
        let free = transfer(body.clone(), 80, still(Matrix3::identity()), target);
        let plan = planned(&free).expect("a plan");
        let largest = plan.commands.iter().map(|u| u.amax()).fold(0.0, f64::max);
        let limit = 0.85 * largest;
        let limits = CommandLimit::new(&vec![limit; count]).expect("limits");
        let limited = free.with_constraints(&[Constraint::commands(limits)]);
        let tight = planned(&limited).unwrap_or_else(|error| panic!("case {case}: {error}"));
        assert!(tight.cost > plan.cost);
        let largest = tight.commands.iter().map(|u| u.amax()).fold(0.0, f64::max);
        assert!(
            (largest / limit - 1.0).abs() < 1e-6,
            "{largest} for {limit}"
        );
        assert_flown(&body, &limited, &tight);
        let end = tight.states.last().expect("an end");
        assert!(miss(&target, end).rows(6, 6).amax() < 1e-11);
    }
}

/// The rest of a plan, from the momenta that the wheels have by then, is the plan of the rest.
#[test]
fn the_rest_of_a_plan_begins_with_the_momenta_of_then() {
    let body = with_momenta(body(INERTIA, Vec::new(), &orthogonal()), &[0.5, 0.0, -0.4]);
    let target = still(exp(&Vector3::new(1.0, 0.5, -0.7)));
    let whole = transfer(body, 60, still(Matrix3::identity()), target);
    let plan = planned(&whole).expect("a plan");
    let momenta = plan.wheel_momenta(&whole);
    let rest = whole
        .remaining(20, plan.states[20])
        .expect("enough steps")
        .with_wheel_momenta(&momenta[20].as_slice()[..3])
        .expect("three momenta");
    let guess = plan.remaining(&whole, 20).expect("enough steps");
    let settings = NewtonSettings::default();
    for start in [Start::Warm(&guess), Start::Cold] {
        let found = solve(&rest, start, &settings, |_| true).expect("a plan");
        for (one, other) in found.commands.iter().zip(&plan.commands[20..]) {
            assert!((one - other).amax() < 1e-7, "{one} for {other}");
        }
    }
}

/// A tolerance below what rounding leaves is met as well as rounding allows.
#[test]
fn plans_to_rounding_are_accepted() {
    let body = with_momenta(body(INERTIA, Vec::new(), &orthogonal()), &[9.0, 5.0, -7.0]);
    let target = still(exp(&Vector3::new(1.0, 0.5, -0.7)));
    let transfer = transfer(body, 2000, still(Matrix3::identity()), target);
    let settings = NewtonSettings {
        violation: 1e-16,
        ..NewtonSettings::default()
    };
    let plan = solve(&transfer, Start::Cold, &settings, |_| true).expect("a plan");
    let miss = plan.certificate.terminal;
    println!("{miss:e}");
    assert!(miss < 1e-12, "{miss:e}");
}

/// A search that is stopped returns what it has or says that it was stopped.
#[test]
fn a_search_ends_when_it_is_told_to() {
    let body = with_momenta(body(INERTIA, Vec::new(), &orthogonal()), &[1.0, 0.3, -0.4]);
    let target = still(exp(&Vector3::new(2.0, 0.5, -1.7)));
    let transfer = transfer(body, 60, still(Matrix3::identity()), target);
    let settings = SearchSettings {
        starts: 12,
        ..SearchSettings::default()
    };
    for allowed in [1, 25] {
        let mut seen = 0;
        let found = search(&transfer, &settings, |_| {
            seen += 1;
            seen < allowed
        });
        assert!(seen <= allowed, "{seen} calls, {allowed} allowed");
        match found {
            Ok(minima) => assert!(!minima.is_empty()),
            Err(error) => assert!(matches!(error, PlanError::Stopped { .. }), "{error}"),
        }
    }
}

/// The minima of a search: more than one, the first no dearer than the plan of a cold start.
fn minima_of(transfer: &Transfer, plan: &Plan) -> Vec<Minimum> {
    let settings = SearchSettings {
        starts: 12,
        seed: 1,
        newton: NewtonSettings::default(),
    };
    let minima = search(transfer, &settings, |_| true).expect("minima");
    assert!(minima[0].plan.cost <= plan.cost * (1.0 + 1e-6));
    assert!(minima.len() > 1, "turns the other way round");
    minima
}

#[test]
fn a_search_finds_the_plan_of_a_cold_start_or_a_cheaper_one() {
    let body = with_momenta(body(INERTIA, Vec::new(), &orthogonal()), &[1.0, 0.3, -0.4]);
    let target = still(exp(&Vector3::new(2.0, 0.5, -1.7)));
    let transfer = transfer(body.clone(), 60, still(Matrix3::identity()), target);
    let plan = planned(&transfer).expect("a plan");
    for minimum in &minima_of(&transfer, &plan) {
        assert_flown(&body, &transfer, &minimum.plan);
    }
}

#[test]
fn what_wheels_cannot_do_is_refused() {
    let target = still(exp(&Vector3::new(1.0, 0.5, -0.7)));
    let wheels = orthogonal();
    let plain = body(INERTIA, Vec::new(), &wheels);
    let transfer_of = |body: RigidBody| transfer(body, 60, still(Matrix3::identity()), target);
    let transfer = transfer_of(plain.clone());
    for (dynamics, motion) in [
        (Dynamics::Lgvi, Motion::Full),
        (Dynamics::LieEuler, Motion::Rotation),
    ] {
        let other = transfer.clone().with_dynamics(dynamics).with_motion(motion);
        let refused = planned(&other);
        assert_eq!(refused, Err(PlanError::WheelsDo { dynamics, motion }));
    }
    let unit = Matrix3::identity();
    let moment = Actuation::full(&unit, &unit).expect("an actuation");
    let at = still(unit);
    let field = Central { gm: 1.0 };
    let refused = Transfer::new(plain.clone(), field, 0.1, 9, at, at, moment);
    let (wheels_of, commands) = (3, 0);
    let expected = TransferError::Wheels {
        wheels: wheels_of,
        commands,
    };
    assert_eq!(refused.err(), Some(expected));
    let [x, y, z] = orthogonal();
    let others = body(INERTIA, Vec::new(), &[x, z, y]);
    let others = Actuation::wheels(others.wheels().expect("wheels"), &[1.0; 3]);
    let others = others.expect("an actuation");
    let refused = Transfer::new(plain.clone(), field, 0.1, 9, at, at, others);
    assert_eq!(refused.err(), Some(TransferError::WheelAxis { wheel: 1 }));
    for momenta in [&[1.0, 2.0][..], &[1.0, f64::NAN, 0.0]] {
        let refused = transfer_of(plain.clone()).with_wheel_momenta(momenta);
        let found = matches!(refused, Err(TransferError::WheelMomenta { wheels: 3, .. }));
        assert!(found, "{momenta:?}");
    }
    let mut worn = orthogonal();
    worn[2].viscous_friction = 1e-3;
    let worn = body(INERTIA, Vec::new(), &worn);
    let actuation = Actuation::wheels(worn.wheels().expect("wheels"), &[1.0; 3]);
    let actuation = actuation.expect("an actuation");
    let refused = Transfer::new(worn, field, 0.1, 9, at, at, actuation);
    assert_eq!(refused.err(), Some(TransferError::WheelFriction));
    let refused = Actuation::wheels(plain.wheels().expect("wheels"), &[1.0]);
    let error = refused.expect_err("weights are missing").to_string();
    assert_eq!(error, "1 weights for 3 wheels, expected one for each");

    // Two wheels cannot bring a body to rest that has momentum about another axis.
    let two = with_momenta(body(INERTIA, Vec::new(), &wheels[..2]), &[0.5, 0.5]);
    let refused = planned(&transfer_of(two));
    assert!(
        matches!(refused, Err(PlanError::NotConverged { .. })),
        "{refused:?}"
    );
}

/// In units of time and angular momentum that differ by powers of two, a plan has the same bits.
#[test]
fn plans_are_the_same_in_any_units() {
    let plan = |time: f64, momentum: f64, weight: f64| {
        let wheels = [0, 1, 2].map(|axis| {
            ReactionWheel::new(
                Vector3::new(0.2, 0.1, 0.3) + Vector3::ith(axis, 1.0),
                0.02 * time * momentum,
            )
        });
        let body = body(
            INERTIA.map(|moment| moment * time * momentum),
            Vec::new(),
            &wheels,
        );
        let body = with_momenta(body, &[0.5 * momentum, -0.3 * momentum, 0.1 * momentum]);
        let mut initial = still(Matrix3::identity());
        initial.linear_momentum /= time;
        initial.angular_momentum = Vector3::new(0.1, 0.2, -0.1) * momentum;
        let target = still(exp(&Vector3::new(0.4, -1.0, 1.5)));
        let actuation = Actuation::wheels(body.wheels().expect("wheels"), &[weight; 3]);
        let h = DURATION / 50.0 * time;
        let field = Central {
            gm: 1.0 / (time * time),
        };
        let actuation = actuation.expect("an actuation");
        let transfer = Transfer::new(body, field, h, 50, initial, attitude_of(target), actuation)
            .expect("a transfer")
            .with_dynamics(Dynamics::Lgvi)
            .with_motion(Motion::Rotation);
        planned(&transfer).expect("a plan")
    };
    let own = plan(1.0, 1.0, 1.0);
    let other = plan(8.0, 32.0, 0.25);
    for (one, other) in own.commands.iter().zip(&other.commands) {
        assert_eq!(*one * 4.0, *other);
    }
    assert_eq!(own.certificate, other.certificate);
}

/// Without momentum, two wheels turn a body about the third axis by turns about the others.
#[test]
fn two_wheels_without_momentum_turn_a_body_to_any_attitude() {
    let wheels = orthogonal();
    let body = body(INERTIA, Vec::new(), &wheels[..2]);
    let mut rng = Rng::with_seed(63);
    for case in 0..6 {
        let target = still(exp(&vector(&mut rng, 1.5)));
        let transfer = transfer(body.clone(), 100, still(Matrix3::identity()), target);
        let plan = planned(&transfer).unwrap_or_else(|error| panic!("case {case}: {error}"));
        assert_flown(&body, &transfer, &plan);
        let end = plan.states.last().expect("an end");
        let missed = miss(&target, end).rows(6, 6).amax();
        assert!(missed < 1e-10, "case {case}: {missed:e}");
    }
}

/// `Π` is the momentum of the body alone, so that its rate is `J⁻¹ Π` whatever the wheels store.
#[test]
fn the_rate_of_a_body_with_wheels_keeps_its_limit() {
    let body = with_momenta(body(INERTIA, Vec::new(), &orthogonal()), &[0.3, -0.2, 0.1]);
    let target = still(exp(&Vector3::new(1.0, -0.6, 0.4)));
    let free = transfer(body.clone(), 60, still(Matrix3::identity()), target);
    let fastest = |plan: &Plan| {
        let rates = plan.states.iter();
        let rates = rates.map(|state| state.angular_velocity(&body).norm());
        rates.fold(0.0, f64::max)
    };
    let loose = planned(&free).expect("a plan");
    let limit = 0.8 * fastest(&loose);
    let rate = AngularRate::new(limit, body.inertia()).expect("a limit");
    let bound = free.with_constraints(&[Constraint::state(rate)]);
    let plan = planned(&bound).expect("a plan");
    assert!((fastest(&plan) / limit - 1.0).abs() < 1e-8);
    assert!(plan.cost > loose.cost && plan.certificate.sufficient);
    assert_flown(&body, &bound, &plan);
}

/// The greatest speed of any wheel by which its motor goes, in parts of its limit, or of 1 where it has none.
fn fastest(body: &RigidBody, transfer: &Transfer, plan: &Plan) -> f64 {
    let (mut wheels, inverse) = (
        body.wheels().expect("wheels").clone(),
        body.inertia().inverse(),
    );
    let momenta = plan.wheel_momenta(transfer);
    let mut most = 0.0_f64;
    for (k, command) in plan.commands.iter().enumerate() {
        let mut states = wheels.states().to_vec();
        for (state, momentum) in states.iter_mut().zip(&momenta[k]) {
            state.momentum = *momentum;
        }
        wheels.set_states(&states);
        let rate = plan.states[k].angular_velocity(body);
        for (index, wheel) in wheels.wheels().iter().enumerate() {
            let per_torque = wheel.inertia.recip() + wheel.axis.dot(&(inverse * wheel.axis));
            let speed = wheels.speed(index, &rate) + plan.h * per_torque * command[index];
            let limit = if wheel.max_speed.is_finite() {
                wheel.max_speed
            } else {
                1.0
            };
            most = most.max(speed.abs() / limit);
        }
    }
    most
}

/// Four wheels on the edges of a pyramid, with momenta at the start.
fn pyramid(max_speed: f64) -> RigidBody {
    let wheel = |x: f64, y: f64| ReactionWheel {
        max_speed,
        ..ReactionWheel::new(Vector3::new(x, y, 1.0), 0.02)
    };
    let wheels = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)].map(|(x, y)| wheel(x, y));
    let body = body(INERTIA, Vec::new(), &wheels);
    with_momenta(body, &[0.4, -0.3, 0.2, 0.1])
}

/// Each minimum is solved again from itself, and a warm start has its speeds.
#[test]
fn minima_under_limits_of_speed_are_found_by_a_search() {
    let body = pyramid(80.0);
    let target = still(exp(&Vector3::new(2.0, 0.5, -1.7)));
    let transfer = transfer(body.clone(), 60, still(Matrix3::identity()), target);
    let plan = planned(&transfer).expect("a plan");
    for minimum in &minima_of(&transfer, &plan) {
        assert!(fastest(&body, &transfer, &minimum.plan) < 1.0);
        assert_flown(&body, &transfer, &minimum.plan);
    }
    let mut iterations = 0;
    let again = solve(
        &transfer,
        Start::Warm(&plan),
        &NewtonSettings::default(),
        |_| {
            iterations += 1;
            true
        },
    );
    let again = again.expect("a plan");
    assert!((again.cost / plan.cost - 1.0).abs() < 1e-7);
    assert!(iterations < 20, "{iterations}");
}

/// A sight that the slew without it keeps changes nothing, though the momenta of the wheels take the place of the position.
#[test]
fn a_sight_beside_limits_of_speed_is_seen_from_where_the_body_is() {
    let target = still(exp(&Vector3::new(1.0, 0.8, -0.9)));
    let limited = transfer(pyramid(50.0), 60, still(Matrix3::identity()), target);
    let plan = planned(&limited).expect("a plan");
    let point = Vector3::new(1.5, 1.0, 0.3);
    let angles = plan.states.iter().map(|state| {
        let towards = (point - state.position).normalize();
        libm::acos(towards.dot(&(state.attitude * Vector3::y())))
    });
    let largest = angles.fold(0.0, f64::max);
    let sight = |half_angle: f64| {
        let sight = LineOfSight::new(Vector3::y(), point, half_angle).expect("a sight");
        let seen = limited
            .clone()
            .with_constraints(&[Constraint::state(sight)]);
        planned(&seen).expect("a plan")
    };
    assert!((sight(largest + 0.05).cost / plan.cost - 1.0).abs() < 1e-6);
    let kept = sight(largest - 0.05);
    assert!(kept.cost > plan.cost && kept.certificate.inequality < 1e-8);
}

/// Wheels of any number and place, with momenta at the start, that a plan without limits takes too fast.
#[test]
fn speeds_keep_within_their_limits() {
    let mut rng = Rng::with_seed(64);
    let mut fixed = 0;
    for case in 0..40 {
        let count = 3 + case % 4;
        let mut wheels: Vec<_> = (0..count)
            .map(|_| ReactionWheel::new(vector(&mut rng, 1.0), 0.01 + 0.02 * rng.f64()))
            .collect();
        let momenta: Vec<_> = (0..count).map(|_| 0.2 * (2.0 * rng.f64() - 1.0)).collect();
        let (initial, target) = (
            still(exp(&vector(&mut rng, 3.0))),
            still(exp(&vector(&mut rng, 2.0))),
        );
        // Of every other four, gravity couples attitude and orbit.
        let points = if case % 8 < 4 { Vec::new() } else { pair() };
        let unlimited = with_momenta(body(INERTIA, points.clone(), &wheels), &momenta);
        let free = transfer(unlimited.clone(), 100, initial, target);
        let loose = planned(&free).unwrap_or_else(|error| panic!("case {case}: {error}"));
        let limit = 0.85 * fastest(&unlimited, &free, &loose);
        for wheel in &mut wheels {
            wheel.max_speed = limit;
        }
        let body = with_momenta(body(INERTIA, points, &wheels), &momenta);
        let bound = transfer(body.clone(), 100, initial, target);
        let plan = match planned(&bound) {
            Ok(plan) => plan,
            // What three wheels store at the end follows from what they store at the start.
            Err(PlanError::WheelSpeed {
                step: 99,
                speed,
                limit: kept,
                ..
            }) if count == 3 && kept == limit && speed > limit => {
                fixed += 1;
                continue;
            }
            Err(error) => panic!("case {case}: {error}"),
        };
        assert!(plan.cost > loose.cost, "case {case}");
        assert!(plan.certificate.sufficient && plan.certificate.stationarity < 1e-7);
        let most = fastest(&body, &bound, &plan);
        assert!(most < 1.0 && most > 1.0 - 1e-7, "case {case}: {most}");
        assert_flown(&body, &bound, &plan);
        let end = plan.states.last().expect("an end");
        let missed = miss(&target, end).rows(6, 6).amax();
        assert!(missed < 1e-11, "case {case}: {missed:e}");
    }
    assert!((1..4).contains(&fixed), "{fixed}");
}

/// A case of `wheels.py` with these limits of speeds and torques.
fn of_ipopt(case: &Value, max_speed: f64, max_torque: f64) -> Transfer {
    let own = |wheel: &Value| ReactionWheel {
        max_speed,
        ..ReactionWheel::new(three(&wheel["axis"]), number(&wheel["inertia"]))
    };
    let wheels: Vec<_> = case["wheels"]
        .as_array()
        .map_or_else(Vec::new, |wheels| wheels.iter().map(own).collect());
    let inertia = <[f64; 3]>::try_from(numbers(&case["inertia"])).expect("three");
    let body = with_momenta(
        body(inertia, Vec::new(), &wheels),
        &numbers(&case["momenta"]),
    );
    let actuation = body
        .wheels()
        .map(|wheels| Actuation::wheels(wheels, &numbers(&case["weights"])));
    let actuation = actuation.expect("wheels").expect("an actuation");
    let target = attitude_of(still(exp(&three(&case["turn"]))));
    let (h, initial) = (DURATION / 40.0, still(Matrix3::identity()));
    let field = Uniform {
        acceleration: Vector3::zeros(),
    };
    let limits = vec![max_torque; wheels.len()];
    let limit = CommandLimit::new(&limits).expect("limits");
    Transfer::new(body, field, h, 40, initial, target, actuation)
        .expect("a transfer")
        .with_dynamics(Dynamics::Lgvi)
        .with_motion(Motion::Rotation)
        .with_constraints(&[Constraint::commands(limit)])
}

/// The costs of `wheels.py`, with and without limits, or less where IPOPT has found a dearer minimum.
#[test]
fn limits_of_speed_cost_what_ipopt_finds() {
    let mut cheaper = 0;
    for (at, case) in references("wheels", "cases").iter().enumerate() {
        for (limit, cost) in [(f64::INFINITY, "free"), (number(&case["limit"]), "cost")] {
            let transfer = of_ipopt(case, limit, f64::INFINITY);
            let plan = planned(&transfer).unwrap_or_else(|error| panic!("case {at}: {error}"));
            let error = plan.cost / number(&case[cost]) - 1.0;
            assert!(error < 1e-7, "case {at}: {error:e}");
            cheaper += usize::from(error < -1e-7);
        }
    }
    assert!(cheaper < 3, "{cheaper}");
}

/// The derivative of the cost by the final time, along an orbit with gravity gradient too, and where speeds are at their limits.
#[test]
fn the_slope_of_the_cost_is_that_of_neighboring_plans() {
    let mut rng = Rng::with_seed(67);
    for case in 0..8 {
        let count = 3 + case % 4;
        let mut wheels: Vec<_> = (0..count)
            .map(|_| ReactionWheel::new(vector(&mut rng, 1.0), 0.01 + 0.02 * rng.f64()))
            .collect();
        let momenta: Vec<_> = (0..count).map(|_| 0.2 * (2.0 * rng.f64() - 1.0)).collect();
        let target = still(exp(&vector(&mut rng, 1.5)));
        // A gravity gradient, of points so near each other that the orbit hardly depends on the attitude.
        let mut points = if case < 4 { Vec::new() } else { pair() };
        for point in &mut points {
            point.position *= 0.03;
        }
        let of = |wheels: &[ReactionWheel]| {
            let body = with_momenta(body(INERTIA, points.clone(), wheels), &momenta);
            transfer(body, 50, still(Matrix3::identity()), target)
        };
        let free = of(&wheels);
        let plan = planned(&free).expect("a plan");
        let unlimited = with_momenta(body(INERTIA, points.clone(), &wheels), &momenta);
        let limit = 0.9 * fastest(&unlimited, &free, &plan);
        let bound = count > 3;
        if bound {
            wheels.iter_mut().for_each(|wheel| wheel.max_speed = limit);
        }
        let transfer = of(&wheels);
        let settings = NewtonSettings::default();
        let at = |final_time: f64| {
            let time = FinalTime {
                shortest: final_time,
                longest: final_time,
                weight: 0.0,
                tolerance: 1e-9,
            };
            solve_final_time(&transfer, &time, Start::Cold, &settings, |_| true)
                .unwrap_or_else(|error| panic!("case {case}: {error}"))
        };
        let (exact, step) = (at(DURATION), 1e-3);
        let cost = |final_time: f64| at(final_time).plan.cost;
        let difference = (8.0 * (cost(DURATION + step) - cost(DURATION - step))
            - (cost(DURATION + 2.0 * step) - cost(DURATION - 2.0 * step)))
            / (12.0 * step);
        let error = (exact.slope / difference - 1.0).abs();
        println!("case {case}: {} for {difference}: {error:e}", exact.slope);
        assert!(exact.plan.cost > plan.cost || !bound);
        assert!(error < 1e-6, "case {case}: {error:e}");
    }
}

const RANGE: TimeRange = TimeRange {
    shortest: 0.1,
    longest: 10.0,
    tolerance: 1e-6,
};

fn shortest(transfer: &Transfer) -> MinimumTime {
    let settings = NewtonSettings::default();
    let found = solve_minimum_time(transfer, &RANGE, Start::Cold, &settings, |_| true);
    let found = found.unwrap_or_else(|error| panic!("{error}"));
    println!(
        "{} above {} in {}",
        found.final_time, found.lower_bound, found.solves
    );
    assert!(found.lower_bound <= found.final_time);
    assert!(found.plan.certificate.terminal < 1e-11 && found.plan.certificate.inequality < 1e-8);
    found
}

/// The shortest times of `wheels.py`, with and without limits of speed; one is a longer local minimum.
#[test]
fn wheels_turn_as_fast_as_by_ipopt() {
    let (mut longer, mut followed) = (0, 0);
    for (at, case) in references("wheels", "cases").iter().enumerate() {
        let (limit, torque) = (number(&case["limit"]), number(&case["torque"]));
        for (limit, time) in [(f64::INFINITY, "free_time"), (limit, "time")] {
            let transfer = of_ipopt(case, limit, torque);
            let found = shortest(&transfer);
            let error = found.final_time / number(&case[time]) - 1.0;
            println!("case {at}, {time}: {error:e}");
            assert!(
                error > -5e-6 && error < 3e-3,
                "case {at}, {time}: {error:e}"
            );
            longer += usize::from(error > 5e-6);
            // A plan to begin with, the step among the unknowns, and the plan of that time.
            followed += usize::from(found.solves > 3);
        }
    }
    assert!(longer < 2 && followed < 2, "{longer}, {followed}");
}

/// A turn about a principal axis by a wheel along it. The speed `h (1/I + 1/J)` of the wheel is within its limit: the torque `u`
/// takes the body to the momentum `h`, and back, and it coasts in between, `T = θ J/h + h/u`.
#[test]
fn a_wheel_at_its_limit_of_speed_coasts() {
    let (angle, torque, inertia) = (1.2, 2.0, 0.02);
    for (limit, n) in [(f64::INFINITY, 40), (60.0, 40), (30.0, 40), (30.0, 80)] {
        let wheels = orthogonal().map(|wheel| ReactionWheel {
            max_speed: limit,
            max_torque: torque,
            ..wheel
        });
        let body = body([1.0; 3], Vec::new(), &wheels);
        let own = body.inertia().matrix()[(2, 2)];
        let most = (limit / (1.0 / inertia + 1.0 / own)).min((angle * own * torque).sqrt());
        let exact = angle * own / most + most / torque;
        let target = still(exp(&(angle * Vector3::z())));
        let free = transfer(body, n, still(Matrix3::identity()), target);
        // Without a torque about other axes, the turn about this one is that of the least time.
        let limits = CommandLimit::new(&[1e-6 * torque, 1e-6 * torque, torque]).expect("limits");
        let found = shortest(&free.with_constraints(&[Constraint::commands(limits)]));
        let error = found.final_time / exact - 1.0;
        // As much as the steps of the LGVI, and a switch within a step, cost.
        let steps = 3.0 / (n * n) as f64;
        println!("{limit} in {n}: {error:e}");
        assert!(error.abs() < steps, "{limit} in {n}: {error:e}");
    }
}

#[test]
fn a_search_for_the_shortest_time_by_wheels_is_no_slower() {
    let case = &references("wheels", "cases")[0];
    let transfer = of_ipopt(case, f64::INFINITY, number(&case["torque"]));
    let settings = SearchSettings {
        starts: 4,
        ..SearchSettings::default()
    };
    let found = search_minimum_time(&transfer, &RANGE, &settings, |_| true).expect("a plan");
    let error = found.final_time / number(&case["free_time"]) - 1.0;
    println!(
        "{} above {}: {error:e}",
        found.final_time, found.lower_bound
    );
    assert!(error < 2e-6, "{error:e}");
    assert_eq!(found.plan.h, found.final_time / 40.0);
}
