//! Orders of convergence against reference trajectories.

use super::{A1, B1, B2, D, assert_order, attracting};
use crate::case::Case;
use lgvi_dynamics::integrator::RungeKutta;
use lgvi_dynamics::{
    BodyState, Drive, Inertia, Integrator, Load, Method, Mobility, PointMass, RigidBody, Simulation,
};
use nalgebra::Vector3;

#[test]
fn fixed_step_methods_have_their_order() {
    let second = [
        Method::ExplicitMidpoint,
        Method::ImplicitMidpoint,
        Method::CrouchGrossman,
    ];
    for (case, t, steps) in [
        (A1, 2.0, 2_000),
        (B1, 10.0, 1_000),
        (B2, 10.0, 1_000),
        (D, 10.0, 4_000),
    ] {
        let reference = Case::load(case);
        let errors = |method, steps: u32| {
            [0, 1, 2, 3].map(|halving| reference.errors_at(t, steps << halving, method).greatest())
        };
        for method in second {
            assert_order(
                &format!("{case} {method:?}"),
                &errors(method, steps),
                2.0,
                0.05,
            );
        }
        let method = Method::RungeKutta4;
        assert_order(
            &format!("{case} {method:?}"),
            &errors(method, steps / 4),
            4.0,
            0.15,
        );
    }
}

#[test]
fn embedded_methods_are_of_eighth_order_with_fixed_steps() {
    for (case, t, steps) in [(A1, 1.0, 10), (B1, 10.0, 12), (D, 1.0, 4)] {
        let reference = Case::load(case);
        for make in [RungeKutta::fehlberg8, RungeKutta::dormand_prince8] {
            let errors = [0, 1, 2].map(|halving| {
                let (mut system, mut states) = reference.system();
                let controls = vec![Load::default(); states.len()];
                let mut method = make(system.bodies());
                let steps = steps << halving;
                let h = t / f64::from(steps);
                for _ in 0..steps {
                    method
                        .step(&mut system, &mut states, &controls, h)
                        .expect("a step");
                }
                reference
                    .compare_states(t, system.bodies(), &states)
                    .greatest()
            });
            assert_order(case, &errors, 8.0, 0.5);
        }
    }
}

/// A driven body on a circle attracts a pivoted and a free dumbbell. If the driven body were not evaluated at the time
/// of each stage, the methods would lose their order.
#[test]
fn driven_bodies_are_where_they_are_at_every_stage() {
    let build = || {
        let dumbbell = |mass: f64| {
            let points = [0.1, -0.1].map(|x| PointMass {
                mass: 0.5 * mass,
                position: Vector3::new(x, 0.0, 0.0),
            });
            let moments = [0.005, 0.012, 0.012].map(|moment| moment * mass);
            let inertia = Inertia::principal(moments).expect("inertia");
            RigidBody::new(mass, inertia, points.to_vec()).expect("body")
        };
        let center = Vector3::new(0.0, 0.1, 0.0);
        let drive = Drive::circle(
            center,
            Vector3::new(0.0, 0.3, 1.0),
            Vector3::new(0.4, 0.0, 0.0),
        );
        let bodies = vec![
            dumbbell(2.0).with_mobility(Mobility::Driven(drive)),
            dumbbell(1.0).with_mobility(Mobility::Pivoted),
            dumbbell(0.5),
            dumbbell(1.0).with_mobility(Mobility::Fixed),
        ];
        let at = |index: usize, x: [f64; 3], v: [f64; 3]| {
            let omega = Vector3::new(0.3, -0.2, 0.5);
            let attitude = lgvi_lie::exp(&omega);
            BodyState::from_velocities(&bodies[index], x.into(), v.into(), attitude, omega)
        };
        let states = vec![
            at(0, [0.7, 0.0, 0.0], [0.0; 3]),
            at(1, [-0.6, 0.2, 0.3], [0.0; 3]),
            at(2, [0.0, 2.5, 0.0], [-0.9, 0.0, 0.3]),
            at(3, [0.0, -1.0, -0.8], [0.0; 3]),
        ];
        (attracting(bodies), states)
    };
    let t = 2.0;
    let end = |method, steps: u32| {
        let (system, states) = build();
        let mut simulation =
            Simulation::new(system, states, method, t / f64::from(steps)).expect("a method");
        for _ in 0..steps {
            simulation.advance(&[Load::default(); 4]).expect("a step");
        }
        simulation.states().to_vec()
    };
    let error = |a: &[BodyState], b: &[BodyState]| {
        let one = |(a, b): (&BodyState, &BodyState)| {
            (a.position - b.position)
                .norm()
                .max((a.attitude - b.attitude).norm())
        };
        a.iter().zip(b).map(one).fold(0.0, f64::max)
    };
    let fine = end(Method::DormandPrince853 { tolerance: 1e-13 }, 1);
    for (method, order) in [
        (Method::ExplicitMidpoint, 2.0),
        (Method::ImplicitMidpoint, 2.0),
        (Method::CrouchGrossman, 2.0),
        (Method::RungeKutta4, 4.0),
    ] {
        let errors = [0, 1, 2, 3].map(|halving| error(&end(method, 50 << halving), &fine));
        assert_order(&format!("{method:?}"), &errors, order, 0.2);
    }
    let (system, mut start) = build();
    system.constrain(&mut start);
    assert_eq!(fine[3], start[3], "fixed");
    assert_eq!(fine[1].position, start[1].position, "pivoted");
    for steps in [1, 7, 1000] {
        let other = error(&end(Method::Fehlberg78 { tolerance: 1e-12 }, steps), &fine);
        println!("both pairs, {steps} outputs: {other:e}");
        assert!(other < 1e-10, "{steps} outputs: {other:e}");
    }
}
