//! The closed form of free rotation compared with the reference trajectories of free bodies.

use crate::case::Case;
use lgvi_dynamics::{Load, Method};

/// The error is at most the rounding of the phase, `2⁻⁵² |Ω| t` with |Ω| = 1.35 and 1, at all times. Measured errors of
/// the attitude and of Ω:
///
/// | | t = 1 | 10 | 30 | 100 | 1000 |
/// | --- | --- | --- | --- | --- | --- |
/// | b1 | 4.1e-16, 4.2e-16 | 8.1e-16, 3.1e-16 | 3.3e-15, 8.9e-16 | 1.5e-14, 3.0e-15 | 9.2e-14, 2.0e-14 |
/// | b2 | 2.2e-16, 1.4e-19 | 2.3e-16, 1.5e-16 | 3.7e-15, 2.2e-16 | 1.2e-14, 7.0e-15 | 4.7e-14, 1.5e-15 |
#[test]
fn free_rotation_is_exact_at_every_time_of_the_references() {
    for name in ["b1_free_asymmetric", "b2_dzhanibekov"] {
        let case = Case::load(name);
        for t in case.times() {
            let errors = case.errors_at(t, 1, Method::ClosedForm);
            let (attitude, velocity) = (errors.attitude, errors.angular_velocity);
            let bound = 2e-15 + f64::EPSILON * 1.4 * t;
            assert!(attitude < bound, "{name} t = {t}: attitude {attitude:.1e}");
            assert!(velocity < bound, "{name} t = {t}: Ω {velocity:.1e}");
        }
    }
}

/// The end state does not depend on the number of steps: many steps give the same result as one.
#[test]
fn steps_in_closed_form_do_not_accumulate() {
    let case = Case::load("b1_free_asymmetric");
    let steps = 1000;
    let mut flight = case.simulation(Method::ClosedForm, 1.0);
    for _ in 0..steps {
        flight.advance(&[Load::default()]).expect("a step");
    }
    let mut leap = case.simulation(Method::ClosedForm, f64::from(steps));
    leap.advance(&[Load::default()]).expect("a step");
    assert_eq!(flight.states(), leap.states());
}
