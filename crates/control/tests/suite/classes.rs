//! Classes of transfers with known solutions: half motions, few actuators, limits.

use lgvi_control::constraint::{ComponentLimit, NormLimit, Place};
use lgvi_control::terminal::{FinalAttitude, FinalPosition};
use lgvi_control::{
    Actuation, Constraint, Motion, NewtonSettings, Plan, PlanError, Start, Terminal, Transfer,
    TransferError, solve,
};
use lgvi_dynamics::gravity::Uniform;
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use lgvi_lie::exp;
use nalgebra::{Matrix3, Vector3};

const MASS: f64 = 2.0;
const INERTIA: [f64; 3] = [1.0, 1.4, 1.9];
const N: usize = 40;
const H: f64 = 0.05;

fn at_rest(position: Vector3<f64>, turn: Vector3<f64>) -> BodyState {
    BodyState {
        position,
        linear_momentum: Vector3::zeros(),
        attitude: exp(&turn),
        angular_momentum: Vector3::zeros(),
    }
}

fn full() -> Actuation {
    Actuation::full(&Matrix3::identity(), &Matrix3::identity()).expect("weights")
}

/// A transfer from rest at the origin without gravity.
fn transfer(
    target: impl TryInto<Terminal, Error: Into<TransferError>>,
    actuation: Actuation,
) -> Transfer {
    let inertia = Inertia::principal(INERTIA).expect("inertia");
    let body = RigidBody::new(MASS, inertia, Vec::new()).expect("a body");
    let field = Uniform {
        acceleration: Vector3::zeros(),
    };
    let start = at_rest(Vector3::zeros(), Vector3::zeros());
    Transfer::new(body, field, H, N, start, target, actuation).expect("a transfer")
}

fn plan(transfer: &Transfer) -> Plan {
    solve(transfer, Start::Cold, &NewtonSettings::default(), |_| true).expect("a plan")
}

/// The forces of least energy for the double integrator `x⁺ = x + h v`, `v⁺ = v + (h/m) u`, from rest to rest over
/// `distance`: `u_k = c (N + 1 − 2k)`, k = 1 … N, with `Σ u = 0` and `(h²/m) Σ (N − k) u_k = distance`.
fn energy_optimal(distance: f64, inertia: f64) -> Vec<f64> {
    let shape: Vec<f64> = (1..=N).map(|k| (N + 1) as f64 - 2.0 * k as f64).collect();
    let reach: f64 = (1..=N).map(|k| (N - k) as f64 * shape[k - 1]).sum();
    let scale = distance * inertia / (H * H * reach);
    shape.iter().map(|u| scale * u).collect()
}

#[test]
fn energy_optimal_translations_have_forces_linear_in_time() {
    let distance = Vector3::new(1.0, -2.0, 0.5);
    for motion in [Motion::Full, Motion::Translation] {
        let target = at_rest(distance, Vector3::zeros());
        let plan = plan(&transfer(target, full()).with_motion(motion));
        for axis in 0..3 {
            let expected = energy_optimal(distance[axis], MASS);
            for (load, expected) in plan.controls.iter().zip(&expected) {
                assert!((load.force[axis] - expected).abs() < 1e-7, "{motion:?}");
                assert!(load.moment.norm() < 1e-7);
            }
        }
    }
}

/// About a principal axis, a step has `Π⁺ = Π + h M` and `sin θ = h Π/J`, which is the double integrator to `O(h²)`.
#[test]
fn rest_to_rest_rotations_stay_on_a_principal_axis() {
    for motion in [Motion::Full, Motion::Rotation] {
        let turn = 0.8 * Vector3::y();
        let plan = plan(&transfer(at_rest(Vector3::zeros(), turn), full()).with_motion(motion));
        let angle: f64 = plan.states[..N]
            .iter()
            .map(|state| (H * state.angular_momentum.y / INERTIA[1]).asin())
            .sum();
        assert!((angle - 0.8).abs() < 1e-12);
        let expected = energy_optimal(0.8, INERTIA[1]);
        for (load, expected) in plan.controls.iter().zip(&expected) {
            assert!(load.moment.x.abs() + load.moment.z.abs() + load.force.norm() < 1e-11);
            assert!((load.moment.y - expected).abs() < 2e-3 * expected.abs().max(1.0));
        }
        // Holds by symmetry in time.
        for k in 0..N {
            let mirrored = plan.controls[N - 1 - k].moment.y;
            assert!((plan.controls[k].moment.y + mirrored).abs() < 0.05);
        }
    }
}

/// The force of least time within a bound accelerates at the bound and then brakes at the bound. If the time is
/// slightly longer than the least time, the bounded plan is close to it.
#[test]
fn a_bound_near_the_least_one_gives_bang_bang() {
    // With `u = ±b` in two halves: distance = (h²/m) b Σ (N − k) sign.
    let distance = 1.0;
    let reach: f64 = (1..=N)
        .map(|k| (N - k) as f64 * if k <= N / 2 { 1.0 } else { -1.0 })
        .sum();
    let least = distance * MASS / (H * H * reach);
    let target = at_rest(distance * Vector3::x(), Vector3::zeros());
    let bounded = |limit: f64| {
        transfer(target, full())
            .with_motion(Motion::Translation)
            .with_constraints(&[Constraint::commands(
                ComponentLimit::new(Place::Position, Vector3::from_element(limit)).expect("limits"),
            )])
    };
    let near = plan(&bounded(1.001 * least));
    for (k, load) in near.controls.iter().enumerate() {
        let sign = if k < N / 2 { 1.0 } else { -1.0 };
        assert!(load.force.x.abs() <= 1.001 * least * (1.0 + 1e-9));
        if k.abs_diff(N / 2) > 2 && k.abs_diff(N / 2 - 1) > 2 {
            assert!((load.force.x - sign * least).abs() < 2e-3 * least, "{k}");
        }
    }
    match solve(
        &bounded(0.99 * least),
        Start::Cold,
        &NewtonSettings::default(),
        |_| true,
    ) {
        Err(PlanError::NotFound { violation, .. }) => assert!(violation > 1e-3),
        other => panic!("{other:?}"),
    }
}

#[test]
fn bounded_energy_optimal_forces_are_clipped_lines() {
    let target = at_rest(Vector3::x(), Vector3::zeros());
    let free = energy_optimal(1.0, MASS);
    let limit = 0.8 * free[0];
    let bounded = transfer(target, full())
        .with_motion(Motion::Translation)
        .with_constraints(&[Constraint::commands(
            NormLimit::new(Place::Position, limit).expect("a limit"),
        )]);
    let plan = plan(&bounded);
    let force = |k: usize| plan.controls[k].force.x;
    let inner: Vec<usize> = (0..N)
        .filter(|&k| force(k).abs() < (1.0 - 1e-5) * limit)
        .collect();
    assert!(inner.len() > 10 && inner.len() < N - 6);
    let slope = force(inner[1]) - force(inner[0]);
    for k in 0..N {
        let middle = 0.5 * (N - 1) as f64;
        let line = (slope * (k as f64 - middle)).clamp(-limit, limit);
        assert!(
            (force(k) - line).abs() < 1e-4 * limit,
            "{k}: {} for {line}",
            force(k)
        );
    }
}

#[test]
fn free_ends_are_cheaper_the_freer_they_are_and_end_with_costate_zero_where_free() {
    let goal = at_rest(Vector3::new(1.0, 0.5, 0.0), Vector3::new(0.3, 0.5, -0.2));
    let free = |target: Terminal| plan(&transfer(target, full()));
    let position = FinalPosition::new(goal.position, None).expect("a position");
    let attitude = FinalAttitude::new(goal.attitude, None).expect("an attitude");
    let first = plan(&transfer(goal, full()));
    let second = free(Terminal::FREE.with(position).with(attitude));
    assert!(second.cost < 0.5 * first.cost);
    // The least energy to reach a position with free momentum is a quarter, in continuous time.
    assert!((second.cost / first.cost - 0.25).abs() < 0.05);
    let last = second.multipliers[N - 1];
    assert!(last.fixed_rows::<3>(3).norm() + last.fixed_rows::<3>(9).norm() < 1e-12 * last.norm());
    assert!(free(Terminal::FREE).cost < 1e-20);
}

#[test]
fn one_thruster_plans_what_it_reaches() {
    let thruster = ([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], 3.0);
    let wheel = ([0.0, 0.0, 0.0, 0.0, 1.0, 0.0], 1.0);
    let actuation = Actuation::actuators(&[wheel, thruster]).expect("actuators");
    let target = at_rest(Vector3::x(), Vector3::zeros());
    let plan = plan(&transfer(target, actuation).with_motion(Motion::Translation));
    for (k, expected) in energy_optimal(1.0, MASS).iter().enumerate() {
        assert!((plan.commands[k][1] - expected).abs() < 1e-7);
        assert_eq!(plan.commands[k].norm(), plan.commands[k][1].abs());
        assert_eq!(plan.controls[k].force.x, plan.commands[k][1]);
    }
    assert!(plan.certificate.terminal < 1e-12);
}
