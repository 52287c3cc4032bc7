//! Half motions of bodies whose other half is affected by gravity.

use lgvi_control::{Actuation, Motion, NewtonSettings, Place, Plan, Start, Transfer, miss, solve};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{BodyState, Method, Simulation, System};
use nalgebra::Matrix3;

use crate::case::Case;

const N: usize = 100;

fn transfer(motion: Motion) -> Transfer {
    let case = Case::load("C_i");
    let plain = case.transfer(N);
    let terminal = plain.target().clone().without(match motion {
        Motion::Translation => Place::Attitude,
        _ => Place::Position,
    });
    let weight = Matrix3::identity();
    Transfer::new(
        case.body(),
        Central { gm: 1.0 },
        plain.h(),
        N,
        *plain.initial(),
        terminal,
        Actuation::full(&weight, &weight).expect("weights"),
    )
    .expect("a transfer")
    .with_motion(motion)
}

/// The state to which the propagator flies a plan.
fn flown(transfer: &Transfer, plan: &Plan) -> BodyState {
    let gravity = Box::new(Central { gm: 1.0 });
    let system = System::new(vec![Case::load("C_i").body()], vec![gravity]);
    let method = Method::LieEuler(Rotor::default());
    let start = vec![*transfer.initial()];
    let mut flight = Simulation::new(system, start, method, transfer.h()).expect("a flight");
    for control in &plan.controls {
        flight
            .advance(std::slice::from_ref(control))
            .expect("a step");
    }
    flight.states()[0]
}

/// The body is a dumbbell whose size is a quarter of the orbit's radius.
#[test]
fn half_a_motion_arrives_as_flown_where_gravity_couples_it_to_the_other() {
    let target = Case::load("C_i")
        .transfer(N)
        .target()
        .state()
        .expect("a state");
    for (motion, rows) in [(Motion::Translation, 0..6), (Motion::Rotation, 6..12)] {
        let transfer = transfer(motion);
        let settings = NewtonSettings::default();
        let mut last = 0;
        let plan = solve(&transfer, Start::Cold, &settings, |now| {
            assert!(now.iteration >= last);
            last = now.iteration;
            true
        })
        .expect("a plan");
        let found = &plan.certificate;
        assert!(found.terminal <= 1e-12 && found.stationarity <= 1e-8 && found.sufficient);
        let off = miss(&target, &flown(&transfer, &plan));
        let off = off.rows(rows.start, 6).norm();
        assert!(off <= 1e-11, "{motion:?}: {off:e}");
        for load in &plan.controls {
            let idle = if motion == Motion::Translation {
                load.moment
            } else {
                load.force
            };
            assert_eq!(idle.norm(), 0.0);
        }
    }
}
