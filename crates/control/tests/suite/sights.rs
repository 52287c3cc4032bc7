//! Plans under limits on rates and speeds, around ellipsoids, with a point in sight and out of plumes.

use lgvi_control::constraint::{
    AngularRate, FramePose, KeepOutEllipsoid, KeepOutSphere, LineOfSight, Moving, NormLimit, Plume,
    Speed, StateConstraint,
};
use lgvi_control::{
    Actuation, Constraint, Dynamics, Motion, NewtonSettings, Place, Plan, PlanError, Start,
    Terminal, Transfer, solve,
};
use lgvi_dynamics::gravity::Sources;
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use lgvi_lie::exp;
use nalgebra::{Matrix3, Vector3};

use crate::between::attitude;

const INTERVALS: usize = 40;
const H: f64 = 0.05;
const PARTS: usize = 50;

fn body() -> RigidBody {
    let inertia = Inertia::principal([1.0, 1.4, 1.9]).expect("inertia");
    RigidBody::new(2.0, inertia, Vec::new()).expect("a body")
}

fn resting(position: Vector3<f64>, attitude: Matrix3<f64>) -> BodyState {
    BodyState {
        position,
        linear_momentum: Vector3::zeros(),
        attitude,
        angular_momentum: Vector3::zeros(),
    }
}

fn transfer(initial: BodyState, target: Terminal, motion: Motion) -> Transfer {
    let weight = Matrix3::identity();
    let field = Sources::new(Vec::new());
    let actuation = Actuation::full(&weight, &weight).expect("weights");
    Transfer::new(body(), field, H, INTERVALS, initial, target, actuation)
        .expect("a transfer")
        .with_dynamics(Dynamics::Lgvi)
        .with_motion(motion)
}

fn to(state: BodyState) -> Terminal {
    Terminal::try_from(state).expect("a state")
}

fn planned(transfer: &Transfer) -> Plan {
    let plan = solve(transfer, Start::Cold, &NewtonSettings::default(), |_| true);
    let plan = plan.unwrap_or_else(|error| panic!("{error}"));
    println!("cost {}, {:?}", plan.cost, plan.certificate);
    assert!(plan.certificate.sufficient && plan.certificate.inequality <= 1e-7);
    plan
}

/// The plan under `constraint` and the one without it; the first costs more.
fn both(free: &Transfer, constraint: impl StateConstraint) -> [Plan; 2] {
    let constraint = Constraint::state(constraint);
    let bound = planned(&free.clone().with_constraints(&[constraint]));
    let free = planned(free);
    assert!(bound.cost > free.cost * (1.0 + 1e-6));
    [bound, free]
}

fn most(plan: &Plan, of: impl Fn(&BodyState) -> f64) -> f64 {
    plan.states.iter().map(of).fold(f64::NEG_INFINITY, f64::max)
}

/// The largest of `of` over dense times of a plan, from the position under constant force and the cubic of the attitude.
fn densely(plan: &Plan, of: impl Fn(f64, &BodyState) -> f64) -> f64 {
    let mut most = f64::NEG_INFINITY;
    for (step, pair) in plan.states.windows(2).enumerate() {
        for at in 0..=PARTS {
            let part = at as f64 / PARTS as f64;
            let t = H * part;
            let force = plan.controls[step].force / body().mass();
            let state = BodyState {
                position: pair[0].position + t * pair[0].velocity(&body()) + 0.5 * t * t * force,
                attitude: attitude(&body(), H, pair, part),
                ..pair[0]
            };
            most = most.max(of(H * step as f64 + t, &state));
        }
    }
    most
}

#[test]
fn rates_keep_their_limits() {
    let turned = exp(&Vector3::new(1.0, -0.8, 0.6));
    let still = resting(Vector3::zeros(), Matrix3::identity());
    let free = transfer(
        still,
        to(resting(Vector3::zeros(), turned)),
        Motion::Rotation,
    );
    let body_now = body();
    let inertia = body_now.inertia();
    let rate = |state: &BodyState| state.angular_velocity(&body()).norm();
    let limit = AngularRate::new(0.9, inertia).expect("a limit");
    let [bound, loose] = both(&free, limit);
    assert!(most(&loose, rate) > 1.0);
    assert!(
        (most(&bound, rate) - 0.9).abs() < 1e-8,
        "{}",
        most(&bound, rate)
    );

    let axis = Vector3::new(1.0, 0.2, 0.0).normalize();
    let about = |state: &BodyState| state.angular_velocity(&body()).dot(&axis).abs();
    let limit = 0.8 * most(&planned(&free), about);
    let rate = AngularRate::new(limit, inertia).expect("a limit");
    let [bound, _] = both(&free, rate.about(axis).expect("an axis"));
    assert!((most(&bound, about) - limit).abs() < 1e-8);
}

/// From rest to rest over `L` in `T` under a speed limit `c`: parabolas of the speed at both ends, `τ = 3 (T − L/c)/2` long, with
/// the force `2 m c (1 − t/τ)/τ`, and between them the speed `c`.
#[test]
fn a_speed_keeps_its_limit_at_the_cost_of_the_calculus_of_variations() {
    let end = resting(Vector3::new(4.0, 0.0, 0.0), Matrix3::identity());
    let free = transfer(
        resting(Vector3::zeros(), Matrix3::identity()),
        to(end),
        Motion::Translation,
    );
    let speed = |state: &BodyState| state.velocity(&body()).norm();
    let [bound, loose] = both(&free, Speed::new(2.4, 2.0).expect("a limit"));
    assert!((most(&loose, speed) - 3.0).abs() < 0.01);
    assert!((most(&bound, speed) - 2.4).abs() < 1e-8);
    let tau = 1.5 * (H * INTERVALS as f64 - 4.0 / 2.4);
    // Twice ½ ∫ F² dt.
    let cost = 4.0 * 2.0 * 2.0 * 2.4 * 2.4 / (3.0 * tau);
    assert!(
        (bound.cost / cost - 1.0).abs() < 5e-3,
        "{} {cost}",
        bound.cost
    );
}

/// Around an ellipsoid that tumbles along with a body that drifts.
#[test]
fn a_tumbling_ellipsoid_is_avoided() {
    let (drift, spin) = (Vector3::new(0.1, -0.2, 0.3), Vector3::new(0.9, -0.5, 1.4));
    let pose = |time: f64| FramePose {
        origin: time * drift,
        rotation: exp(&(time * spin)),
    };
    let poses: Vec<_> = (0..=INTERVALS).map(|end| pose(H * end as f64)).collect();
    let semi_axes = Vector3::new(0.3, 0.5, 1.1);
    let tilted = exp(&Vector3::new(0.3, 0.2, -0.5));
    let center = Vector3::new(0.1, 0.0, -0.1);
    let ellipsoid = KeepOutEllipsoid::new(center, semi_axes, tilted).expect("an ellipsoid");
    let free = transfer(
        resting(Vector3::new(-2.0, 0.1, 0.2), Matrix3::identity()),
        to(resting(Vector3::new(2.0, -0.3, 0.1), Matrix3::identity())),
        Motion::Translation,
    );
    let inside = |time: f64, state: &BodyState| {
        let seen = pose(time).seen(&state.position) - center;
        1.0 - tilted.tr_mul(&seen).component_div(&semi_axes).norm()
    };
    let frame = Moving::new(ellipsoid, poses, H).expect("a frame");
    let [bound, loose] = both(&free, frame);
    assert!(densely(&loose, inside) > 0.1);
    let depth = densely(&bound, inside);
    assert!((-2e-3..=1e-6).contains(&depth), "{depth:e}");
}

/// A flyby with a camera on the body passed, which the attitude and the way both give in to.
#[test]
fn a_point_is_kept_in_sight_by_position_and_attitude() {
    let point = Vector3::new(0.0, 1.0, 0.2);
    let [start, end] = [Vector3::new(-2.0, 0.0, 0.0), Vector3::new(2.0, 0.0, 0.0)];
    // The camera along the body's first axis sees the point at both ends.
    let looking = |from: Vector3<f64>| {
        let x = (point - from).normalize();
        let y = Vector3::z().cross(&x).normalize();
        Matrix3::from_columns(&[x, y, x.cross(&y)])
    };
    let free = transfer(
        resting(start, looking(start)),
        to(resting(end, looking(end))),
        Motion::Full,
    );
    let sight = LineOfSight::new(Vector3::x(), point, 0.1).expect("a sight");
    let off = |_: f64, state: &BodyState| {
        (state.attitude * Vector3::x()).angle(&(point - state.position))
    };
    let [bound, loose] = both(&free, sight);
    assert!(densely(&loose, off) > 0.2);
    let most = densely(&bound, off);
    assert!(most <= 0.1 + 1e-6 && most > 0.099, "{most}");
    let apart = bound.states.iter().zip(&loose.states);
    let bent = apart.map(|(one, other)| (one.position - other.position).norm());
    assert!(bent.fold(0.0, f64::max) > 1e-3);
}

/// A body that coasts past a point can only turn, or, if its attitude is not planned, only move.
#[test]
fn one_half_of_the_motion_keeps_a_point_in_sight() {
    let point = Vector3::new(0.0, 1.5, 0.0);
    let mut start = resting(
        Vector3::new(-1.0, 0.0, 0.0),
        exp(&Vector3::new(0.0, 0.0, 0.9)),
    );
    start.linear_momentum = Vector3::new(2.0, 0.0, 0.0);
    let end = resting(Vector3::zeros(), exp(&Vector3::new(0.0, 0.0, 2.2)));
    let sight =
        |half_angle: f64| LineOfSight::new(Vector3::x(), point, half_angle).expect("a sight");
    let off = |_: f64, state: &BodyState| {
        (state.attitude * Vector3::x()).angle(&(point - state.position))
    };
    let turning = transfer(start, to(end), Motion::Rotation);
    let [bound, loose] = both(&turning, sight(0.12));
    let [kept, lost] = [densely(&bound, off), densely(&loose, off)];
    assert!(
        lost > 0.13 && kept <= 0.12 + 1e-6 && kept > 0.119,
        "{lost} {kept}"
    );

    // It starts to the side.
    let facing = exp(&Vector3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2));
    let mut start = resting(Vector3::new(-0.5, 0.0, 0.0), facing);
    start.linear_momentum = Vector3::new(-2.0, 0.0, 0.0);
    let end = resting(Vector3::new(0.3, 1.2, 0.0), facing);
    let moving = transfer(start, to(end), Motion::Translation);
    let point = Vector3::new(0.0, 2.5, 0.0);
    let off = |_: f64, state: &BodyState| Vector3::y().angle(&(point - state.position));
    let lost = densely(&planned(&moving), off);
    let sight = LineOfSight::new(Vector3::x(), point, 0.9 * lost).expect("a sight");
    let [bound, _] = both(&moving, sight);
    let kept = densely(&bound, off);
    assert!(
        (-1e-3..=1e-6).contains(&(kept - 0.9 * lost)),
        "{kept} {lost}"
    );
}

/// On the way past a point, the plume along the body's −x is turned away or the point is left at a distance.
#[test]
fn a_plume_does_not_reach_a_point() {
    let point = Vector3::new(0.0, -0.8, 0.0);
    let free = transfer(
        resting(Vector3::new(-2.0, 0.0, 0.0), Matrix3::identity()),
        to(resting(Vector3::new(2.0, 0.0, 0.0), Matrix3::identity())),
        Motion::Full,
    );
    let plume = Plume::new(-Vector3::x(), point, 0.6, 1.6).expect("a plume");
    let reached = |_: f64, state: &BodyState| {
        let arm = point - state.position;
        let inside = 0.6 - (state.attitude * -Vector3::x()).angle(&arm);
        inside.min(1.0 - arm.norm() / 1.6)
    };
    let [bound, loose] = both(&free, plume);
    let [kept, lost] = [densely(&bound, reached), densely(&loose, reached)];
    println!("{kept:e} {lost}");
    assert!(
        lost > 0.04 && kept <= 1e-5 && kept > -1e-2,
        "{kept:e} {lost}"
    );
}

/// With a price, the depth in a sphere is that at which the next bit of it would cost as much: there is none above the
/// multipliers, and the whole depth for next to nothing.
#[test]
fn a_price_buys_what_it_is_worth() {
    let free = transfer(
        resting(Vector3::new(-2.0, 0.1, 0.0), Matrix3::identity()),
        to(resting(Vector3::new(2.0, 0.1, 0.0), Matrix3::identity())),
        Motion::Translation,
    );
    let sphere = KeepOutSphere::new(Vector3::zeros(), 0.6).expect("a sphere");
    let sphere = Constraint::state(sphere);
    let depth = |state: &BodyState| 0.5 * (1.0 - state.position.norm_squared() / 0.36);
    let loose = planned(&free);
    let hard = planned(
        &free
            .clone()
            .with_constraints_at_ends(std::slice::from_ref(&sphere)),
    );
    let mut last = [most(&loose, depth), loose.cost];
    for price in [1e-3, 0.3, 1.0, 3.0, 1e3] {
        let priced = sphere.clone().priced(price / H).expect("a price");
        let plan = planned(&free.clone().with_constraints(&[priced]));
        let now = [most(&plan, depth), plan.cost];
        assert!(
            now[0] < last[0] && now[1] > last[1],
            "{price}: {now:?}, {last:?}"
        );
        assert!((plan.certificate.priced - now[0].max(0.0)).abs() < 1e-12);
        let inside = plan.states.iter().map(|state| depth(state).max(0.0));
        let paid = price * inside.sum::<f64>();
        assert!(
            (plan.paid - paid).abs() < 1e-9 * (1.0 + paid),
            "{} for {paid}",
            plan.paid
        );
        assert_eq!(plan.certificate.inequality, 0.0);
        last = now;
    }
    assert!(
        last[0] < 1e-6 && (last[1] / hard.cost - 1.0).abs() < 1e-6,
        "{last:?}, {}",
        hard.cost
    );
}

/// A start in a sphere, and a target in another, are infeasible unless they have a price.
#[test]
fn what_is_infeasible_has_a_plan_at_a_price() {
    let [start, end] = [Vector3::new(-1.0, 0.0, 0.0), Vector3::new(1.0, 0.0, 0.0)];
    let still = |at| resting(at, Matrix3::identity());
    let free = transfer(still(start), to(still(end)), Motion::Translation);
    let spheres = [start, end].map(|center| {
        let sphere = KeepOutSphere::new(center, 0.3).expect("a sphere");
        Constraint::state(sphere)
    });
    let settings = NewtonSettings::default();
    let hard = free.clone().with_constraints(&spheres);
    let refused = solve(&hard, Start::Cold, &settings, |_| true);
    assert!(
        matches!(refused, Err(PlanError::Infeasible { .. })),
        "{refused:?}"
    );
    let priced = spheres.map(|sphere| sphere.priced(2.0 / H).expect("a price"));
    let plan = planned(&free.with_constraints(&priced));
    // The target is fixed and has no row; near it there is one.
    assert!(
        (0.3..0.5).contains(&plan.certificate.priced),
        "{}",
        plan.certificate.priced
    );
    let tight = NormLimit::new(Place::Position, 1.0).expect("a limit");
    let weak = Constraint::commands(tight)
        .priced(1e-2 / H)
        .expect("a price");
    let plan = planned(&hardly(weak));
    assert!(plan.certificate.priced > 0.1);
}

/// A transfer that needs a force of 6 at least.
fn hardly(constraint: Constraint) -> Transfer {
    let still = |x: f64| resting(Vector3::x() * x, Matrix3::identity());
    transfer(still(0.0), to(still(3.0)), Motion::Translation).with_constraints(&[constraint])
}

/// Prices are per unit of time: what twice as many steps pay differs little.
#[test]
fn a_price_buys_as_much_in_shorter_steps() {
    let [start, end] = [-2.0, 2.0].map(|x| resting(Vector3::new(x, 0.1, 0.0), Matrix3::identity()));
    let sphere = KeepOutSphere::new(Vector3::zeros(), 0.6).expect("a sphere");
    let sphere = Constraint::state(sphere).priced(20.0).expect("a price");
    let weight = Matrix3::identity();
    let plan = |n: usize| {
        let h = H * INTERVALS as f64 / n as f64;
        let actuation = Actuation::full(&weight, &weight).expect("weights");
        let field = Sources::new(Vec::new());
        let transfer = Transfer::new(body(), field, h, n, start, to(end), actuation);
        let transfer = transfer
            .expect("a transfer")
            .with_motion(Motion::Translation);
        planned(
            &transfer
                .with_dynamics(Dynamics::Lgvi)
                .with_constraints(std::slice::from_ref(&sphere)),
        )
    };
    let [coarse, fine] = [40, 160].map(plan);
    assert!(
        coarse.paid > 0.05 * coarse.cost,
        "{} {}",
        coarse.paid,
        coarse.cost
    );
    for [coarse, fine] in [[coarse.cost, fine.cost], [coarse.paid, fine.paid]] {
        assert!((coarse / fine - 1.0).abs() < 0.05, "{coarse} {fine}");
    }
}
