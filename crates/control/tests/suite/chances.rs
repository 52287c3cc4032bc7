//! Constraints that hold with a probability, counted over ten thousand flights of the propagator.

use fastrand::Rng;
use lgvi_control::constraint::{AngularRate, Corridor, KeepOutCone, KeepOutSphere};
use lgvi_control::{
    Actuation, Chances, Constraint, Dynamics, Motion, NewtonSettings, Plan, PlanError,
    SearchSettings, Start, Transfer, Uncertainty, miss, search, solve,
};
use lgvi_dynamics::gravity::{Central, Sources};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{BodyState, Inertia, Load, Method, RigidBody, Simulation, System};
use lgvi_lie::exp;
use nalgebra::{Matrix3, Vector3, Vector6};

pub(crate) const FLIGHTS: usize = 10_000;

fn body() -> RigidBody {
    let inertia = Inertia::principal([1.0, 1.4, 1.9]).expect("inertia");
    RigidBody::new(2.0, inertia, Vec::new()).expect("a body")
}

fn at(position: Vector3<f64>, velocity: Vector3<f64>, turn: Vector3<f64>) -> BodyState {
    BodyState::from_velocities(&body(), position, velocity, exp(&turn), Vector3::zeros())
}

fn transfer(gm: f64, duration: f64, n: usize, ends: [BodyState; 2]) -> Transfer {
    let weights = Matrix3::identity();
    let actuation = Actuation::full(&weights, &weights).expect("an actuation");
    let h = duration / n as f64;
    let [start, end] = ends;
    let transfer = if gm == 0.0 {
        let nothing = Sources::new(Vec::new());
        Transfer::new(body(), nothing, h, n, start, end, actuation)
    } else {
        Transfer::new(body(), Central { gm }, h, n, start, end, actuation)
    };
    transfer.expect("a transfer").with_dynamics(Dynamics::Lgvi)
}

fn planned(transfer: &Transfer) -> Result<Plan, PlanError> {
    solve(transfer, Start::Cold, &NewtonSettings::default(), |_| true)
}

pub(crate) fn normal(rng: &mut Rng) -> f64 {
    let radius = (-2.0 * (1.0 - rng.f64()).ln()).sqrt();
    radius * (std::f64::consts::TAU * rng.f64()).cos()
}

pub(crate) fn normals(rng: &mut Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| normal(rng))
}

/// The share of flights that violate a constraint at the end of each step.
fn violations(
    plan: &Plan,
    uncertainty: &Uncertainty,
    gm: f64,
    violates: impl Fn(&BodyState) -> bool,
) -> Vec<f64> {
    let mut rng = Rng::with_seed(7);
    let mut counts = vec![0_usize; plan.controls.len()];
    for _ in 0..FLIGHTS {
        let mut start = plan.states[0];
        start.position += uncertainty.position * normals(&mut rng);
        start.linear_momentum += body().mass() * uncertainty.velocity * normals(&mut rng);
        start.attitude *= exp(&(uncertainty.attitude * normals(&mut rng)));
        let spin = uncertainty.angular_velocity * normals(&mut rng);
        start.angular_momentum += body().inertia().matrix() * spin;
        let errors = [uncertainty.force_error, uncertainty.moment_error]
            .map(|error| error * normals(&mut rng));
        let field: Vec<Box<dyn lgvi_dynamics::gravity::Gravity>> = match gm {
            0.0 => Vec::new(),
            gm => vec![Box::new(Central { gm })],
        };
        let system = System::new(vec![body()], field);
        let method = Method::Lgvi(Rotor::default());
        let mut flight = Simulation::new(system, vec![start], method, plan.h).expect("a flight");
        for (k, count) in counts.iter_mut().enumerate() {
            let Load { force, moment } = plan.controls[k];
            let mut load = Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z);
            if uncertainty.feedback {
                load -= plan.feedback[k] * miss(&plan.states[k], &flight.states()[0]);
            }
            let erring = |first: usize, error: &Vector3<f64>| {
                let part = load.fixed_rows::<3>(first).into_owned();
                part + part.component_mul(error)
            };
            let load = Load {
                force: erring(0, &errors[0]),
                moment: erring(3, &errors[1]),
            };
            flight.advance(&[load]).expect("a step");
            *count += usize::from(violates(&flight.states()[0]));
        }
    }
    counts
        .iter()
        .map(|count| *count as f64 / FLIGHTS as f64)
        .collect()
}

/// The promised rate holds at every step within three standard errors of the count, and is made use of.
pub(crate) fn check(name: &str, rates: &[f64], confidence: f64) {
    let promised = 1.0 - confidence;
    let error = 3.0 * (promised * confidence / FLIGHTS as f64).sqrt();
    let largest = rates.iter().copied().fold(0.0, f64::max);
    println!("{name}: {largest} of {promised} promised");
    assert!(largest <= promised + error, "{name}: {largest}");
    assert!(
        largest >= 0.8 * promised - error,
        "{name}: {largest} is too cautious"
    );
}

fn sphere(radius: f64) -> Constraint {
    Constraint::state(KeepOutSphere::new(Vector3::zeros(), radius).expect("a sphere"))
}

#[test]
fn flights_with_feedback_pass_a_sphere_with_the_promised_rate() {
    let still = Vector3::zeros();
    let ends = [
        at(Vector3::new(-2.0, 0.3, 0.1), still, still),
        at(Vector3::new(2.0, 0.0, 0.0), still, still),
    ];
    let uncertainty = Uncertainty {
        position: 0.02,
        velocity: 0.004,
        force_error: 0.03,
        feedback: true,
        ..Uncertainty::default()
    };
    let transfer = transfer(0.0, 10.0, 80, ends)
        .with_motion(Motion::Translation)
        .with_constraints(&[sphere(0.6)]);
    for confidence in [0.9, 0.99] {
        let chances = Chances::new(uncertainty, confidence).expect("chances");
        let plan = planned(&transfer.clone().with_chances(chances)).expect("a plan");
        let inside = |state: &BodyState| state.position.norm() < 0.6;
        let rates = violations(&plan, &uncertainty, 0.0, inside);
        check("sphere", &rates, confidence);
    }
    // Without chances half of the flights touch it.
    let plan = planned(&transfer).expect("a plan");
    let inside = |state: &BodyState| state.position.norm() < 0.6;
    let uncertain = Uncertainty {
        feedback: false,
        ..uncertainty
    };
    let rates = violations(&plan, &uncertain, 0.0, inside);
    assert!(rates.iter().any(|rate| *rate > 0.3));
}

#[test]
fn open_loop_slews_keep_a_cone_and_a_rate_with_the_promised_rate() {
    let still = Vector3::zeros();
    let ends = [
        at(still, still, still),
        at(still, still, Vector3::new(0.0, 0.0, 1.6)),
    ];
    let direction = Vector3::new(0.7, 0.7, 0.05);
    let cone = KeepOutCone::new(Vector3::x(), direction, 0.3).expect("a cone");
    let rate = AngularRate::new(0.30, body().inertia()).expect("a rate");
    let uncertainty = Uncertainty {
        attitude: 0.01,
        angular_velocity: 0.002,
        moment_error: 0.02,
        ..Uncertainty::default()
    };
    let confidence = 0.95;
    let chances = Chances::new(uncertainty, confidence).expect("chances");
    let transfer = transfer(0.0, 8.0, 60, ends)
        .with_motion(Motion::Rotation)
        .with_constraints(&[Constraint::state(cone), Constraint::state(rate)])
        .with_chances(chances);
    let plan = planned(&transfer).expect("a plan");
    let near = |state: &BodyState| (state.attitude * Vector3::x()).angle(&direction) < 0.3;
    check(
        "cone",
        &violations(&plan, &uncertainty, 0.0, near),
        confidence,
    );
    let fast = |state: &BodyState| state.angular_velocity(&body()).norm() > 0.30;
    check(
        "rate",
        &violations(&plan, &uncertainty, 0.0, fast),
        confidence,
    );
}

/// Everything is uncertain, near a center that attracts.
#[test]
fn flights_in_a_corridor_stay_with_the_promised_rate() {
    let ends = [
        at(
            Vector3::new(3.0, 0.0, 0.0),
            Vector3::new(0.0, 0.3, 0.0),
            Vector3::zeros(),
        ),
        at(
            Vector3::new(2.0, 1.5, 0.2),
            Vector3::zeros(),
            Vector3::new(0.3, 0.2, 0.8),
        ),
    ];
    let apex = Vector3::new(1.7, 1.5, 0.2);
    let axis = Vector3::new(1.0, -0.2, 0.0).normalize();
    let corridor = Corridor::new(apex, axis, 0.5).expect("a corridor");
    let uncertainty = Uncertainty {
        position: 0.01,
        velocity: 0.003,
        attitude: 0.01,
        angular_velocity: 0.003,
        force_error: 0.02,
        moment_error: 0.02,
        feedback: true,
        ..Uncertainty::default()
    };
    let confidence = 0.97;
    let chances = Chances::new(uncertainty, confidence).expect("chances");
    let transfer = transfer(1.0, 4.0, 60, ends)
        .with_constraints(&[Constraint::state(corridor)])
        .with_chances(chances);
    let plan = planned(&transfer).expect("a plan");
    let outside = |state: &BodyState| (state.position - apex).angle(&axis) > 0.5;
    check(
        "corridor",
        &violations(&plan, &uncertainty, 1.0, outside),
        confidence,
    );
}

/// A body that holds still needs room for its spin all the same: the gradient of the rate vanishes there.
#[test]
fn a_rate_about_rest_needs_room_for_its_deviations() {
    let still = Vector3::zeros();
    let ends = [at(still, still, still), at(still, still, still)];
    let rate = AngularRate::new(0.05, body().inertia()).expect("a rate");
    let spinning = |angular_velocity| {
        let uncertainty = Uncertainty {
            angular_velocity,
            ..Uncertainty::default()
        };
        let transfer = transfer(0.0, 8.0, 20, ends)
            .with_motion(Motion::Rotation)
            .with_constraints(&[Constraint::state(rate)])
            .with_chances(Chances::new(uncertainty, 0.99).expect("chances"));
        planned(&transfer)
    };
    assert!(spinning(0.01).is_ok());
    let error = spinning(0.05).expect_err("no room for the spin");
    assert!(error.to_string().contains("constraint 0"), "{error}");
}

#[test]
fn what_cannot_hold_with_a_probability_is_refused() {
    let still = Vector3::zeros();
    let ends = [
        at(Vector3::new(-2.0, 0.3, 0.1), still, still),
        at(Vector3::new(0.7, 0.0, 0.0), still, still),
    ];
    let uncertainty = Uncertainty {
        position: 0.1,
        ..Uncertainty::default()
    };
    let chances = Chances::new(uncertainty, 0.999).expect("chances");
    let transfer = transfer(0.0, 10.0, 40, ends)
        .with_motion(Motion::Translation)
        .with_constraints(&[sphere(0.6)])
        .with_chances(chances);
    // The target is 0.1 outside of the sphere, one standard deviation.
    let error = planned(&transfer).expect_err("no room at the target");
    assert!(
        matches!(
            error,
            PlanError::Infeasible {
                constraint: 0,
                step: 39,
                ..
            }
        ),
        "{error}"
    );
    let settings = SearchSettings {
        starts: 2,
        ..SearchSettings::default()
    };
    let error = search(&transfer, &settings, |_| true).expect_err("no room at the target");
    assert!(matches!(error, PlanError::Infeasible { .. }), "{error}");
}

/// Without gravity and in open loop positions deviate alike in all directions, so that a sphere with the probability of two standard
/// deviations is one that grows by twice the deviation. All minima touch it, and the cheapest costs no more than the plan of a cold start.
#[test]
fn minima_keep_a_sphere_with_a_probability() {
    let still = Vector3::zeros();
    let ends = [
        at(Vector3::new(-2.0, 0.3, 0.1), still, still),
        at(
            Vector3::new(1.4, 0.0, 0.0),
            still,
            Vector3::new(0.0, 0.0, 2.0),
        ),
    ];
    let (position, velocity) = (0.03, 0.02);
    let uncertainty = Uncertainty {
        position,
        velocity,
        ..Uncertainty::default()
    };
    let transfer = transfer(0.0, 10.0, 40, ends)
        .with_constraints_at_ends(&[sphere(0.6)])
        .with_chances(Chances::new(uncertainty, 0.977_249_868_051_820_8).expect("chances"));
    let settings = SearchSettings {
        starts: 12,
        ..SearchSettings::default()
    };
    let mut last = 0;
    let minima = search(&transfer, &settings, |now| {
        assert!(
            now.iteration >= last,
            "iterations are counted consecutively"
        );
        last = now.iteration;
        true
    });
    let minima = minima.expect("minima");
    assert!(minima.len() > 1, "{}", minima.len());
    let cold = planned(&transfer).expect("a plan");
    assert!(minima[0].plan.cost <= cold.cost * (1.0 + 1e-6));
    for minimum in &minima {
        let states = minimum.plan.states.iter().enumerate().skip(1);
        let spare = states.map(|(end, state)| {
            let moved = velocity * transfer.h() * end as f64;
            let deviation = (position * position + moved * moved).sqrt();
            state.position.norm() - (0.6 + 2.0 * deviation)
        });
        let spare = spare.fold(f64::INFINITY, f64::min);
        assert!((-1e-5..1e-3).contains(&spare), "{spare:e}");
    }
}
