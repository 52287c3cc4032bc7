use lgvi_dynamics::gravity::Sources;
use lgvi_dynamics::{BodyState, Inertia, RigidBody};
use nalgebra::{Matrix3, Vector3};

use super::bodies::{Bodies, Round};
use crate::problem::PositionCost;
use crate::{Actuation, Dynamics, Motion, NewtonSettings, Plan, Start, Terminal, Transfer, solve};

const INTERVALS: usize = 30;

fn transfer(mass: f64, ends: [Vector3<f64>; 2]) -> Transfer {
    let [from, to] = ends.map(|position| BodyState {
        position,
        linear_momentum: Vector3::zeros(),
        attitude: Matrix3::identity(),
        angular_momentum: Vector3::zeros(),
    });
    let inertia = Inertia::principal([mass; 3]).unwrap();
    let unit = Matrix3::identity();
    Transfer::new(
        RigidBody::new(mass, inertia, Vec::new()).unwrap(),
        Sources::new(Vec::new()),
        0.1,
        INTERVALS,
        from,
        Terminal::try_from(to).unwrap(),
        Actuation::full(&unit, &unit).unwrap(),
    )
    .unwrap()
    .with_dynamics(Dynamics::Lgvi)
    .with_motion(Motion::Translation)
    .with_constraints_at_ends(&[])
}

fn plan(transfer: &Transfer, start: Start<'_>) -> Plan {
    solve(transfer, start, &NewtonSettings::default(), |_| true).unwrap()
}

/// The least of `J + Σ f · (x − r)` changes with `f` by `x − r`.
#[test]
fn a_known_cost_of_positions_is_paid() {
    let ends = [-1.0, 1.0].map(|x| Vector3::new(x, 0.2, 0.0));
    let free = transfer(2.0, ends);
    let reference = Vector3::new(0.3, -0.1, 0.2);
    let priced = |change: f64| {
        let mut transfer = free.clone();
        let costs = (0..INTERVALS).map(|end| PositionCost {
            price: Vector3::new(
                0.0,
                if end == 12 { 0.7 + change } else { 0.2 },
                0.1 * end as f64,
            ),
            reference,
        });
        transfer.inequalities.position_costs = costs.collect();
        plan(&transfer, Start::Cold)
    };
    let middle = priced(0.0);
    assert!(middle.certificate.sufficient && middle.certificate.stationarity < 1e-8);
    let step = 1e-3;
    let slope = (priced(step).total_cost() - priced(-step).total_cost()) / (2.0 * step);
    let expected = middle.states[13].position.y - reference.y;
    assert!(
        (slope - expected).abs() < 1e-8,
        "{slope} instead of {expected}"
    );
    let moved = (middle.states[13].position - plan(&free, Start::Cold).states[13].position).norm();
    assert!(moved > 0.1, "{moved}");
}

/// At the joint minimum the sum of the costs does not change to first order when the bodies move otherwise, though the cost of
/// each does.
#[test]
fn the_sum_of_the_costs_is_stationary_by_a_shared_path() {
    let way = |x: f64, y: f64| [x, -x].map(|x| Vector3::new(x, y, 0.0));
    let transfers = [transfer(1.0, way(-1.0, 0.1)), transfer(1.7, way(1.0, 0.0))];
    let mut bodies = Bodies {
        transfers: &transfers,
        separation: 0.5,
        order: vec![1, 0],
        solve: Box::new(|transfer, start| {
            solve(transfer, start, &NewtonSettings::default(), |_| true)
        }),
        plans: Vec::new(),
        paths: Vec::new(),
        near: Vec::new(),
        keeps_sides: false,
    };
    bodies.free().unwrap();
    let found = bodies.settle().unwrap();
    assert!(found.agreement.price <= 1e-6);
    let mut settled = Round {
        plans: bodies.plans.clone(),
        paths: bodies.paths.clone(),
        prices: vec![0.0; 3 * INTERVALS * 2],
    };
    let near = bodies.near.clone();
    bodies.charge(0, &near, &mut settled);
    let costs = |bodies: &mut Bodies<'_>, change: f64| {
        let mut prices = settled.prices.clone();
        for (at, price) in prices.iter_mut().enumerate() {
            if *price != 0.0 {
                *price *= 1.0 + change * (0.3 + (at as f64).sin());
            }
        }
        let round = bodies.round(&prices).unwrap();
        [1, 0].map(|body| round.plans[body].cost)
    };
    let step = 1e-2;
    let [more, less] = [step, -step].map(|change| costs(&mut bodies, change));
    let [payer, owner] = [0, 1].map(|which| (more[which] - less[which]) / (2.0 * step));
    assert!(payer.abs() > 1e-2, "{payer:e}");
    assert!(
        (payer + owner).abs() < 1e-3 * payer.abs(),
        "{payer:e} {owner:e}"
    );
    let middle = costs(&mut bodies, 0.0);
    let sum = |costs: [f64; 2]| costs[0] + costs[1];
    assert!(sum(more) > sum(middle) && sum(less) > sum(middle));
}
