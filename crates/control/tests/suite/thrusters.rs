//! Plans whose commands are thrusters: fixed to the body, one-sided, and limited.

use fastrand::Rng;
use lgvi_control::constraint::CommandLimit;
use lgvi_control::{
    Actuation, Constraint, Dynamics, NewtonSettings, Plan, PlanError, SearchSettings, Start,
    Transfer, miss, search, solve,
};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::thrusters::{Propellant, Thruster, Thrusters};
use lgvi_dynamics::{BodyState, Inertia, Load, Method, RigidBody, Simulation, System};
use lgvi_lie::exp;
use nalgebra::Vector3;

fn vector(rng: &mut Rng, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| size * (2.0 * rng.f64() - 1.0))
}

fn body() -> RigidBody {
    let inertia = Inertia::principal([1.0, 1.4, 1.9]).expect("inertia");
    RigidBody::new(2.0, inertia, Vec::new()).expect("a body")
}

/// Two thrusters on each axis through a point off the center of mass push to both sides.
pub(crate) fn pairs() -> Vec<Thruster> {
    let mut all = Vec::new();
    for axis in 0..3 {
        for side in [1.0, -1.0] {
            let arm = side * Vector3::ith((axis + 1) % 3, 0.8);
            for sign in [1.0, -1.0] {
                all.push(Thruster::new(arm, sign * Vector3::ith(axis, 1.0), 1.0));
            }
        }
    }
    all
}

const N: usize = 60;

/// A transfer near a center that attracts, in 2 units of time.
pub(crate) fn transfer(initial: BodyState, target: BodyState, actuation: Actuation) -> Transfer {
    let (h, field) = (2.0 / N as f64, Central { gm: 1.0 });
    Transfer::new(body(), field, h, N, initial, target, actuation)
        .expect("a transfer")
        .with_dynamics(Dynamics::Lgvi)
}

fn planned(transfer: &Transfer) -> Result<Plan, PlanError> {
    solve(transfer, Start::Cold, &NewtonSettings::default(), |_| true)
}

pub(crate) fn limited(limits: &[f64]) -> Constraint {
    Constraint::commands(CommandLimit::new(limits).expect("limits").one_sided())
}

pub(crate) fn ends(rng: &mut Rng) -> [BodyState; 2] {
    let at = |position: Vector3<f64>, rng: &mut Rng| {
        let (velocity, spin) = (vector(rng, 0.2), vector(rng, 0.3));
        BodyState::from_velocities(&body(), position, velocity, exp(&vector(rng, 1.0)), spin)
    };
    let first = Vector3::new(3.0, 0.0, 0.0) + vector(rng, 0.3);
    let moved = first + vector(rng, 0.6);
    [at(first, rng), at(moved, rng)]
}

fn all(thrusters: Vec<Thruster>) -> Thrusters {
    let none = Propellant {
        mass: 0.0,
        inertia: None,
    };
    Thrusters::new(thrusters, none).expect("thrusters")
}

pub(crate) fn actuation(thrusters: &[Thruster], weights: &[f64]) -> Actuation {
    Actuation::thrusters(&all(thrusters.to_vec()), weights).expect("thrusters")
}

#[test]
fn each_thruster_has_a_weight_and_a_direction_of_length_one() {
    let long = Thruster::new(Vector3::y(), 3.0 * Vector3::x(), 1.0);
    let one = actuation(&[long], &[2.0]);
    let column = one.matrix().column(0);
    assert_eq!(column.as_slice(), [1.0, 0.0, 0.0, 0.0, 0.0, -1.0]);
    assert!(one.is_fixed_to_body());
    let refused = Actuation::thrusters(&all(vec![long]), &[]);
    let error = refused.expect_err("a weight is missing").to_string();
    assert_eq!(error, "0 weights for 1 thrusters, expected one for each");
}

/// Random windings start with thrusts that are not negative, too.
#[test]
fn a_search_finds_the_plan_of_a_cold_start_or_a_cheaper_one() {
    let mut rng = Rng::with_seed(54);
    let [initial, target] = ends(&mut rng);
    let transfer = transfer(initial, target, actuation(&pairs(), &[1.0; 12]))
        .with_constraints(&[limited(&[])]);
    let plan = planned(&transfer).expect("a plan");
    let settings = SearchSettings {
        starts: 3,
        seed: 1,
        newton: NewtonSettings::default(),
    };
    let minima = search(&transfer, &settings, |_| true).expect("minima");
    assert!(minima[0].plan.cost <= plan.cost * (1.0 + 1e-6));
    assert!(minima[0].plan.commands.iter().all(|w| w.min() > -1e-8));
}

/// The flight of a plan's commands by thrusters of these forces.
pub(crate) fn flown(
    thrusters: &[Thruster],
    initial: BodyState,
    plan: &Plan,
    limit: f64,
) -> BodyState {
    let thrusters = thrusters.iter().map(|thruster| Thruster {
        thrust: limit,
        ..*thruster
    });
    let count = thrusters.len();
    let thrusters = all(thrusters.collect());
    let body = body().with_thrusters(thrusters).expect("a body");
    let system = System::new(vec![body], vec![Box::new(Central { gm: 1.0 })]);
    let method = Method::Lgvi(Rotor::default());
    let mut simulation =
        Simulation::new(system, vec![initial], method, plan.h).expect("a simulation");
    for command in &plan.commands {
        simulation.set_thruster_commands(0, &command.as_slice()[..count]);
        simulation.advance(&[Load::default()]).expect("a step");
    }
    simulation.states()[0]
}

/// Two opposite one-sided thrusters are one command of both signs. The second problem has no inequalities.
#[test]
fn opposite_thrusters_are_planned_as_commands_of_both_signs() {
    let mut rng = Rng::with_seed(51);
    let thrusters = pairs();
    let signed: Vec<_> = thrusters.iter().copied().step_by(2).collect();
    for _ in 0..6 {
        let [initial, target] = ends(&mut rng);
        let weights = [1.0, 1.0, 2.0, 2.0, 1.0, 1.0, 3.0, 3.0, 1.0, 1.0, 1.5, 1.5];
        let apart = actuation(&thrusters, &weights);
        let apart = transfer(initial, target, apart).with_constraints(&[limited(&[])]);
        let weights: Vec<_> = weights.into_iter().step_by(2).collect();
        let together = actuation(&signed, &weights);
        let together = transfer(initial, target, together);
        let (plan, expected) = (
            planned(&apart).expect("a plan"),
            planned(&together).expect("a plan"),
        );
        assert!(expected.certificate.sufficient && expected.certificate.terminal < 1e-12);
        let cost = (plan.cost / expected.cost - 1.0).abs();
        assert!(cost < 1e-7, "{} for {}", plan.cost, expected.cost);
        for (commands, signed) in plan.commands.iter().zip(&expected.commands) {
            for pair in 0..6 {
                let [push, pull] = [commands[2 * pair], commands[2 * pair + 1]];
                assert!(push > -1e-9 && pull > -1e-9, "{push} {pull}");
                assert!((push - pull - signed[pair]).abs() < 1e-4 * expected.commands[0].amax());
            }
        }
    }
}

/// Random layouts of seven to fifteen thrusters, of random forces, that exert every force and moment.
#[test]
fn thrusters_fly_their_plans_to_the_target_within_their_limits() {
    let mut rng = Rng::with_seed(52);
    let mut saturated = 0;
    for round in 0..16 {
        let count = 7 + round % 9;
        let thrusters = layout(&mut rng, count);
        let [initial, target] = ends(&mut rng);
        let actuation = actuation(&thrusters, &vec![1.0; count]);
        let free = transfer(initial, target, actuation.clone()).with_constraints(&[limited(&[])]);
        let free = planned(&free).expect("a plan");
        let most = free.commands.iter().map(|w| w.amax()).fold(0.0, f64::max);
        for share in [2.0, 0.8] {
            let limit = share * most;
            let transfer = transfer(initial, target, actuation.clone())
                .with_constraints(&[limited(&vec![limit; count])]);
            let plan = planned(&transfer).expect("a plan within the limits");
            let certificate = &plan.certificate;
            assert!(certificate.terminal < 1e-11, "{certificate:?}");
            assert!(certificate.stationarity < 1e-6, "{certificate:?}");
            for command in &plan.commands {
                assert!(command.min() > -1e-8 * limit && command.max() < limit * (1.0 + 1e-8));
                saturated += usize::from(command.max() > 0.999 * limit);
            }
            assert!(plan.cost >= free.cost * (1.0 - 1e-6));
            // The valves shut below 0 and above the limit, by less than the tolerance of inequalities.
            let end = flown(&thrusters, initial, &plan, limit);
            let off = miss(&target, &end).amax();
            assert!(off < 1e-7, "{round}: the flight misses by {off:e}");
        }
    }
    assert!(saturated > 50, "{saturated}");
}

/// Thrusters at random places in random directions that together exert every force and moment.
pub(crate) fn layout(rng: &mut Rng, count: usize) -> Vec<Thruster> {
    loop {
        let random =
            |rng: &mut Rng| Thruster::new(vector(rng, 1.0), vector(rng, 1.0).normalize(), 1.0);
        let all: Vec<_> = (0..count).map(|_| random(rng)).collect();
        let column = |thruster: &Thruster| {
            let moment = thruster.position.cross(&thruster.direction);
            nalgebra::Vector6::from_iterator(thruster.direction.iter().chain(&moment).copied())
        };
        let columns: Vec<_> = all.iter().map(column).collect();
        if spans(&columns) {
            return all;
        }
    }
}

/// Returns true if sums of the columns with positive factors are all vectors: each axis is reached in both directions by
/// nonnegative least squares.
fn spans(columns: &[nalgebra::Vector6<f64>]) -> bool {
    (0..12).all(|index| {
        let sign = if index % 2 == 0 { 1.0 } else { -1.0 };
        let mut rest = nalgebra::Vector6::ith(index / 2, sign);
        let mut factors = vec![0.0_f64; columns.len()];
        for _ in 0..2000 {
            for (factor, column) in factors.iter_mut().zip(columns) {
                let change = (rest.dot(column) / column.norm_squared()).max(-*factor);
                *factor += change;
                rest -= change * column;
            }
        }
        rest.norm() < 1e-6 && factors.iter().sum::<f64>() < 20.0
    })
}

/// Random approaches and turns of a chaser in a low orbit, in SI, by thrusters of which some are wide open at times.
#[test]
fn approaches_in_a_low_orbit_are_planned() {
    let mut rng = Rng::with_seed(53);
    let (gm, radius): (f64, f64) = (3.986_004_418e14, 6.778e6);
    let inertia = Inertia::principal([30.0, 33.0, 36.0]).expect("inertia");
    let body = RigidBody::new(150.0, inertia, Vec::new()).expect("a body");
    let rate = (gm / radius.powi(3)).sqrt();
    let (h, n) = (0.5, 240);
    let at = |place: Vector3<f64>, time: f64, turn: Vector3<f64>| {
        let frame = exp(&Vector3::new(0.0, 0.0, rate * time));
        let position = frame * (Vector3::new(radius, 0.0, 0.0) + place);
        let velocity = Vector3::new(0.0, 0.0, rate).cross(&position);
        let spin = Vector3::zeros();
        BodyState::from_velocities(&body, position, velocity, frame * exp(&turn), spin)
    };
    let actuation = actuation(&pairs(), &[1.0; 12]);
    let mut shares = Vec::new();
    for round in 0..10 {
        let initial = at(vector(&mut rng, 40.0), 0.0, Vector3::zeros());
        let target = at(vector(&mut rng, 40.0), h * n as f64, vector(&mut rng, 1.7));
        let transfer = Transfer::new(
            body.clone(),
            Central { gm },
            h,
            n,
            initial,
            target,
            actuation.clone(),
        );
        let transfer = transfer.expect("a transfer").with_dynamics(Dynamics::Lgvi);
        let free = planned(&transfer.clone().with_constraints(&[limited(&[])])).expect("a plan");
        let most = free.commands.iter().map(|w| w.max()).fold(0.0, f64::max);
        let limit = 0.85 * most;
        let plan = planned(&transfer.with_constraints(&[limited(&[limit; 12])]));
        let plan = plan.unwrap_or_else(|error| panic!("{round}: {error}"));
        assert!(plan.certificate.terminal < 1e-11, "{:?}", plan.certificate);
        let open = plan.commands.iter().filter(|w| w.max() > 0.999 * limit);
        shares.push(open.count());
        for command in &plan.commands {
            assert!(command.min() > -1e-6 * limit && command.max() < limit * (1.0 + 1e-6));
        }
    }
    assert!(shares.iter().all(|open| *open > 0), "{shares:?}");
}
