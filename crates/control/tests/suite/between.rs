//! Inequalities on states between the ends of steps: of few and long steps, and of none that is exceeded.

use lgvi_control::constraint::{FramePose, KeepOutCone, KeepOutSphere, Moving};
use lgvi_control::{
    Actuation, Constraint, Dynamics, Motion, NewtonSettings, Plan, PlanError, Start, Terminal,
    Transfer, solve,
};
use lgvi_dynamics::gravity::Sources;
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use lgvi_lie::{exp, log, right_jacobian_inverse};
use nalgebra::{Matrix3, Vector3};

const INTERVALS: usize = 20;
const H: f64 = 0.1;
const SAMPLES: usize = 400;

fn body() -> RigidBody {
    let inertia = Inertia::principal([1.0, 1.4, 1.9]).expect("inertia");
    RigidBody::new(2.0, inertia, Vec::new()).expect("a body")
}

fn transfer(initial: BodyState, target: BodyState, motion: Motion, dynamics: Dynamics) -> Transfer {
    let weight = Matrix3::identity();
    Transfer::new(
        body(),
        Sources::new(Vec::new()),
        H,
        INTERVALS,
        initial,
        Terminal::try_from(target).expect("a state"),
        Actuation::full(&weight, &weight).expect("weights"),
    )
    .expect("a transfer")
    .with_dynamics(dynamics)
    .with_motion(motion)
}

fn cold(transfer: &Transfer) -> Result<Plan, PlanError> {
    solve(transfer, Start::Cold, &NewtonSettings::default(), |_| true)
}

fn unit(rng: &mut fastrand::Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| rng.f64() - 0.5).normalize()
}

fn resting(position: Vector3<f64>, attitude: Matrix3<f64>) -> BodyState {
    BodyState {
        position,
        linear_momentum: Vector3::zeros(),
        attitude,
        angular_momentum: Vector3::zeros(),
    }
}

/// The largest value of `depth` over all times of a plan, where `depth` takes the step and the part of it.
fn deepest(depth: impl Fn(usize, f64) -> f64) -> f64 {
    let times = (0..INTERVALS).flat_map(|step| (0..=SAMPLES).map(move |at| (step, at)));
    let depths = times.map(|(step, at)| depth(step, at as f64 / SAMPLES as f64));
    depths.fold(f64::NEG_INFINITY, f64::max)
}

/// The position under the constant force of a step: a parabola. A Lie–Euler step moves in a straight line.
fn position(plan: &Plan, dynamics: Dynamics, step: usize, part: f64) -> Vector3<f64> {
    let state = &plan.states[step];
    let t = H * part;
    let start = state.position + t * state.velocity(&body());
    match dynamics {
        Dynamics::Lgvi => start + 0.5 * t * t / body().mass() * plan.controls[step].force,
        Dynamics::LieEuler => start,
    }
}

/// The attitude in a step of length `h`, by the control points of its cubic (de Casteljau).
pub fn attitude(body: &RigidBody, h: f64, states: &[BodyState], part: f64) -> Matrix3<f64> {
    let (from, to) = (&states[0], &states[1]);
    let turn = log(&from.attitude.tr_mul(&to.attitude));
    let last = right_jacobian_inverse(&turn) * to.angular_velocity(body);
    let mut points = vec![
        Vector3::zeros(),
        h / 3.0 * from.angular_velocity(body),
        turn - h / 3.0 * last,
        turn,
    ];
    while points.len() > 1 {
        let pairs = points.windows(2).map(|pair| pair[0].lerp(&pair[1], part));
        points = pairs.collect();
    }
    from.attitude * exp(&points[0])
}

#[test]
fn flights_past_spheres_do_not_cut_through_them() {
    let mut rng = fastrand::Rng::with_seed(3);
    let mut cut = 0;
    for case in 0..40 {
        let dynamics = [Dynamics::Lgvi, Dynamics::LieEuler][case % 2];
        let mut near = |x: f64| Vector3::new(x, 0.6 * (rng.f64() - 0.5), 0.6 * (rng.f64() - 0.5));
        let (start, end, center) = (near(-2.0), near(2.0), near(0.0));
        let radius = 0.2 + 0.8 * rng.f64();
        let free = transfer(
            resting(start, Matrix3::identity()),
            resting(end, Matrix3::identity()),
            Motion::Translation,
            dynamics,
        );
        let sphere = Constraint::state(KeepOutSphere::new(center, radius).expect("a sphere"));
        let inside = |plan: &Plan| {
            deepest(|step, part| {
                1.0 - (position(plan, dynamics, step, part) - center).norm() / radius
            })
        };
        let at_ends = cold(
            &free
                .clone()
                .with_constraints_at_ends(std::slice::from_ref(&sphere)),
        );
        let plan = cold(&free.with_constraints(&[sphere])).expect("a plan");
        let [before, depth] = [inside(&at_ends.expect("a plan")), inside(&plan)];
        println!(
            "{case}: {before:.1e}, then {depth:.1e}, {:?}",
            plan.certificate
        );
        assert!(depth <= 1e-6, "{case}: {depth:e}, {before:e} before");
        if before > 1e-5 {
            // The plan passes at no greater distance than it must.
            assert!(depth > -2e-3, "{case}: {depth:e}");
            cut += 1;
        }
        assert!(plan.certificate.inequality <= 1e-7 && plan.certificate.sufficient);
        assert!(depth <= plan.certificate.inequality + 1e-12);
    }
    assert!(cut >= 20, "{cut}");
}

#[test]
fn slews_past_cones_do_not_cut_through_them() {
    let mut rng = fastrand::Rng::with_seed(5);
    let mut cut = 0;
    for case in 0..40 {
        let axis = unit(&mut rng);
        let across = unit(&mut rng).cross(&axis).normalize();
        let turn = (1.5 + rng.f64()) * across;
        let half_angle = 0.2 + 0.3 * rng.f64();
        // The cone is half a turn's way along, a little beside.
        let direction = exp(&(0.5 * turn)) * (axis + 0.2 * (rng.f64() - 0.5) * across);
        let free = transfer(
            resting(Vector3::zeros(), Matrix3::identity()),
            resting(Vector3::zeros(), exp(&turn)),
            Motion::Rotation,
            Dynamics::Lgvi,
        );
        let cone = KeepOutCone::new(axis, direction, half_angle).expect("a cone");
        let inside = |plan: &Plan| {
            deepest(|step, part| {
                let attitude = attitude(&body(), H, &plan.states[step..], part);
                half_angle - (attitude * axis).angle(&direction)
            })
        };
        let cone = Constraint::state(cone);
        let at_ends = cold(
            &free
                .clone()
                .with_constraints_at_ends(std::slice::from_ref(&cone)),
        );
        let plan = cold(&free.with_constraints(&[cone])).expect("a plan");
        let [before, depth] = [inside(&at_ends.expect("a plan")), inside(&plan)];
        println!(
            "{case}: {before:.1e}, then {depth:.1e}, {:?}",
            plan.certificate
        );
        assert!(depth <= 1e-6, "{case}: {depth:e}, {before:e} before");
        if before > 1e-5 {
            assert!(depth > -5e-3, "{case}: {depth:e}");
            cut += 1;
        }
        assert!(plan.certificate.inequality <= 1e-7);
    }
    assert!(cut >= 12, "{cut}");
}

/// The same laws hold in a frame that drifts, also within steps.
#[test]
fn the_frame_of_a_constraint_moves_within_steps() {
    let drift = Vector3::new(0.3, 0.7, -0.2);
    let (start, end) = (Vector3::new(-2.0, 0.1, 0.0), Vector3::new(2.0, 0.2, 0.1));
    let center = Vector3::new(0.05, -0.1, 0.0);
    let sphere = KeepOutSphere::new(center, 0.8).expect("a sphere");
    let poses: Vec<_> = (0..=INTERVALS)
        .map(|end| FramePose {
            origin: H * end as f64 * drift,
            rotation: Matrix3::identity(),
        })
        .collect();
    let moving = |shift: Vector3<f64>, at: Vector3<f64>| BodyState {
        linear_momentum: body().mass() * shift,
        ..resting(at, Matrix3::identity())
    };
    let duration = H * INTERVALS as f64;
    let [resting, moving] = [Vector3::zeros(), drift].map(|drift| {
        let target = moving(drift, end + duration * drift);
        let motion = Motion::Translation;
        transfer(moving(drift, start), target, motion, Dynamics::Lgvi)
    });
    let resting = cold(&resting.with_constraints(&[Constraint::state(sphere)])).expect("a plan");
    let frame = Moving::new(sphere, poses, H).expect("a moving sphere");
    let moving = cold(&moving.with_constraints(&[Constraint::state(frame)])).expect("a plan");
    assert!((moving.cost / resting.cost - 1.0).abs() < 1e-6);
    let depth = deepest(|step, part| {
        let origin = H * (step as f64 + part) * drift + center;
        1.0 - (position(&moving, Dynamics::Lgvi, step, part) - origin).norm() / 0.8
    });
    assert!((-2e-3..=1e-6).contains(&depth), "{depth:e}");
}

#[test]
fn what_holds_between_the_ends_anyway_is_planned_as_if_it_held_there_only() {
    let target = resting(Vector3::new(2.0, 0.0, 0.0), Matrix3::identity());
    let start = resting(Vector3::new(-2.0, 0.0, 0.0), Matrix3::identity());
    let free = transfer(start, target, Motion::Translation, Dynamics::Lgvi);
    let beside = KeepOutSphere::new(Vector3::new(0.0, 1.0, 0.0), 0.9).expect("a sphere");
    let beside = [Constraint::state(beside)];
    let count = |transfer: &Transfer| {
        let mut iterations = 0;
        let plan = solve(transfer, Start::Cold, &NewtonSettings::default(), |_| {
            iterations += 1;
            true
        });
        (plan.expect("a plan"), iterations)
    };
    let between = count(&free.clone().with_constraints(&beside));
    assert_eq!(between, count(&free.with_constraints_at_ends(&beside)));
}

/// A plan that starts from one with margins keeps them.
#[test]
fn a_plan_from_itself_takes_few_iterations() {
    let count = |transfer: &Transfer, start: Start<'_>| {
        let mut iterations = 0;
        let plan = solve(transfer, start, &NewtonSettings::default(), |_| {
            iterations += 1;
            true
        });
        (plan.expect("a plan"), iterations)
    };
    let start = resting(Vector3::new(-2.0, 0.1, 0.0), Matrix3::identity());
    let target = resting(Vector3::new(2.0, 0.2, 0.1), Matrix3::identity());
    let sphere = KeepOutSphere::new(Vector3::zeros(), 0.5).expect("a sphere");
    let transfer = transfer(start, target, Motion::Translation, Dynamics::LieEuler)
        .with_constraints(&[Constraint::state(sphere)]);
    let (plan, cold) = count(&transfer, Start::Cold);
    let (again, warm) = count(&transfer, Start::Warm(&plan));
    assert!((again.cost / plan.cost - 1.0).abs() < 1e-6);
    assert!(again.certificate.inequality <= 1e-7);
    assert!(3 * warm < cold, "{warm} of {cold}");

    let rest = transfer.remaining(5, plan.states[5]).expect("a rest");
    let guess = plan.remaining(&transfer, 5).expect("a rest");
    let (rest, warm) = count(&rest, Start::Warm(&guess));
    let last = rest.states.iter().zip(&plan.states[5..]);
    let apart = last.map(|(one, other)| (one.position - other.position).norm());
    assert!(apart.fold(0.0, f64::max) < 1e-5);
    assert!(3 * warm < cold, "{warm} of {cold}");
}

/// A sphere that is smaller than a step, right at the target: its last step starts outside and ends outside, on the other side.
#[test]
fn a_step_that_cannot_be_tightened_is_an_error_with_its_place() {
    let start = resting(Vector3::new(-2.0, 0.0, 0.0), Matrix3::identity());
    let mut target = start;
    target.position.x = 2.0;
    target.linear_momentum.x = 8.0 * body().mass();
    let free = transfer(start, target, Motion::Translation, Dynamics::LieEuler);
    let center = target.position - 0.3 * H * 8.0 * Vector3::x();
    let sphere = Constraint::state(KeepOutSphere::new(center, 0.1).expect("a sphere"));
    match cold(&free.with_constraints(&[sphere])) {
        Err(PlanError::Between {
            constraint: 0,
            step: 19,
            violation,
            best: Some(_),
        }) => assert!(violation > 0.1, "{violation}"),
        other => panic!("{other:?}"),
    }
}

/// Whoever stops the search for a cheaper plan gets the last one that holds between the ends of steps.
#[test]
fn what_holds_is_kept_until_something_cheaper_holds() {
    let (center, radius) = (Vector3::new(0.13, -0.1, 0.05), 0.6);
    let sphere = Constraint::state(KeepOutSphere::new(center, radius).expect("a sphere"));
    let past = |x: f64| {
        let [start, end] = [-x, x].map(|x| resting(Vector3::x() * x, Matrix3::identity()));
        let free = transfer(start, end, Motion::Translation, Dynamics::Lgvi);
        free.with_constraints(std::slice::from_ref(&sphere))
    };
    let fast = cold(&past(2.4)).expect("a plan");
    // It is slower, and needs smaller margins.
    let slow = past(1.6);
    let stopped = |most: usize| {
        let mut seen = 0;
        let watch = |_: &_| {
            seen += 1;
            seen < most
        };
        let found = solve(&slow, Start::Warm(&fast), &NewtonSettings::default(), watch);
        (found, seen)
    };
    let (found, all) = stopped(usize::MAX);
    let found = found.expect("a plan");
    let mut kept = 0;
    for most in 1..all {
        let (Err(PlanError::Stopped { best: Some(best) }), _) = stopped(most) else {
            continue;
        };
        if best.certificate.sufficient {
            let depth = deepest(|step, part| {
                1.0 - (position(&best, Dynamics::Lgvi, step, part) - center).norm() / radius
            });
            assert!(
                depth <= 1e-6 && best.certificate.inequality <= 1e-7,
                "{depth:e}"
            );
            assert!(best.cost > found.cost);
            kept += 1;
        }
    }
    println!("{kept} of {all}");
    assert!(kept > 0);
}
