//! The accuracy of every reference trajectory at all its times: rounding errors, amplified by the divergence of the
//! trajectory itself.

use crate::case::Case;
use lgvi_dynamics::{Load, Method};

/// Case, step size, and the bounds of the errors of position and attitude (Frobenius) over all times. The measured
/// errors are between a tenth and a half of them. In b2 the motion about the middle axis is unstable, and c1 is
/// chaotic.
const FLOORS: [(&str, f64, f64, f64); 10] = [
    ("a1_two_dumbbells_regular", 0.02, 1e-10, 3e-10),
    ("a2_two_dumbbells_coupled", 0.02, 1e-11, 5e-11),
    ("b1_free_asymmetric", 0.5, 0.0, 1e-10),
    ("b2_dzhanibekov", 0.5, 0.0, 1e-8),
    ("c1_3d_pendulum", 0.00625, 0.0, 5e-8),
    ("c3_3d_pendulum_regular_small", 0.025, 0.0, 1e-11),
    ("d_dumbbell_central", 0.025, 5e-11, 3e-10),
    ("e_kw4_like", 900.0, 1e-7, 3e-10),
    ("f_outer_planets", 50.0, 2e-10, 0.0),
    ("g_kepler", 0.015625, 1e-11, 0.0),
];

#[test]
fn every_reference_is_met_down_to_the_stated_floor() {
    let method = Method::Nystrom { order: 8 };
    for (name, h, position, attitude) in FLOORS {
        let case = Case::load(name);
        let mut simulation = case.simulation(method, h);
        let controls = vec![Load::default(); simulation.states().len()];
        for t in case.times() {
            let steps = (t / h).round() as u64;
            while simulation.step() < steps {
                simulation.advance(&controls).expect("a step");
            }
            let errors = case.compare(t, &simulation);
            println!(
                "{name}, t = {t}: {:.0e}, {:.0e}",
                errors.position, errors.attitude
            );
            assert!(errors.position <= position, "{name}, t = {t}: {errors:?}");
            assert!(errors.attitude <= attitude, "{name}, t = {t}: {errors:?}");
        }
    }
}
