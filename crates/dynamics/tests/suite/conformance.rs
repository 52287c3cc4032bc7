//! What every integrator must do, on every case that it can fly: its order, momenta, reversibility, rotations that stay
//! rotations, controls, and states left alone by a step that fails.

use crate::case::Case;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::rotation::Chart;
use lgvi_dynamics::{BodyState, Load, Method, Simulation};

/// A method and what it promises.
struct Promise {
    method: Method,
    order: u32,
    /// Exact linear and angular momentum, bounded energy error, rotations without projection.
    geometric: bool,
    /// Reversed momenta lead back to the start.
    reversible: bool,
}

fn promises() -> Vec<Promise> {
    let cayley = Rotor::Discrete(Chart::Cayley);
    let exponential = Rotor::Discrete(Chart::Exponential);
    let geometric = |method, order| Promise {
        method,
        order,
        geometric: true,
        reversible: true,
    };
    let mut all = vec![
        geometric(Method::Lgvi(cayley), 2),
        geometric(Method::Lgvi(exponential), 2),
        geometric(Method::LagrangianLgvi(Chart::Cayley), 2),
        geometric(Method::ProcessedLieEuler(cayley), 2),
        Promise {
            reversible: false,
            ..geometric(Method::LieEuler(cayley), 1)
        },
    ];
    for order in [4, 6, 8, 10] {
        all.push(geometric(
            Method::Composition {
                order,
                rotor: cayley,
            },
            order,
        ));
    }
    all
}

/// Cases, a time before chaos, the fewest steps to it.
const CASES: [(&str, f64, u32); 4] = [
    ("a1_two_dumbbells_regular", 2.0, 6),
    ("b1_free_asymmetric", 10.0, 5),
    ("b2_dzhanibekov", 10.0, 5),
    ("d_dumbbell_central", 5.0, 3),
];

/// Errors near or below this are rounding, grown with the divergence of the case.
const FLOOR: f64 = 1e-11;

/// Largest deviation from the reference, `None` when a step cannot be made.
fn error(case: &Case, t: f64, method: Method, steps: u32) -> Option<f64> {
    let mut simulation = case.simulation(method, t / f64::from(steps));
    let controls = vec![Load::default(); simulation.states().len()];
    for _ in 0..steps {
        simulation.advance(&controls).ok()?;
    }
    let errors = case.compare(t, &simulation);
    let all = [
        errors.position,
        errors.velocity,
        errors.attitude,
        errors.angular_velocity,
    ];
    Some(all.into_iter().fold(0.0, f64::max))
}

/// Errors over steps shorter by √2 each, from the first below a tenth to the last above rounding.
fn convergence(case: &Case, t: f64, method: Method, fewest: u32) -> Vec<f64> {
    let mut errors = Vec::new();
    for halves in 0..30 {
        let steps = (f64::from(fewest) * 2.0_f64.powf(0.5 * f64::from(halves))).round();
        match error(case, t, method, steps as u32) {
            Some(error) if error < FLOOR => break,
            Some(error) if error < 0.1 => errors.push(error),
            _ => {}
        }
        if errors.len() == 10 {
            break;
        }
    }
    errors
}

#[test]
fn errors_fall_with_the_order() {
    for (name, t, fewest) in CASES {
        let case = Case::load(name);
        for Promise { method, order, .. } in promises() {
            // On a free body the drift is all there is, and a kick-drift method is its rotor.
            let free = name.starts_with('b');
            let order = if free && order == 1 { 2 } else { order };
            let errors = convergence(&case, t, method, fewest);
            let slopes: Vec<_> = errors
                .windows(3)
                .map(|pair| (pair[0] / pair[2]).log2())
                .collect();
            println!("{name}, {method}: {slopes:.2?}");
            // Three halvings; order 10 takes three decades a halving, two are what there is above rounding.
            let least = if order < 10 { 5 } else { 2 };
            assert!(slopes.len() >= least, "{name}, {method}: {errors:?}");
            let last = &slopes[slopes.len() - least..];
            let mean = last.iter().sum::<f64>() / least as f64;
            let expected = f64::from(order);
            // Coarse steps may converge faster than the order, none slower; the finest show the order itself.
            let tolerance = 0.08 * expected;
            let finest = last[least - 1];
            let of_order = mean > expected - tolerance && (finest - expected).abs() < tolerance;
            assert!(of_order, "{name}, {method}: {slopes:.2?}");
        }
    }
}

fn reversed(states: &[BodyState]) -> Vec<BodyState> {
    let reverse = |state: &BodyState| BodyState {
        linear_momentum: -state.linear_momentum,
        angular_momentum: -state.angular_momentum,
        ..*state
    };
    states.iter().map(reverse).collect()
}

/// Greatest difference between states, in poses and momenta.
fn distance(one: &[BodyState], other: &[BodyState]) -> f64 {
    let each = |(a, b): (&BodyState, &BodyState)| {
        (a.position - b.position)
            .norm()
            .max((a.attitude - b.attitude).norm())
            .max((a.linear_momentum - b.linear_momentum).norm())
            .max((a.angular_momentum - b.angular_momentum).norm())
    };
    one.iter().zip(other).map(each).fold(0.0, f64::max)
}

fn fly(mut simulation: Simulation, steps: u32) -> Simulation {
    let controls = vec![Load::default(); simulation.states().len()];
    for _ in 0..steps {
        simulation.advance(&controls).expect("a step");
    }
    simulation
}

#[test]
fn reversed_momenta_lead_back_where_promised() {
    for (name, t, fewest) in CASES {
        let case = Case::load(name);
        for Promise {
            method, reversible, ..
        } in promises()
        {
            let steps = 100 * fewest;
            let h = t / f64::from(steps);
            let there = fly(case.simulation(method, h), steps);
            let start = case.simulation(method, h).states().to_vec();
            let back = fly(
                case.simulation_from(reversed(there.states()), method, h),
                steps,
            );
            let missed = distance(&reversed(back.states()), &start);
            let free = name.starts_with('b');
            if reversible || free {
                assert!(missed < 1e-11, "{name}, {method}: {missed:e}");
            } else {
                assert!(missed > 1e-6, "{name}, {method}: {missed:e}");
            }
        }
    }
}

#[test]
fn geometric_methods_keep_momenta_rotations_and_energy() {
    for (name, t, fewest) in CASES {
        let case = Case::load(name);
        for Promise {
            method,
            order,
            geometric,
            ..
        } in promises()
        {
            let steps = 100 * fewest;
            let mut simulation = case.simulation(method, t / f64::from(steps));
            let start = simulation.invariants();
            let controls = vec![Load::default(); simulation.states().len()];
            let (mut energy, mut orthogonality, mut momentum) = (0.0_f64, 0.0_f64, 0.0_f64);
            for _ in 0..10 * steps {
                simulation.advance(&controls).expect("a step");
                let now = simulation.invariants();
                energy = energy.max((now.energy - start.energy).abs());
                orthogonality = orthogonality.max(now.orthogonality_error);
                let angular = (now.angular_momentum - start.angular_momentum).norm();
                momentum = momentum.max(angular);
                if !name.starts_with('d') {
                    let linear = (now.linear_momentum - start.linear_momentum).norm();
                    momentum = momentum.max(linear);
                }
            }
            println!(
                "{name}, {method}: energy {energy:.1e}, RᵀR {orthogonality:.1e}, momenta {momentum:.1e}"
            );
            if geometric {
                assert!(orthogonality < 3e-15, "{name}, {method}: {orthogonality:e}");
                assert!(momentum < 2e-12, "{name}, {method}: {momentum:e}");
                let bound = if order == 1 { 0.1 } else { 0.02 };
                assert!(energy < bound, "{name}, {method}: {energy:e}");
            }
        }
    }
}
