//! Constraints that hold with a probability under thrusters and wheels that err, counted over ten thousand flights of the propagator.

use fastrand::Rng;
use lgvi_control::constraint::{CommandLimit, KeepOutCone, KeepOutSphere};
use lgvi_control::{
    Actuation, Allocation, Chances, Command, Constraint, Dynamics, Motion, NewtonSettings, Place,
    Plan, Start, Terminal, Transfer, Uncertainty, miss, solve,
};
use lgvi_dynamics::gravity::Sources;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::thrusters::{Propellant, Thruster, Thrusters};
use lgvi_dynamics::wheels::{ReactionWheel, Wheels};
use lgvi_dynamics::{BodyState, Inertia, Load, Method, RigidBody, Simulation, System};
use lgvi_lie::exp;
use nalgebra::Vector3;

use crate::chances::{FLIGHTS, check, normal, normals};
use crate::thrusters::pairs;

fn body() -> RigidBody {
    let inertia = Inertia::principal([1.0, 1.4, 1.9]).expect("inertia");
    RigidBody::new(2.0, inertia, Vec::new()).expect("a body")
}

fn at(position: [f64; 3], turn: [f64; 3]) -> BodyState {
    let still = Vector3::zeros();
    BodyState::from_velocities(&body(), position.into(), still, exp(&turn.into()), still)
}

/// The share of flights that violate a constraint at the end of each step. Actuators hold commands within their limits.
fn violations(
    body: &RigidBody,
    plan: &Plan,
    uncertainty: &Uncertainty,
    violates: impl Fn(&BodyState) -> bool,
) -> Vec<f64> {
    let thrusters = body.thrusters().map_or(0, |all| all.states().len());
    let count = thrusters.max(body.wheels().map_or(0, |all| all.states().len()));
    let allocation = match (body.thrusters(), body.wheels()) {
        (Some(thrusters), _) => Allocation::of_thrusters(thrusters),
        (None, Some(wheels)) => Allocation::of_wheels(wheels),
        (None, None) => panic!("no actuators"),
    };
    let allocation = allocation.expect("an allocation");
    let mut rng = Rng::with_seed(11);
    let mut counts = vec![0_usize; plan.commands.len()];
    for _ in 0..FLIGHTS {
        let mut start = plan.states[0];
        start.position += uncertainty.position * normals(&mut rng);
        start.linear_momentum += body.mass() * uncertainty.velocity * normals(&mut rng);
        start.attitude *= exp(&(uncertainty.attitude * normals(&mut rng)));
        let spin = uncertainty.angular_velocity * normals(&mut rng);
        start.angular_momentum += body.inertia().matrix() * spin;
        let factors: Vec<_> = (0..count)
            .map(|_| 1.0 + uncertainty.actuator_error * normal(&mut rng))
            .collect();
        let system = System::new(vec![body.clone()], Vec::new());
        let method = Method::Lgvi(Rotor::default());
        let mut flight = Simulation::new(system, vec![start], method, plan.h).expect("a flight");
        flight.set_thruster_factors(0, &factors);
        flight.set_wheel_factors(0, &factors);
        for (k, violated) in counts.iter_mut().enumerate() {
            let mut command: Command = plan.commands[k];
            if uncertainty.feedback {
                let off = miss(&plan.states[k], &flight.states()[0]);
                command -= plan.actuator_feedback[k] * off;
                command = allocation.within_limits(&command, |_| false);
            }
            let command = &command.as_slice()[..count];
            if body.thrusters().is_some() {
                flight.set_thruster_commands(0, command);
            } else {
                flight.set_wheel_commands(0, command);
            }
            flight.advance(&[Load::default()]).expect("a step");
            *violated += usize::from(violates(&flight.states()[0]));
        }
    }
    let share = |count: &usize| *count as f64 / FLIGHTS as f64;
    counts.iter().map(share).collect()
}

fn transfer(body: RigidBody, n: usize, ends: [BodyState; 2], actuation: Actuation) -> Transfer {
    let [start, end] = ends;
    let mut end = Terminal::try_from(end).expect("a target");
    if actuation.is_of_wheels() {
        end = end.without(Place::Position);
    }
    let h = 10.0 / n as f64;
    let nothing = Sources::new(Vec::new());
    Transfer::new(body, nothing, h, n, start, end, actuation)
        .expect("a transfer")
        .with_dynamics(Dynamics::Lgvi)
}

#[test]
fn thrusters_pass_a_sphere_with_the_promised_rate() {
    let limit = 0.6;
    let thrusters = pairs().into_iter().map(|thruster| Thruster {
        thrust: limit,
        ..thruster
    });
    let none = Propellant {
        mass: 0.0,
        inertia: None,
    };
    let thrusters = Thrusters::new(thrusters.collect(), none).expect("thrusters");
    let actuation = Actuation::thrusters(&thrusters, &[1.0; 12]).expect("an actuation");
    let body = body().with_thrusters(thrusters).expect("a body");
    let ends = [
        at([-2.0, 0.3, 0.1], [0.0; 3]),
        at([2.0, 0.3, 0.0], [0.2, 0.1, 0.7]),
    ];
    let (center, radius) = (Vector3::new(0.0, -2.4, 0.0), 3.0);
    let sphere = KeepOutSphere::new(center, radius).expect("a sphere");
    let one_sided = CommandLimit::new(&[limit; 12]).expect("limits").one_sided();
    let transfer = transfer(body.clone(), 60, ends, actuation)
        .with_constraints(&[Constraint::state(sphere), Constraint::commands(one_sided)]);
    let inside = |state: &BodyState| (state.position - center).norm() < radius;
    for feedback in [false, true] {
        let uncertainty = Uncertainty {
            position: 0.01,
            velocity: 0.002,
            attitude: 0.005,
            angular_velocity: 0.001,
            actuator_error: 0.03,
            feedback,
            ..Uncertainty::default()
        };
        let confidence = 0.97;
        let chances = Chances::new(uncertainty, confidence).expect("chances");
        let sure = transfer.clone().with_chances(chances);
        let plan = solve(&sure, Start::Cold, &NewtonSettings::default(), |_| true);
        let plan = plan.expect("a plan");
        let rates = violations(&body, &plan, &uncertainty, inside);
        check(&format!("sphere, feedback {feedback}"), &rates, confidence);
    }
}

#[test]
fn wheels_keep_a_cone_with_the_promised_rate() {
    let axes = [
        [1.0, 0.0, 0.5],
        [-0.5, 0.8, 0.5],
        [-0.5, -0.8, 0.5],
        [0.0, 0.0, 1.0],
    ];
    let wheels = axes.map(|axis| ReactionWheel {
        max_torque: 1.0,
        ..ReactionWheel::new(Vector3::from(axis), 0.02)
    });
    let mut wheels = Wheels::new(wheels.to_vec()).expect("wheels");
    wheels.set_speeds(&[20.0, -10.0, 5.0, 10.0], &Vector3::zeros());
    let actuation = Actuation::wheels(&wheels, &[1.0; 4]).expect("an actuation");
    let body = body().with_wheels(wheels).expect("a body");
    let ends = [at([0.0; 3], [0.0; 3]), at([0.0; 3], [0.0, 0.0, 1.6])];
    let direction = Vector3::new(0.7, 0.7, 0.05);
    let cone = KeepOutCone::new(Vector3::x(), direction, 0.3).expect("a cone");
    let limits = CommandLimit::new(&[1.0; 4]).expect("limits");
    let transfer = transfer(body.clone(), 60, ends, actuation)
        .with_motion(Motion::Rotation)
        .with_constraints(&[Constraint::state(cone), Constraint::commands(limits)]);
    let near = |state: &BodyState| (state.attitude * Vector3::x()).angle(&direction) < 0.3;
    for feedback in [false, true] {
        let uncertainty = Uncertainty {
            attitude: 0.01,
            angular_velocity: 0.002,
            actuator_error: 0.03,
            feedback,
            ..Uncertainty::default()
        };
        let confidence = 0.95;
        let chances = Chances::new(uncertainty, confidence).expect("chances");
        let sure = transfer.clone().with_chances(chances);
        let plan = solve(&sure, Start::Cold, &NewtonSettings::default(), |_| true);
        let plan = plan.expect("a plan");
        let rates = violations(&body, &plan, &uncertainty, near);
        check(&format!("cone, feedback {feedback}"), &rates, confidence);
    }
}
