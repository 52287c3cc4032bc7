//! Transfers with fewer commands than coordinates, from a cold start.

use lgvi_control::terminal::{FinalPosition, SpinAxis};
use lgvi_control::{
    Actuation, Motion, NewtonSettings, Plan, PlanError, Start, Terminal, Transfer, TransferError,
    solve,
};
use lgvi_dynamics::gravity::Uniform;
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use lgvi_lie::exp;
use nalgebra::Vector3;

const INERTIA: [f64; 3] = [1.0, 1.4, 1.9];

fn at_rest(position: Vector3<f64>, turn: Vector3<f64>) -> BodyState {
    BodyState {
        position,
        linear_momentum: Vector3::zeros(),
        attitude: exp(&turn),
        angular_momentum: Vector3::zeros(),
    }
}

/// Commands of unit weight: forces along axes 0 to 2, moments about axes 3 to 5.
fn along(axes: &[usize]) -> Actuation {
    let unit = |axis: usize| std::array::from_fn(|i| f64::from(u8::from(i == axis)));
    let columns: Vec<_> = axes.iter().map(|&axis| (unit(axis), 1.0)).collect();
    Actuation::actuators(&columns).expect("actuators")
}

/// A transfer from rest without gravity in 2 units of time.
fn transfer(
    n: usize,
    target: impl TryInto<Terminal, Error: Into<TransferError>>,
    actuation: Actuation,
    motion: Motion,
) -> Transfer {
    let inertia = Inertia::principal(INERTIA).expect("inertia");
    let body = RigidBody::new(2.0, inertia, Vec::new()).expect("a body");
    let field = Uniform {
        acceleration: Vector3::zeros(),
    };
    let start = at_rest(Vector3::zeros(), Vector3::zeros());
    let transfer = Transfer::new(body, field, 2.0 / n as f64, n, start, target, actuation);
    transfer.expect("a transfer").with_motion(motion)
}

fn planned(transfer: &Transfer) -> (Plan, u32) {
    let mut iterations = 0;
    let plan = solve(transfer, Start::Cold, &NewtonSettings::default(), |now| {
        iterations = now.iteration;
        true
    });
    (plan.expect("a plan"), iterations)
}

/// At rest, the first derivatives do not reach rotations about the third axis.
#[test]
fn two_wheels_turn_a_body_to_any_attitude() {
    let turns = [
        [0.3, -0.2, 0.7],
        [0.0, 0.0, 0.5],
        [0.02, 0.01, -0.05],
        [-1.1, 0.8, 0.9],
        [0.5, 1.5, -0.4],
        [0.0, 0.0, -1.8],
    ];
    for (k, turn) in turns.into_iter().enumerate() {
        let target = at_rest(Vector3::zeros(), turn.into());
        for missing in 3..6 {
            let pair: Vec<usize> = (3..6).filter(|&axis| axis != missing).collect();
            let problem = transfer(50, target, along(&pair), Motion::Rotation);
            let (plan, iterations) = planned(&problem);
            assert!(iterations <= 60, "{k} without {missing}: {iterations}");
            let found = &plan.certificate;
            assert!(found.terminal <= 1e-12 && found.stationarity <= 1e-8 && found.sufficient);
            assert!(
                plan.controls
                    .iter()
                    .all(|load| load.moment[missing - 3] == 0.0 && load.force == Vector3::zeros())
            );
        }
    }
}

/// Wheels do not affect the center of mass, and the number of steps does not affect the cost.
#[test]
fn two_wheels_cost_the_same_in_the_full_motion_and_in_many_steps() {
    let target = at_rest(Vector3::zeros(), Vector3::new(0.3, -0.2, 0.7));
    let (coarse, _) = planned(&transfer(50, target, along(&[3, 4]), Motion::Rotation));
    let (full, _) = planned(&transfer(50, target, along(&[3, 4]), Motion::Full));
    assert!((full.cost / coarse.cost - 1.0).abs() < 1e-10);
    let (fine, iterations) = planned(&transfer(400, target, along(&[3, 4]), Motion::Rotation));
    assert!((fine.cost / coarse.cost - 1.0).abs() < 1e-3 && iterations <= 60);
    let displaced = at_rest(Vector3::new(0.5, 0.0, -0.5), Vector3::new(0.3, -0.2, 0.7));
    let thrust = along(&[3, 0, 2, 4]);
    let (moved, _) = planned(&transfer(50, displaced, thrust, Motion::Full));
    let alone = transfer(50, displaced, along(&[0, 2]), Motion::Translation);
    let (pushed, _) = planned(&alone);
    assert!((moved.cost / (coarse.cost + pushed.cost) - 1.0).abs() < 1e-8);
}

/// Forces with an arm turn the body as they push it. The momentum about the third axis is tied to the momenta along the
/// other axes, so that a consistent condition on it adds nothing.
#[test]
fn conditions_that_follow_from_others_are_harmless() {
    let arm = 0.5;
    let actuation = || {
        Actuation::actuators(&[
            ([1.0, 0.0, 0.0, 0.0, 0.0, arm], 1.0),
            ([0.0, 1.0, 0.0, 0.0, 0.0, arm], 1.0),
        ])
        .expect("actuators")
    };
    let momentum = Some(Vector3::new(0.3, 0.4, 0.0));
    let position = FinalPosition::new(Vector3::new(0.4, 0.3, 0.0), momentum);
    let free = Terminal::FREE.with(position.expect("a position"));
    let [alone, bound, against] = [None, Some(0.7 * arm), Some(0.6 * arm)].map(|momentum| {
        let spin = |momentum| SpinAxis::new(Vector3::z(), Vector3::z(), momentum * Vector3::z());
        let target = match momentum {
            Some(momentum) => free.clone().with(spin(momentum).expect("a spin axis")),
            None => free.clone(),
        };
        transfer(40, target, actuation(), Motion::Full)
    });
    let [(alone, _), (bound, _)] = [alone, bound].map(|problem| planned(&problem));
    assert!((bound.cost / alone.cost - 1.0).abs() < 1e-10);
    assert!(bound.certificate.terminal <= 1e-12 && bound.certificate.stationarity <= 1e-8);
    assert_eq!(bound.certificate.condition, f64::INFINITY);
    match solve(&against, Start::Cold, &NewtonSettings::default(), |_| true) {
        Err(PlanError::NotConverged { iterations, .. }) => assert!(iterations <= 60),
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_no_command_reaches_ends_soon_with_what_there_is() {
    let aside = at_rest(Vector3::new(1.0, 0.1, 0.0), Vector3::zeros());
    let turned = at_rest(Vector3::zeros(), 0.5 * Vector3::x());
    let position = FinalPosition::new(Vector3::y(), None).expect("a position");
    let free = Terminal::FREE.with(position);
    let cases = [
        (transfer(40, aside, along(&[0]), Motion::Translation), 0.1),
        (transfer(40, aside, along(&[0, 4]), Motion::Full), 0.1),
        (transfer(40, free, along(&[0]), Motion::Full), 1.0),
        (transfer(40, turned, along(&[4]), Motion::Rotation), 0.1),
    ];
    for (k, (problem, missed)) in cases.iter().enumerate() {
        match solve(problem, Start::Cold, &NewtonSettings::default(), |_| true) {
            Err(PlanError::NotConverged {
                best,
                iterations,
                violation,
                ..
            }) => {
                assert!(iterations <= 150, "{k}: {iterations}");
                assert!(violation > 0.99 * missed, "{k}: {violation}");
                assert_eq!(best.expect("a flight").commands.len(), 40);
            }
            other => panic!("{k}: {other:?}"),
        }
    }
}

#[test]
fn an_observer_stops_at_any_weight_of_the_missing_wheel() {
    let target = at_rest(Vector3::zeros(), Vector3::new(0.3, -0.2, 0.7));
    let problem = transfer(50, target, along(&[3, 4]), Motion::Rotation);
    for last in 0..planned(&problem).1 {
        let mut seen = 0;
        let stopped = solve(&problem, Start::Cold, &NewtonSettings::default(), |now| {
            seen += 1;
            now.iteration < last
        });
        assert!(matches!(stopped, Err(PlanError::Stopped { best: Some(_) })));
        assert!(seen >= last);
    }
}
