//! Free, pivoted, fixed and driven bodies attract each other, and every method that supports them keeps its order.

use crate::conformance::promises;
use lgvi_dynamics::gravity::{Gravity, Mutual};
use lgvi_dynamics::{
    BodyState, Drive, Inertia, Load, Method, Mobility, PointMass, RigidBody, Simulation, System,
};
use lgvi_lie::exp;
use nalgebra::Vector3;

/// Two free bodies and one of each other mobility, each of two points.
fn company() -> (System, Vec<BodyState>) {
    let drive = Drive {
        velocity: Vector3::new(0.0, 0.0, 0.05),
        rate: Vector3::new(0.0, 0.1, 0.3),
        spin: Vector3::new(0.2, 0.1, 0.0),
    };
    let mobilities = [
        Mobility::Free,
        Mobility::Free,
        Mobility::Pivoted,
        Mobility::Fixed,
        Mobility::Driven(drive),
    ];
    let (mut bodies, mut states) = (Vec::new(), Vec::new());
    for (mobility, i) in mobilities.into_iter().zip((0..).map(f64::from)) {
        let inertia = Inertia::principal([0.010, 0.015, 0.020]).expect("inertia");
        let point = |sign: f64| PointMass {
            mass: 0.5,
            position: sign * Vector3::new(0.1, 0.0, 0.02),
        };
        let body = RigidBody::new(1.0, inertia, vec![point(1.0), point(-1.0)]).expect("body");
        let body = body.with_mobility(mobility);
        states.push(BodyState::from_velocities(
            &body,
            Vector3::new(1.5 * i, libm::sin(0.7 * i), 0.3 * libm::cos(i)),
            Vector3::new(0.1, 0.2 - 0.1 * i, 0.05),
            exp(&Vector3::new(0.3, -0.2, 0.4 * i)),
            Vector3::new(0.5, 0.1 * i - 0.3, 0.7),
        ));
        bodies.push(body);
    }
    let gravity: Vec<Box<dyn Gravity>> = vec![Box::new(Mutual::new(1.0))];
    (System::new(bodies, gravity), states)
}

/// The states at time 0.5.
fn end(method: Method, steps: u32) -> Option<Vec<BodyState>> {
    let (system, states) = company();
    let controls = vec![Load::default(); states.len()];
    let mut simulation = Simulation::new(system, states, method, 0.5 / f64::from(steps)).ok()?;
    for _ in 0..steps {
        simulation.advance(&controls).expect("a step");
    }
    Some(simulation.states().to_vec())
}

#[test]
fn bodies_of_every_mobility_move_to_the_order_of_the_method() {
    let tolerance = 1e-14;
    let reference = end(Method::DormandPrince853 { tolerance }, 1).expect("a method");
    let mut flown = 0;
    for promise in promises()
        .iter()
        .filter(|promise| !(promise.free || promise.central))
    {
        let method = promise.method;
        let errors = [5, 10, 20, 40].map(|steps| {
            let each = end(method, steps)?;
            let apart = each.iter().zip(&reference).map(|(a, b)| {
                let linear = (a.linear_momentum - b.linear_momentum).norm();
                let angular = (a.angular_momentum - b.angular_momentum).norm();
                let pose = (a.position - b.position).norm() + (a.attitude - b.attitude).norm();
                pose + linear + angular
            });
            Some(apart.fold(0.0, f64::max))
        });
        println!("{method}: {errors:?}");
        let [Some(a), Some(b), Some(c), Some(d)] = errors else {
            // The Lagrangian form rejects fixed and driven bodies.
            assert!(matches!(method, Method::LagrangianLgvi), "{method}");
            continue;
        };
        flown += 1;
        for pair in [a, b, c, d].windows(2).filter(|pair| pair[1] > 1e-11) {
            let found = (pair[0] / pair[1]).log2();
            assert!(
                found > 0.85 * f64::from(promise.order),
                "{method}: {errors:?}"
            );
        }
        assert!(d < 1e-2, "{method}: {errors:?}");
    }
    assert!(flown > 20);
}
