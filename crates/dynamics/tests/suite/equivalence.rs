//! Methods that are the same map in other coordinates.

use crate::case::Case;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::rotation::Chart;
use lgvi_dynamics::{Load, Method};
use nalgebra::Vector3;

/// Flies both methods over the same arc under the same changing controls; the greatest difference of any state on the way.
fn difference(case: &str, h: f64, steps: u32, methods: [Method; 2]) -> f64 {
    let case = Case::load(case);
    let mut flights = methods.map(|method| case.simulation(method, h));
    let bodies = flights[0].states().len();
    let mut greatest = 0.0_f64;
    for step in 0..steps {
        let phase = f64::from(step / 10);
        let control = Load {
            force: 1e-3 * Vector3::new(libm::sin(phase), 0.5, libm::cos(phase)),
            moment: 1e-4 * Vector3::new(0.3, libm::cos(phase), libm::sin(phase)),
        };
        for flight in &mut flights {
            flight.advance(&vec![control; bodies]).expect("a step");
        }
        for (a, b) in flights[0].states().iter().zip(flights[1].states()) {
            greatest = greatest
                .max((a.position - b.position).norm())
                .max((a.linear_momentum - b.linear_momentum).norm())
                .max((a.attitude - b.attitude).norm())
                .max((a.angular_momentum - b.angular_momentum).norm());
        }
    }
    greatest
}

const ARCS: [(&str, f64, u32); 4] = [
    ("a1_two_dumbbells_regular", 0.002, 5_000),
    ("b1_free_asymmetric", 0.01, 1_000),
    ("b2_dzhanibekov", 0.01, 1_000),
    ("d_dumbbell_central", 0.01, 1_000),
];

const CHARTS: [Chart; 2] = [Chart::Cayley, Chart::Exponential];

/// Rounding, times what the arcs' own divergence makes of it.
const ROUNDING: f64 = 5e-11;

#[test]
fn processed_lie_euler_is_the_lgvi() {
    for (case, h, steps) in ARCS {
        for rotor in CHARTS.map(Rotor::Discrete) {
            let methods = [Method::ProcessedLieEuler(rotor), Method::Lgvi(rotor)];
            let found = difference(case, h, steps, methods);
            println!("{case}: {found:.1e}");
            assert!(found < ROUNDING, "{case}: {found:e}");
            let plain = difference(case, h, steps, [Method::LieEuler(rotor), methods[1]]);
            assert!(plain > 1e3 * ROUNDING, "{case}: {plain:e}");
        }
    }
}

#[test]
fn the_lagrangian_form_is_the_hamiltonian_form() {
    for (case, h, steps) in ARCS {
        for chart in CHARTS {
            let methods = [
                Method::LagrangianLgvi(chart),
                Method::Lgvi(Rotor::Discrete(chart)),
            ];
            let found = difference(case, h, steps, methods);
            println!("{case}: {found:.1e}");
            assert!(found < ROUNDING, "{case}: {found:e}");
        }
    }
}
