//! Plans whose commands are the torques of reaction wheels.

use fastrand::Rng;
use lgvi_control::constraint::CommandLimit;
use lgvi_control::{
    Actuation, Constraint, Dynamics, FinalTime, FinalTimeError, Motion, NewtonSettings, Place,
    Plan, PlanError, SearchSettings, Start, Terminal, Transfer, TransferError, miss, search, solve,
    solve_final_time,
};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::wheels::{ReactionWheel, Wheels};
use lgvi_dynamics::{BodyState, Inertia, Load, Method, PointMass, RigidBody, Simulation, System};
use lgvi_lie::exp;
use nalgebra::{Matrix3, Vector3};

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
    for case in 0..40 {
        let count = 3 + case % 4;
        let wheels: Vec<_> = (0..count)
            .map(|_| ReactionWheel::new(vector(&mut rng, 1.0), 0.01 + 0.02 * rng.f64()))
            .collect();
        let [a, b, c] = [(); 3].map(|()| 0.1 + rng.f64());
        let body = body([b + c, c + a, a + b], Vec::new(), &wheels);
        let bias = if case % 3 == 0 { 0.0 } else { 1.5 };
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
        println!("{case} {} {:?}", plan.cost, plan.certificate.sufficient);
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
