use nalgebra::SVector;

use super::{Settings, shoot};

#[allow(dead_code, reason = "a case has more than this test needs")]
#[path = "../../tests/suite/case.rs"]
mod case;

use case::Case;

/// An independent implementation of the same method follows the same path as long as both line searches accept the same
/// steps, which depends on the `α` of Armijo's rule.
#[test]
fn damped_iterations_follow_the_independent_prototype() {
    for (set, same) in [("C_i", 11), ("Q_i", 11), ("B_i", 11), ("B_ii", 11)] {
        let case = Case::load(set);
        let mut history = Vec::new();
        shoot(
            &case.transfer(200),
            SVector::zeros(),
            &Settings::default(),
            |now| {
                history.push(now.violation);
                true
            },
        )
        .expect("a solution");
        for (found, expected) in history.iter().zip(&case.prototype_history()).take(same) {
            assert!(
                (found / expected - 1.0).abs() < 1e-9,
                "{set}: {found:e} for {expected:e}"
            );
        }
    }
}
