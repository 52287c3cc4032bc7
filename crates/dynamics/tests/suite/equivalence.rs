//! Methods that are the same map in different coordinates.

use crate::case::Case;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{BodyState, Load, Method, System};
use nalgebra::Vector3;

/// The largest difference between the states of two methods on the same arc under the same changing controls.
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
        greatest = greatest.max(distance(flights[0].states(), flights[1].states()));
    }
    greatest
}

fn distance(one: &[BodyState], other: &[BodyState]) -> f64 {
    let each = |(a, b): (&BodyState, &BodyState)| {
        ((a.position - b.position).norm())
            .max((a.linear_momentum - b.linear_momentum).norm())
            .max((a.attitude - b.attitude).norm())
            .max((a.angular_momentum - b.angular_momentum).norm())
    };
    one.iter().zip(other).map(each).fold(0.0, f64::max)
}

const ARCS: [(&str, f64, u32); 4] = [
    ("a1_two_dumbbells_regular", 0.002, 5_000),
    ("b1_free_asymmetric", 0.01, 1_000),
    ("b2_dzhanibekov", 0.01, 1_000),
    ("d_dumbbell_central", 0.01, 1_000),
];

/// Rounding errors, amplified by the divergence of the arcs.
const ROUNDING: f64 = 5e-11;

/// Half a kick of gravity over `h` converts the momenta of the LGVI to those of the Lie–Euler method (§4.5).
fn process(system: &mut System, states: &mut [BodyState], h: f64) {
    let mut loads = vec![Load::default(); states.len()];
    system.loads(states, &mut loads);
    for (state, load) in states.iter_mut().zip(loads) {
        state.linear_momentum += 0.5 * h * load.force;
        state.angular_momentum += 0.5 * h * load.moment;
    }
}

#[test]
fn processed_lie_euler_is_the_lgvi() {
    for (case, h, steps) in ARCS {
        let reference = Case::load(case);
        let (mut system, mut states) = reference.system();
        let controls = vec![Load::default(); states.len()];
        let fly = |states: &[BodyState], method| {
            let mut simulation = reference.simulation_from(states.to_vec(), method, h);
            for _ in 0..steps {
                simulation.advance(&controls).expect("a step");
            }
            simulation.states().to_vec()
        };
        let mut expected = fly(&states, Method::Lgvi(Rotor::Discrete));
        let plain = distance(&fly(&states, Method::LieEuler(Rotor::Discrete)), &expected);
        process(&mut system, &mut states, h);
        process(&mut system, &mut expected, h);
        let found = distance(&fly(&states, Method::LieEuler(Rotor::Discrete)), &expected);
        println!("{case}: {found:.1e}");
        assert!(found < ROUNDING, "{case}: {found:e}");
        let free = case.starts_with('b');
        assert!(free || plain > 1e3 * ROUNDING, "{case}: {plain:e}");
    }
}

#[test]
fn the_lagrangian_form_is_the_hamiltonian_form() {
    for (case, h, steps) in ARCS {
        let methods = [Method::LagrangianLgvi, Method::Lgvi(Rotor::Discrete)];
        let found = difference(case, h, steps, methods);
        println!("{case}: {found:.1e}");
        assert!(found < ROUNDING, "{case}: {found:e}");
    }
}
