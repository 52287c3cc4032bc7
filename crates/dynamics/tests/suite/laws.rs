//! Laws of motion that every integrator must satisfy, and its behavior if a step cannot be made.

use crate::case::Case;
use lgvi_dynamics::gravity::{Central, Gravity, Mutual};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{
    BodyState, Inertia, Load, Method, PointMass, RigidBody, Simulation, StepError, System,
};
use nalgebra::{Matrix3, Vector3};

const METHODS: [Method; 2] = [
    Method::Lgvi(Rotor::Discrete),
    Method::LieEuler(Rotor::Discrete),
];

fn free_body(omega: Vector3<f64>) -> (System, Vec<BodyState>) {
    let inertia = Inertia::principal([1.0, 2.0, 2.5]).expect("inertia");
    let body = RigidBody::new(1.0, inertia, vec![]).expect("body");
    let zero = Vector3::zeros();
    let state = BodyState::from_velocities(&body, zero, zero, Matrix3::identity(), omega);
    (System::new(vec![body], vec![]), vec![state])
}

/// The momentum update is a rotation instead of a matrix product, so its rounding errors are unbiased and grow as √n.
/// The rounding error of the attitude is corrected in each step.
#[test]
fn rounding_does_not_accumulate_over_ten_million_steps() {
    let method = Method::Lgvi(Rotor::Discrete);
    let (system, states) = free_body(Vector3::new(1.0, 0.5, -0.75));
    let momentum = states[0].angular_momentum.norm_squared();
    let mut simulation = Simulation::new(system, states, method, 0.01).expect("a method");
    let inertial = simulation.invariants().angular_momentum;
    let mut orthogonality = 0.0_f64;
    for step in 0..10_000_000 {
        simulation.advance(&[Load::default()]).expect("a step");
        if step % 1000 == 0 {
            orthogonality = orthogonality.max(simulation.invariants().orthogonality_error);
        }
    }
    let drift = (simulation.states()[0].angular_momentum.norm_squared() / momentum - 1.0).abs();
    let turned = (simulation.invariants().angular_momentum - inertial).norm() / inertial.norm();
    println!("{method:?}: |Π|² {drift:.1e}, R Π {turned:.1e}, RᵀR {orthogonality:.1e}");
    assert!(drift < 5e-13, "{method:?}: |Π|² drifted by {drift:e}");
    assert!(turned < 1e-12, "{method:?}: R Π drifted by {turned:e}");
    assert!(
        orthogonality < 2e-15,
        "{method:?}: RᵀR − I reached {orthogonality:e}"
    );
}

#[test]
fn mutual_gravity_keeps_total_momenta_to_rounding_and_energy_bounded() {
    let case = Case::load("a1_two_dumbbells_regular");
    for method in METHODS {
        let mut simulation = case.simulation(method, 0.002);
        let start = simulation.invariants();
        let mut energy = 0.0_f64;
        for _ in 0..15_000 {
            simulation.advance(&[Load::default(); 2]).expect("a step");
            energy = energy.max((simulation.invariants().energy - start.energy).abs());
        }
        let end = simulation.invariants();
        assert!(
            (end.linear_momentum - start.linear_momentum).norm() < 1e-13,
            "{method:?}"
        );
        let angular = (end.angular_momentum - start.angular_momentum).norm();
        assert!(angular < 1e-12, "{method:?}: {angular:e}");
        // First order: proportional to h. Second order: proportional to h².
        let bound = if matches!(method, Method::Lgvi(_)) {
            1e-4
        } else {
            2e-2
        };
        assert!(
            energy < bound,
            "{method:?}: energy error reached {energy:e}"
        );
    }
}

#[test]
fn the_lgvi_retraces_its_path_when_the_momenta_are_reversed() {
    let case = Case::load("d_dumbbell_central");
    let method = Method::Lgvi(Rotor::Discrete);
    let reverse = |states: &[BodyState]| -> Vec<BodyState> {
        let reversed = |s: &BodyState| BodyState {
            linear_momentum: -s.linear_momentum,
            angular_momentum: -s.angular_momentum,
            ..*s
        };
        states.iter().map(reversed).collect()
    };
    let mut there = case.simulation(method, 0.01);
    let start = there.states().to_vec();
    for _ in 0..1000 {
        there.advance(&[Load::default()]).expect("a step");
    }
    let gravity: Vec<Box<dyn Gravity>> = vec![Box::new(Central { gm: 1.0 })];
    let system = System::new(there.system().bodies().to_vec(), gravity);
    let mut back =
        Simulation::new(system, reverse(there.states()), method, 0.01).expect("a method");
    for _ in 0..1000 {
        back.advance(&[Load::default()]).expect("a step");
    }
    let end = reverse(back.states());
    assert!((end[0].position - start[0].position).norm() < 1e-11);
    assert!((end[0].attitude - start[0].attitude).norm() < 1e-11);
    assert!((end[0].angular_momentum - start[0].angular_momentum).norm() < 1e-12);
}

#[test]
fn controls_act_as_constant_force_and_moment() {
    // A sphere under constant force and a moment along its spin axis has closed-form motion. The second-order method
    // reproduces it to rounding. Lie–Euler has a position error of half the velocity change of a step.
    let inertia = Inertia::principal([2.0; 3]).expect("inertia");
    let body = RigidBody::new(4.0, inertia, vec![]).expect("body");
    let zero = Vector3::zeros();
    let state = BodyState::from_velocities(&body, zero, zero, Matrix3::identity(), zero);
    let control = Load {
        force: Vector3::new(8.0, 0.0, 0.0),
        moment: Vector3::new(0.0, 0.0, 1.0),
    };
    let (h, steps) = (0.01, 100);
    for (method, lag) in [(METHODS[0], 0.0), (METHODS[1], 0.5 * h)] {
        let system = System::new(vec![body.clone()], vec![]);
        let mut simulation = Simulation::new(system, vec![state], method, h).expect("a method");
        for _ in 0..steps {
            simulation.advance(&[control]).expect("a step");
        }
        let end = simulation.states()[0];
        assert!((end.linear_momentum.x - 8.0).abs() < 1e-13);
        assert!((end.angular_momentum.z - 1.0).abs() < 1e-13);
        assert!(
            (end.position.x - (1.0 - 2.0 * lag)).abs() < 1e-13,
            "{method:?}: {}",
            end.position
        );
    }
}

#[test]
fn a_step_that_turns_too_far_is_an_error_and_leaves_the_state() {
    for method in METHODS {
        let (system, states) = free_body(Vector3::new(0.0, 0.0, 1.0));
        let mut simulation =
            Simulation::new(system, states.clone(), method, 1.001).expect("a method");
        match simulation.advance(&[Load::default()]) {
            Err(StepError::Unsolvable { body: 0, source }) => {
                assert!((source.turn - 1.001).abs() < 1e-12);
                assert!(source.margin < 0.0);
            }
            other => panic!("{method:?}: {other:?}"),
        }
        assert_eq!(simulation.states(), states);
        assert_eq!(simulation.step(), 0);

        let (system, states) = free_body(Vector3::new(0.0, 0.0, 1.0));
        let mut simulation = Simulation::new(system, states, method, 0.999).expect("a method");
        simulation
            .advance(&[Load::default()])
            .expect("just below the limit");
    }
}

#[test]
fn meeting_points_of_mass_are_an_error() {
    let inertia = || Inertia::principal([1.0; 3]).expect("inertia");
    let point = PointMass {
        mass: 1.0,
        position: Vector3::zeros(),
    };
    let body = RigidBody::new(1.0, inertia(), vec![point]).expect("body");
    let zero = Vector3::zeros();
    let at = |x: f64, v: f64| {
        let (x, v) = (Vector3::new(x, 0.0, 0.0), Vector3::new(v, 0.0, 0.0));
        BodyState::from_velocities(&body, x, v, Matrix3::identity(), zero)
    };
    let cayley = Rotor::Discrete;
    // With the first method the points coincide at the end of the step. With the others they coincide at the start.
    for (method, distance) in [
        (Method::LieEuler(cayley), 1.0),
        (Method::Lgvi(cayley), 0.0),
        (Method::LagrangianLgvi, 0.0),
    ] {
        let states = vec![at(0.0, 0.0), at(distance, -1.0)];
        let gravity: Vec<Box<dyn Gravity>> = vec![Box::new(Mutual::new(1e-300))];
        let system = System::new(vec![body.clone(), body.clone()], gravity);
        let mut simulation = Simulation::new(system, states, method, 1.0).expect("a method");
        let error = simulation
            .advance(&[Load::default(); 2])
            .expect_err("a collision");
        assert_eq!(error, StepError::NotFinite { body: 0 }, "{method}");
    }
}
