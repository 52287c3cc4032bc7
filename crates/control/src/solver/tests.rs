use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use lgvi_lie::exp;
use nalgebra::{Matrix3, Vector3};

use super::attempt::Solver;
use super::class::Both;
use super::progress::NewtonSettings;
use crate::newton::{Iterate, Newton, Unconstrained};
use crate::{Actuation, Plan, Progress, Transfer, miss};

/// A rest-to-rest turn by 0.5 rad about z in a negligible field.
fn turn() -> Transfer {
    let inertia = Inertia::principal([0.2, 0.3, 0.4]).unwrap();
    let body = RigidBody::new(1.0, inertia, vec![]).unwrap();
    let rest = |angle: f64| BodyState {
        position: Vector3::new(1.0, 0.0, 0.0),
        linear_momentum: Vector3::zeros(),
        attitude: exp(&Vector3::new(0.0, 0.0, angle)),
        angular_momentum: Vector3::zeros(),
    };
    let identity = Matrix3::identity();
    let actuation = Actuation::full(&identity, &identity).unwrap();
    let field = Central { gm: 1e-12 };
    Transfer::new(body, field, 0.02, 100, rest(0.0), rest(0.5), actuation).unwrap()
}

/// The stationary point with the given number of additional turns about z, and the plan that the solver continues to.
fn plans(transfer: &Transfer, turns: f64) -> [Plan; 2] {
    let mut observe = |_: &Progress| true;
    let mut solver = Solver::new(Both, transfer, &NewtonSettings::default(), &mut observe);
    let coarse: Newton<12, 6> = solver.smooth(turns).unwrap().ok().unwrap();
    let newton = solver.refine(coarse).unwrap().ok().unwrap();
    let again = Newton::new(transfer.intervals, newton.iterate.clone());
    let stationary = solver.finish(newton, &mut Unconstrained).unwrap();
    [stationary, solver.certified(again).unwrap()]
}

/// A plan with two more turns is stationary by symmetry, but a tilt reduces its cost.
#[test]
fn a_saddle_is_stationary_not_sufficient_and_left_for_a_minimum() {
    let transfer = turn();
    let [[direct, same], [wound, lower]] = [0.0, 2.0].map(|turns| plans(&transfer, turns));
    for plan in [&direct, &same, &wound, &lower] {
        let found = &plan.certificate;
        assert!(found.stationarity <= 1e-8, "{found:?}");
        assert!(found.terminal <= 1e-12, "{found:?}");
    }
    assert!(direct.certificate.sufficient && !wound.certificate.sufficient);
    assert!(wound.cost > 100.0 * direct.cost);
    assert!((same.cost / direct.cost - 1.0).abs() < 1e-9);
    assert!(lower.certificate.sufficient && lower.cost < 0.9 * wound.cost);
}

/// One command is altered: the certificate must show the terminal miss and the stationarity error.
#[test]
fn a_certificate_sees_an_altered_command() {
    let transfer = turn();
    let [plan, _] = plans(&transfer, 0.0);
    let mut iterate = Iterate {
        states: plan.states.clone(),
        commands: plan.commands.clone(),
        nu: *plan.multipliers.last().unwrap(),
    };
    iterate.commands[40][5] *= 1.01;
    let mut observe = |_: &Progress| true;
    let mut solver = Solver::new(Both, &transfer, &NewtonSettings::default(), &mut observe);
    let newton = Newton::new(transfer.intervals, iterate);
    let altered = solver.finish(newton, &mut Unconstrained).unwrap();
    let found = &altered.certificate;
    let target = transfer.target().state().unwrap();
    let end = miss(&target, altered.states.last().unwrap()).norm();
    assert!(end > 1e-6 && (found.terminal - end).abs() < 1e-15);
    let share = transfer.h() * 0.01 * plan.commands[40][5].abs();
    let largest = plan.commands.iter().map(|w| w.amax()).fold(0.0, f64::max);
    assert!(found.stationarity > 0.5 * share / (transfer.h() * largest));
    assert!(found.stationarity > 1e3 * plan.certificate.stationarity);
}
