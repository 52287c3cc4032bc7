//! The implicit equation in Cayley form (2.6): `G_c(f) = g + g × f + (gᵀf) f − 2 J f = 0`, relative to `tr J`.

use lgvi_lie::hat;
use nalgebra::{Matrix3, Vector3};

use super::{MAX_ITERATIONS, RelativeRotation, solve_3x3};
use crate::Inertia;

/// Residual, relative to the terms it is the sum of, that is rounding.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// The same where corrections have come down to rounding and go on about it: for thin bodies they do.
const STAGNANT: f64 = 4.0 * ROUNDING;

/// Newton's method from `f` for `g / tr J`; `None` when it does not converge.
pub(super) fn newton(
    inertia: &Inertia,
    g: &Vector3<f64>,
    mut f: Vector3<f64>,
) -> Option<RelativeRotation> {
    let magnitude = g.norm();
    let two_j = 2.0 * inertia.unit;
    for iterations in 0..=MAX_ITERATIONS {
        let s = g.dot(&f);
        let two_j_f = two_j * f;
        let residual = g + g.cross(&f) + s * f - two_j_f;
        let terms = magnitude * (1.0 + f.norm_squared()) + two_j_f.norm();
        let rounding = match iterations {
            MAX_ITERATIONS => STAGNANT,
            _ => ROUNDING,
        };
        if residual.norm() <= rounding * terms {
            return Some(RelativeRotation {
                cayley: f,
                iterations,
            });
        }
        let jacobian = hat(g) + Matrix3::from_diagonal_element(s) + f * g.transpose() - two_j;
        f -= solve_3x3(&jacobian, &residual)?;
    }
    None
}
