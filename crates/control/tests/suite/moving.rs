//! Constraints in frames that move.

use std::f64::consts::PI;

use lgvi_control::constraint::{FrameMotion, FramePose, KeepOutSphere, Moving, Speed};
use lgvi_control::{
    Actuation, Constraint, Dynamics, Motion, NewtonSettings, Plan, Start, Terminal, Transfer, solve,
};
use lgvi_dynamics::gravity::Sources;
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use lgvi_lie::exp;
use nalgebra::{Matrix3, Vector3};

const INTERVALS: usize = 60;
const H: f64 = 0.05;
const MASS: f64 = 2.0;

fn state(position: Vector3<f64>, velocity: Vector3<f64>) -> BodyState {
    BodyState {
        position,
        linear_momentum: MASS * velocity,
        attitude: Matrix3::identity(),
        angular_momentum: Vector3::zeros(),
    }
}

/// A body without gravity passes a sphere from one side to the other, seen from a frame that drifts.
fn transfer(drift: Vector3<f64>, sphere: Constraint) -> Transfer {
    let inertia = Inertia::principal([1.0, 1.0, 1.0]).expect("inertia");
    let body = RigidBody::new(MASS, inertia, Vec::new()).expect("a body");
    let weight = Matrix3::identity();
    let duration = H * INTERVALS as f64;
    let [start, end] = [Vector3::new(-2.0, 0.1, 0.0), Vector3::new(2.0, 0.2, 0.1)];
    Transfer::new(
        body,
        Sources::new(Vec::new()),
        H,
        INTERVALS,
        state(start, drift),
        Terminal::try_from(state(end + duration * drift, drift)).expect("a state"),
        Actuation::full(&weight, &weight).expect("weights"),
    )
    .expect("a transfer")
    .with_dynamics(Dynamics::Lgvi)
    .with_motion(Motion::Translation)
    .with_constraints(&[sphere])
}

fn sphere() -> KeepOutSphere {
    KeepOutSphere::new(Vector3::new(0.0, -0.1, 0.0), 0.8).expect("a sphere")
}

fn drifting(drift: Vector3<f64>) -> Constraint {
    let poses = (0..=INTERVALS).map(|end| FramePose {
        origin: H * end as f64 * drift,
        rotation: Matrix3::identity(),
    });
    let poses: Vec<_> = poses.collect();
    Constraint::state(Moving::new(sphere(), poses, H).expect("a moving sphere"))
}

fn plan(transfer: &Transfer) -> Plan {
    let plan = solve(transfer, Start::Cold, &NewtonSettings::default(), |_| true);
    plan.unwrap_or_else(|error| panic!("{error}"))
}

/// The laws of motion are the same in a frame that drifts, and so is the best way around a sphere that drifts along.
#[test]
fn a_plan_around_a_drifting_sphere_is_that_around_a_resting_one() {
    let drift = Vector3::new(0.3, 0.7, -0.2);
    let resting = plan(&transfer(Vector3::zeros(), Constraint::state(sphere())));
    let moving = plan(&transfer(drift, drifting(drift)));
    assert!(resting.certificate.sufficient);
    assert!((moving.cost / resting.cost - 1.0).abs() < 1e-8);
    let pairs = resting.states.iter().zip(&moving.states).enumerate();
    let mut nearest = f64::INFINITY;
    for (end, (one, other)) in pairs {
        let back = other.position - H * end as f64 * drift;
        let off = (back - one.position).norm();
        assert!(off < 1e-6, "{end}: {off:e}");
        nearest = nearest.min((back - Vector3::new(0.0, -0.1, 0.0)).norm());
    }
    // The straight way leads through it.
    assert!((nearest - 0.8).abs() < 1e-3, "{nearest}");
}

/// The rest of a transfer sees the frame where it then is.
#[test]
fn the_rest_of_a_transfer_is_planned_in_the_frame_of_then() {
    let drift = Vector3::new(0.3, 0.7, -0.2);
    let whole = transfer(drift, drifting(drift));
    let all = plan(&whole);
    let step = 20;
    let rest = whole.remaining(step, all.states[step]).expect("a rest");
    let rest = plan(&rest);
    for (one, other) in all.states[step..].iter().zip(&rest.states) {
        assert!((one.position - other.position).norm() < 1e-6);
    }
}

/// Target and frame have moved since the plan that a warm start begins with, whose end is forbidden now.
#[test]
fn a_warm_start_from_an_end_that_is_forbidden_now_is_not_refused() {
    let slow = Vector3::new(0.3, 0.7, -0.2);
    let duration = H * INTERVALS as f64;
    let fast = slow + Vector3::new(2.0, 0.3, 0.1) / duration;
    let before = plan(&transfer(slow, drifting(slow)));
    let end = before.states[INTERVALS].position;
    let center = Vector3::new(0.0, -0.1, 0.0) + duration * fast;
    assert!((end - center).norm() < 0.1, "within the radius of 0.8");
    let moved = transfer(fast, drifting(fast));
    let settings = NewtonSettings::default();
    let warm = solve(&moved, Start::Warm(&before), &settings, |_| true);
    let warm = warm.unwrap_or_else(|error| panic!("{error}"));
    assert!((warm.cost / plan(&moved).cost - 1.0).abs() < 1e-8);
}

#[test]
fn poses_are_met_at_their_times_and_interpolated_between_them() {
    let poses: Vec<_> = (0..4)
        .map(|index| FramePose {
            origin: Vector3::x() * f64::from(index * index),
            rotation: exp(&(Vector3::z() * (0.25 * PI * f64::from(index)))),
        })
        .collect();
    let moving = Moving::new(sphere(), poses.clone(), 0.1).expect("a moving sphere");
    for (index, pose) in poses.iter().enumerate() {
        assert_eq!(moving.pose(0.1 * index as f64), *pose);
    }
    assert_eq!(moving.pose(-1.0), poses[0]);
    assert_eq!(moving.pose(9.0), poses[3]);
    assert_eq!(moving.later(0.1).pose(0.1), poses[2]);
    let between = moving.pose(0.15);
    assert!((between.origin - Vector3::x() * 2.25).norm() < 1e-12);
    let turned = exp(&(Vector3::z() * (0.375 * PI)));
    assert!((between.rotation - turned).norm() < 1e-12);

    for (poses, interval, name) in [
        (Vec::new(), 0.1, "poses"),
        (poses.clone(), 0.0, "interval"),
        (poses, f64::NAN, "interval"),
    ] {
        let error = Moving::new(sphere(), poses, interval).expect_err("an error");
        assert_eq!(error.name, name);
    }
}

/// The laws of motion are the same in a frame that drifts, and so is the best way that is slow in it.
#[test]
fn a_plan_that_is_slow_in_a_drifting_frame_is_that_of_a_slow_one_at_rest() {
    let drift = Vector3::new(0.3, 0.7, -0.2);
    let speed = Speed::new(1.6, MASS).expect("a speed");
    let motion = |end: usize| FrameMotion {
        pose: FramePose {
            origin: H * end as f64 * drift,
            rotation: exp(&(0.1 * end as f64 * Vector3::z())),
        },
        velocity: drift,
        turn: Vector3::zeros(),
    };
    let drifting = Moving::new(speed, (0..=INTERVALS).map(motion), H).expect("a moving frame");
    let resting = plan(&transfer(Vector3::zeros(), Constraint::state(speed)));
    let moving = plan(&transfer(drift, Constraint::state(drifting)));
    assert!((moving.cost / resting.cost - 1.0).abs() < 1e-8);
    let pairs = resting.states.iter().zip(&moving.states);
    let mut fastest = 0.0_f64;
    for (one, other) in pairs {
        let back = other.linear_momentum / MASS - drift;
        assert!((back - one.linear_momentum / MASS).norm() < 1e-6);
        fastest = fastest.max(back.norm());
    }
    assert!((fastest - 1.6).abs() < 1e-6, "{fastest}");
}

/// Beside a frame that turns about an axis that turns, too, the speed as it is seen from there keeps to the limit along whole steps,
/// measured by the exact motion of the frame, and touches it.
#[test]
fn the_speed_in_a_turning_frame_is_limited_along_whole_steps() {
    let nutation = Vector3::new(0.1, 0.0, 0.08);
    let exact = |time: f64| {
        let rotation = exp(&(time * nutation));
        let [s, c] = [(0.8 * time).sin(), (0.8 * time).cos()];
        FrameMotion {
            pose: FramePose {
                origin: Vector3::new(1.0 + 0.5 * s, 0.3 - 0.5 * c, 0.0),
                rotation,
            },
            velocity: 0.4 * Vector3::new(c, s, 0.0),
            turn: nutation + rotation * Vector3::new(0.0, 0.25, 0.0),
        }
    };
    let limit = 1.6;
    let speed = Speed::new(limit, MASS).expect("a speed");
    let motions = (0..=INTERVALS).map(|end| exact(H * end as f64));
    let moving = Moving::new(speed, motions, H).expect("a moving frame");
    let relative = Constraint::state(moving.clone());
    let found = plan(&transfer(Vector3::zeros(), relative));
    assert!(found.certificate.sufficient);
    let fast = Speed::new(1e3, MASS).expect("a speed");
    let free = plan(&transfer(Vector3::zeros(), Constraint::state(fast)));
    let seen = |plan: &Plan, step: usize, part: f64| {
        let [a, b] = [&plan.states[step], &plan.states[step + 1]];
        let [v, w] = [a, b].map(|state| state.linear_momentum / MASS);
        let (p, q) = (part, 1.0 - part);
        let position = (1.0 + 2.0 * p) * q * q * a.position
            + p * q * q * H * v
            + p * p * (3.0 - 2.0 * p) * b.position
            - p * p * q * H * w;
        let frame = exact(H * (step as f64 + part));
        let arm = position - frame.pose.origin;
        (v + part * (w - v) - frame.velocity - frame.turn.cross(&arm)).norm()
    };
    let fastest = |plan: &Plan| {
        let all = (0..INTERVALS * 20).map(|at| seen(plan, at / 20, (at % 20) as f64 / 20.0));
        all.fold(0.0, f64::max) / limit - 1.0
    };
    let (most, without) = (fastest(&found), fastest(&free));
    println!(
        "{most:e}, {without:e}, cost {} for {}",
        found.cost, free.cost
    );
    assert!(without > 0.05, "{without}");
    assert!((-1e-4..=2e-6).contains(&most), "{most:e}");
    // In between the frame moves by cubics.
    for at in 20..100 {
        let time = 0.3 * H * f64::from(at);
        let (one, other) = (moving.motion(time), exact(time));
        let error = (one.velocity - other.velocity).norm() + (one.turn - other.turn).norm();
        assert!(error < 1e-6, "{error:e}");
    }
}
