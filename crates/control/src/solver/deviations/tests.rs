//! Deviations are the differences of flights of the propagator's integrator.

use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::thrusters::{Propellant, Thruster, Thrusters};
use lgvi_dynamics::wheels::{ReactionWheel, Wheels};
use lgvi_dynamics::{Inertia, Load, Method, PointMass, RigidBody, Simulation, System};
use lgvi_lie::exp;
use nalgebra::{Matrix3, Vector3};

use super::*;
use crate::constraint::CommandLimit;
use crate::{
    Allocation, Constraint, Dynamics, Motion, NewtonSettings, Place, Start, Terminal, miss, solve,
};

const N: usize = 30;

/// A body with a gravity gradient.
fn body() -> RigidBody {
    let inertia = Inertia::principal([1.0, 1.4, 1.9]).unwrap();
    let points = [Vector3::x(), -Vector3::x(), Vector3::z(), -Vector3::z()];
    let points = points.map(|position| PointMass {
        mass: 0.5,
        position: 0.3 * position,
    });
    RigidBody::new(2.0, inertia, points.to_vec()).unwrap()
}

fn thrusted() -> RigidBody {
    let mut all = Vec::new();
    for axis in 0..3 {
        for side in [1.0, -1.0] {
            let arm = side * Vector3::ith((axis + 1) % 3, 0.8);
            for sign in [1.0, -1.0] {
                all.push(Thruster::new(arm, sign * Vector3::ith(axis, 1.0), 50.0));
            }
        }
    }
    let none = Propellant {
        mass: 0.0,
        inertia: None,
    };
    let thrusters = Thrusters::new(all, none).unwrap();
    body().with_thrusters(thrusters).unwrap()
}

fn wheeled() -> RigidBody {
    let axes = [[1.0, 0.2, 0.0], [0.0, 1.0, 0.1], [0.3, 0.0, 1.0], [1.0; 3]];
    let mut wheels = axes.map(|axis| ReactionWheel::new(Vector3::from(axis), 0.02));
    wheels[0].max_torque = 100.0;
    let mut wheels = Wheels::new(wheels.to_vec()).unwrap();
    wheels.set_speeds(&[20.0, -30.0, 10.0, 5.0], &Vector3::zeros());
    body().with_wheels(wheels).unwrap()
}

fn transfer(body: RigidBody, actuation: Actuation) -> Transfer {
    let at = |position, velocity, turn| {
        BodyState::from_velocities(&body, position, velocity, exp(&turn), Vector3::zeros())
    };
    let ends = [
        at(Vector3::x(), Vector3::y(), Vector3::new(0.1, 0.0, 0.2)),
        at(
            Vector3::new(0.2, 1.1, 0.1),
            -Vector3::x(),
            Vector3::new(0.5, -0.3, 1.2),
        ),
    ];
    let (h, field) = (1.5 / N as f64, Central { gm: 1.0 });
    let [start, end] = ends;
    let mut end = Terminal::try_from(end).unwrap();
    if actuation.is_of_wheels() {
        end = end.without(Place::Position);
    }
    Transfer::new(body, field, h, N, start, end, actuation)
        .unwrap()
        .with_dynamics(Dynamics::Lgvi)
}

/// The states of the flight in which a source deviates by `size` standard deviations.
fn flight(
    transfer: &Transfer,
    uncertainty: &Uncertainty,
    plan: &Plan,
    (source, size): (usize, f64),
) -> Vec<BodyState> {
    let nominal = &transfer.body;
    let mut body = nominal.clone();
    let mut start = plan.states[0];
    let count = transfer.actuation.commands();
    let mut factors = Command::repeat(1.0);
    match source.checked_sub(OF_STATE) {
        None => {
            let off = size * uncertainty.initial(nominal, 0).column(source);
            start.position += off.fixed_rows::<3>(0);
            start.linear_momentum += off.fixed_rows::<3>(3);
            start.attitude *= exp(&off.fixed_rows::<3>(6).into_owned());
            start.angular_momentum += off.fixed_rows::<3>(9);
        }
        Some(of_body) if of_body >= count => {
            let deviated = uncertainty.deviated(nominal, of_body - count, size);
            body = deviated.unwrap();
            start = start.of_other([nominal, &body]);
        }
        Some(actuator) => {
            let error = match (body.has_actuators(), actuator < 3) {
                (true, _) => uncertainty.actuator_error,
                (false, true) => uncertainty.force_error,
                (false, false) => uncertainty.moment_error,
            };
            factors[actuator] += size * error;
        }
    }
    let system = System::new(vec![body.clone()], vec![Box::new(Central { gm: 1.0 })]);
    let method = Method::Lgvi(Rotor::default());
    let mut flight = Simulation::new(system, vec![start], method, plan.h).unwrap();
    flight.set_thruster_factors(0, &factors.as_slice()[..count]);
    flight.set_wheel_factors(0, &factors.as_slice()[..count]);
    let mut states = vec![start.of_other([&body, nominal])];
    for k in 0..plan.commands.len() {
        let seen = flight.states()[0].of_other([&body, nominal]);
        let off = miss(&plan.states[k], &seen);
        let mut load = Load::default();
        if body.has_actuators() {
            let mut command = plan.commands[k];
            if uncertainty.feedback {
                command -= plan.actuator_feedback[k] * off;
            }
            if let Some(thrusters) = body.thrusters() {
                let allocation = Allocation::of_thrusters(thrusters).unwrap();
                command = allocation.within_limits(&command, |_| false);
            }
            flight.set_thruster_commands(0, &command.as_slice()[..count]);
            flight.set_wheel_commands(0, &command.as_slice()[..count]);
        } else {
            let mut all = stacked(&plan.controls[k]);
            if uncertainty.feedback {
                all -= plan.feedback[k] * off;
            }
            all.component_mul_assign(&factors.fixed_rows::<6>(0));
            load.force = all.fixed_rows::<3>(0).into_owned();
            load.moment = all.fixed_rows::<3>(3).into_owned();
        }
        flight.advance(&[load]).unwrap();
        states.push(flight.states()[0].of_other([&body, nominal]));
    }
    states
}

fn check(name: &str, transfer: &Transfer) {
    let plan = solve(transfer, Start::Cold, &NewtonSettings::default(), |_| true).unwrap();
    for feedback in [false, true] {
        let uncertainty = Uncertainty {
            position: 0.3,
            velocity: 0.4,
            attitude: 0.5,
            angular_velocity: 0.6,
            force_error: 0.7,
            moment_error: 0.8,
            actuator_error: 0.9,
            mass: 0.4,
            inertia: 0.3,
            feedback,
        };
        let all = deviations(transfer, &uncertainty, &plan).unwrap();
        let sources = all[0].ncols();
        assert_eq!(sources, OF_STATE + transfer.actuation.commands() + OF_BODY);
        let size = 1e-5;
        for source in 0..sources {
            let [above, below] =
                [size, -size].map(|size| flight(transfer, &uncertainty, &plan, (source, size)));
            let largest = all
                .iter()
                .map(|s| s.column(source).norm())
                .fold(0.0, f64::max);
            for (k, (above, below)) in above.iter().zip(&below).enumerate() {
                let expected = miss(below, above) / (2.0 * size);
                let error = (all[k].column(source) - expected).norm() / largest;
                assert!(
                    error < 5e-6,
                    "{name}, feedback {feedback}, source {source}, step {k}: {error:e}"
                );
            }
        }
    }
}

#[test]
fn deviations_are_the_differences_of_flights() {
    let weights = Matrix3::identity();
    let loads = Actuation::full(&weights, &weights).unwrap();
    check("loads", &transfer(body(), loads));
    let thrusted = thrusted();
    let thrusters = Actuation::thrusters(thrusted.thrusters().unwrap(), &[1.0; 12]).unwrap();
    let one_sided = CommandLimit::new(&[50.0; 12]).unwrap().one_sided();
    let thrusters = transfer(thrusted, thrusters);
    check(
        "thrusters",
        &thrusters.with_constraints(&[Constraint::commands(one_sided)]),
    );
    let wheeled = wheeled();
    let wheels = Actuation::wheels(wheeled.wheels().unwrap(), &[1.0; 4]).unwrap();
    check(
        "wheels",
        &transfer(wheeled, wheels).with_motion(Motion::Rotation),
    );
}
