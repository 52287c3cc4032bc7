//! The exact sensitivity of the end of an extremal compared with finite differences.

use lgvi_control::shooting::{integrate, integrate_with_sensitivity};
use lgvi_dynamics::BodyState;
use lgvi_lie::log;
use nalgebra::{SMatrix, SVector};

use crate::case::Case;

/// `[x, γ, log(R_refᵀ R), Π]` at the end of the extremal from `lambda`.
fn end(
    case: &Case,
    n: usize,
    lambda: &SVector<f64, 12>,
    reference: &BodyState,
) -> SVector<f64, 12> {
    let extremal = integrate(&case.transfer(n), lambda).expect("an extremal");
    let end = extremal.end();
    let attitude = log(&reference.attitude.tr_mul(&end.attitude));
    let parts = [
        end.position,
        end.linear_momentum,
        attitude,
        end.angular_momentum,
    ];
    SVector::from_iterator(parts.iter().flatten().copied())
}

#[test]
fn sensitivity_is_the_derivative_of_the_end() {
    for (set, n) in [("C_i", 50), ("C_ii", 50), ("B_i", 100)] {
        let case = Case::load(set);
        let reference = case.references().remove(0);
        // Also away from the solution, so that no term vanishes by optimality.
        for scale in [1.0, 0.6] {
            let lambda = reference.lambda0 * scale;
            let (extremal, exact) =
                integrate_with_sensitivity(&case.transfer(n), &lambda).expect("an extremal");
            let scales = exact
                .column_iter()
                .map(|column| column.norm())
                .collect::<Vec<_>>();
            let mut differences = SMatrix::<f64, 12, 12>::zeros();
            for (axis, scale) in scales.iter().enumerate() {
                let at = |steps: f64| {
                    let shift = SVector::ith(axis, steps * 2e-3 / scale);
                    end(&case, n, &(lambda + shift), extremal.end())
                };
                // Central differences of sixth order.
                let column =
                    45.0 * (at(1.0) - at(-1.0)) - 9.0 * (at(2.0) - at(-2.0)) + (at(3.0) - at(-3.0));
                differences.set_column(axis, &(column * (scale / (60.0 * 2e-3))));
            }
            for (axis, scale) in scales.iter().enumerate() {
                let error = (exact.column(axis) - differences.column(axis)).norm() / scale;
                assert!(error < 1e-9, "{set}: column {axis} differs by {error:e}");
            }
        }
    }
}
