use lgvi_dynamics::gravity::Multipole;
use lgvi_dynamics::{BodyState, Inertia, PointMass, RigidBody};
use lgvi_lie::exp;
use nalgebra::{Matrix3, Vector3};

use super::Units;
use crate::discrete::{DiscreteDynamics, KickDriftKick};
use crate::{Actuation, Dynamics, NewtonSettings, Start, Transfer, solve};

/// A satellite in a low orbit, in meters: it moves ahead by a kilometer and turns.
fn transfer(dynamics: Dynamics) -> Transfer {
    let (gm, radius, mass) = (3.986e14, 7e6, 4.0);
    let inertia = Inertia::principal([0.007, 0.03, 0.033]).unwrap();
    let ends = [0.1, -0.1].map(|x| PointMass {
        mass: 0.5 * mass,
        position: Vector3::new(x, 0.0, 0.0),
    });
    let at = |angle: f64, attitude: Matrix3<f64>| {
        let turn = exp(&Vector3::new(0.0, 0.0, angle));
        let speed = f64::sqrt(gm / radius);
        BodyState {
            position: radius * turn.column(0),
            linear_momentum: mass * speed * turn.column(1),
            attitude,
            angular_momentum: Vector3::zeros(),
        }
    };
    let (initial, target) = (
        at(0.0, Matrix3::identity()),
        at(0.43 + 1e3 / radius, exp(&Vector3::new(0.5, 0.2, 0.7))),
    );
    let identity = Matrix3::identity();
    Transfer::new(
        RigidBody::new(mass, inertia, ends.to_vec()).unwrap(),
        Multipole::oblate(gm, 1.08e-3, 6.378e6),
        4.0,
        100,
        initial,
        target,
        Actuation::full(&identity, &identity).unwrap(),
    )
    .unwrap()
    .with_dynamics(dynamics)
}

/// The states of a plan are those of its controls in the units of the transfer, bit for bit.
#[test]
fn plans_fly_in_the_units_that_they_are_stated_in() {
    for dynamics in [Dynamics::LieEuler, Dynamics::Lgvi] {
        let transfer = transfer(dynamics);
        let settings = NewtonSettings::default();
        let plan = solve(&transfer, Start::Cold, &settings, |_| true).unwrap();
        assert!(plan.certificate.terminal <= settings.violation && plan.certificate.sufficient);
        let steps = KickDriftKick::full(&transfer);
        let mut state = transfer.initial;
        for (k, command) in plan.commands.iter().enumerate() {
            assert_eq!(state, plan.states[k]);
            state = steps.next(k, &state, command).unwrap();
        }
        assert_eq!(plan.states.last(), Some(&state));
    }
}

/// The units of a transfer in its own units are one.
#[test]
fn units_of_a_transfer_in_its_own_are_ones() {
    let transfer = transfer(Dynamics::Lgvi);
    let units = Units::of(&transfer);
    let own = units.transfer(&transfer).unwrap();
    let again = Units::of(&own);
    assert_eq!([again.time, again.length, again.cost], [1.0; 3]);
    assert_eq!([again.linear_momentum, again.angular_momentum], [1.0; 2]);
    assert!(again.commands.iter().all(|unit| *unit == 1.0));
}
