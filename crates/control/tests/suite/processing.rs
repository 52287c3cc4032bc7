//! Plans flown by accurate integrators with each control constant over its step, and their misses.

use lgvi_control::processing::{ProcessingError, flown, processed};
use lgvi_control::{Dynamics, NewtonSettings, Place, Plan, Start, Transfer, miss, shooting, solve};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{BodyState, Load, Method, Simulation, System};
use lgvi_lie::exp;
use nalgebra::{SMatrix, SVector};

use crate::case::Case;

const EXACT: Method = Method::DormandPrince853 { tolerance: 1e-13 };
const LGVI: Method = Method::Lgvi(Rotor::Discrete);

/// Norm of the miss when `controls` are flown from the true initial state.
fn miss_of(case: &Case, n: usize, controls: &[Load], method: Method) -> f64 {
    let transfer = case.transfer(n);
    let gravity = Central { gm: 1.0 };
    let system = System::new(vec![case.body()], vec![Box::new(gravity)]);
    let mut flight = Simulation::new(system, vec![*transfer.initial()], method, transfer.h())
        .expect("a simulation");
    for control in controls {
        flight.advance(&[*control]).expect("a step");
    }
    miss(&target(&transfer), &flight.states()[0]).norm()
}

fn target(transfer: &Transfer) -> BodyState {
    transfer.target().state().expect("a state")
}

fn plan(transfer: &Transfer, start: Start<'_>) -> Plan {
    solve(transfer, start, &NewtonSettings::default(), |_| true).expect("a plan")
}

/// Halving the step size halves the miss of plain Lie–Euler plans and quarters that of processed plans and of LGVI
/// plans. The error of the cost of processed plans falls by a factor of four.
#[test]
fn processed_plans_and_those_of_the_lgvi_miss_by_the_square_of_the_step() {
    for set in ["C_i", "C_ii"] {
        let case = Case::load(set);
        let mut lambda = [SVector::zeros(); 2];
        let mut rows: Vec<[f64; 5]> = Vec::new();
        println!(
            "{set}    N   Lie–Euler   processed, and flown by LGVI     of LGVI, and processed cost"
        );
        for n in [50, 100, 200, 400, 800] {
            let mut shoot = |which: usize, transfer: &Transfer| {
                let start = lambda[which];
                let found =
                    shooting::solve(transfer, start, &shooting::Settings::default(), |_| true);
                let found = found.expect("a solution");
                lambda[which] = found.multipliers;
                found.extremal
            };
            let plain = shoot(0, &case.transfer(n));
            let half = shoot(1, &processed(case.transfer(n)).expect("processed"));
            let euler = plan(&case.transfer(n), Start::Cold);
            let second = case.transfer(n).with_dynamics(Dynamics::Lgvi);
            let second = plan(&second, Start::Warm(&euler));
            assert!(miss_of(&case, n, &second.controls, LGVI) < 1e-11);
            let row = [
                miss_of(&case, n, &plain.controls, EXACT),
                miss_of(&case, n, &half.controls, EXACT),
                miss_of(&case, n, &half.controls, LGVI),
                miss_of(&case, n, &second.controls, EXACT),
                half.cost,
            ];
            println!(
                "{set} {n:4}   {:.3e}   {:.3e}   {:.3e}   {:.3e}   {:.8}",
                row[0], row[1], row[2], row[3], row[4]
            );
            rows.push(row);
        }
        for pair in rows[1..].windows(2) {
            for (column, factor) in [(0, 2.0), (1, 4.0), (2, 4.0), (3, 4.0)] {
                let ratio = pair[0][column] / pair[1][column];
                assert!(
                    (ratio / factor - 1.0).abs() < 0.05,
                    "{set}, column {column}: falls {ratio} times"
                );
            }
        }
        for three in rows[1..].windows(3) {
            let [first, second, third] = [0, 1, 2].map(|row| three[row][4]);
            let ratio = (first - second) / (second - third);
            println!("{set} ratio {ratio}");
            assert!((ratio - 4.0).abs() < 0.2, "{set}: costs' ratio {ratio}");
        }
    }
}

/// The state at `z` from `state`.
fn moved(state: &BodyState, z: &SVector<f64, 12>) -> BodyState {
    let part = |row: usize| z.fixed_rows::<3>(row).into_owned();
    BodyState {
        position: state.position + part(0),
        linear_momentum: state.linear_momentum + part(3),
        attitude: state.attitude * exp(&part(6)),
        angular_momentum: state.angular_momentum + part(9),
    }
}

/// The converted plan leads from the initial state to the target. Corrections and products with the costate are the
/// same for a deviation as for the deviation half a drift later.
#[test]
fn plans_as_flown_pair_with_states_as_flown() {
    let case = Case::load("C_i");
    let transfer = case.transfer(50);
    let mut early = plan(
        &processed(case.transfer(50)).expect("processed"),
        Start::Cold,
    );
    let mut rng = fastrand::Rng::with_seed(41);
    let mut random = || 2.0 * rng.f64() - 1.0;
    for gain in &mut early.feedback {
        *gain = SMatrix::from_fn(|_, _| random());
    }
    let late = flown(&case.body(), early.clone()).expect("flown");
    let ends = [0, 50].map(|k| late.states[k]);
    assert!(miss(transfer.initial(), &ends[0]).norm() < 1e-14);
    assert!(miss(&target(&transfer), &ends[1]).norm() < 1e-11);
    assert_eq!((&early.controls, early.cost), (&late.controls, late.cost));

    let z = SVector::<f64, 12>::from_fn(|_, _| random());
    let shifted = |epsilon: f64| {
        let mut plan = early.clone();
        for state in &mut plan.states {
            *state = moved(state, &(epsilon * z));
        }
        flown(&case.body(), plan).expect("flown").states
    };
    let epsilon = 1e-3;
    let [ahead, behind] = [shifted(epsilon), shifted(-epsilon)];
    for k in 0..50 {
        let here = |k: usize| {
            let forth = miss(&late.states[k], &ahead[k]);
            let back = miss(&late.states[k], &behind[k]);
            (forth - back) / (2.0 * epsilon)
        };
        let correction = late.feedback[k] * here(k) - early.feedback[k] * z;
        assert!(correction.amax() < 1e-5, "step {k}: {correction}");
        let [product, expected] = [
            late.multipliers[k].dot(&here(k + 1)),
            early.multipliers[k].dot(&z),
        ];
        let scale = early.multipliers[k].norm();
        assert!(
            (product - expected).abs() < 1e-5 * scale,
            "step {k}: {product} for {expected}"
        );
    }
}

#[test]
fn what_cannot_be_processed_is_refused() {
    let case = Case::load("C_i");
    let second = case.transfer(50).with_dynamics(Dynamics::Lgvi);
    assert_eq!(processed(second).err(), Some(ProcessingError::Dynamics));
    let transfer = case.transfer(50);
    let everywhere = transfer.target().clone().without(Place::Position);
    let identity = nalgebra::Matrix3::identity();
    let actuation = lgvi_control::Actuation::full(&identity, &identity).expect("weights");
    let (field, initial) = (Central { gm: 1.0 }, *transfer.initial());
    let anywhere = Transfer::new(case.body(), field, 0.1, 50, initial, everywhere, actuation);
    let anywhere = processed(anywhere.expect("a transfer"));
    assert_eq!(anywhere.err(), Some(ProcessingError::Terminal));
    let turning = BodyState {
        angular_momentum: nalgebra::Vector3::new(0.0, 40.0, 0.0),
        ..initial
    };
    let actuation = lgvi_control::Actuation::full(&identity, &identity).expect("weights");
    let field = Central { gm: 1.0 };
    let fast = Transfer::new(case.body(), field, 0.1, 50, turning, turning, actuation);
    assert!(matches!(
        processed(fast.expect("a transfer")).err(),
        Some(ProcessingError::Unsolvable { which: "the initial state", source }) if source.turn > 1.0
    ));
}
