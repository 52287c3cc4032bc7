use nalgebra::{Matrix3, Vector3};
use thiserror::Error;

use crate::rotation::{DiscreteRotation, PrincipalAxes};

/// Inertia of a rigid body about its center of mass, in body axes, with derived quantities for the integrators.
#[derive(Clone, Debug, PartialEq)]
pub struct Inertia {
    pub(crate) matrix: Matrix3<f64>,
    pub(crate) inverse: Matrix3<f64>,
    pub(crate) nonstandard: Matrix3<f64>,
    pub(crate) principal: PrincipalAxes,
    pub(crate) rotation: DiscreteRotation<f64>,
}

/// Reasons why a matrix is not the inertia of a rigid body.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum InertiaError {
    /// An entry is NaN or infinite.
    #[error("entry ({row}, {column}) is {value}, expected a finite number")]
    NotFinite {
        /// Row, from 1.
        row: usize,
        /// Column, from 1.
        column: usize,
        /// The entry.
        value: f64,
    },
    /// The matrix differs from its transpose.
    #[error(
        "not symmetric: entry ({row}, {column}) is {upper} but entry ({column}, {row}) is {lower}"
    )]
    NotSymmetric {
        /// Row of the upper entry, from 1.
        row: usize,
        /// Column of the upper entry, from 1.
        column: usize,
        /// The entry above the diagonal.
        upper: f64,
        /// The entry below the diagonal.
        lower: f64,
    },
    /// A principal moment is zero, negative, or at rounding level compared with the others.
    #[error(
        "not positive: the principal moments are {0:?}, expected all above 1e-14 of the greatest"
    )]
    NotPositive([f64; 3]),
    /// One principal moment exceeds the sum of the others, which is impossible for a mass distribution.
    #[error(
        "violates the triangle inequality: the principal moments are {0:?}, expected none above the sum of the others"
    )]
    TriangleInequality([f64; 3]),
}

impl Inertia {
    /// Creates the inertia after checking that `matrix` (3×3, body axes) is that of a rigid body: finite, symmetric,
    /// positive definite, with no principal moment above the sum of the other two. Equality is allowed (a flat body).
    pub fn new(matrix: Matrix3<f64>) -> Result<Self, InertiaError> {
        for row in 0..3 {
            for column in 0..3 {
                let value = matrix[(row, column)];
                if !value.is_finite() {
                    return Err(InertiaError::NotFinite {
                        row: row + 1,
                        column: column + 1,
                        value,
                    });
                }
            }
        }
        let rounding = 1e-14 * matrix.amax();
        for (row, column) in [(0, 1), (0, 2), (1, 2)] {
            let (upper, lower) = (matrix[(row, column)], matrix[(column, row)]);
            if (upper - lower).abs() > rounding {
                return Err(InertiaError::NotSymmetric {
                    row: row + 1,
                    column: column + 1,
                    upper,
                    lower,
                });
            }
        }
        let matrix = 0.5 * (matrix + matrix.transpose());
        let principal = PrincipalAxes::of(&matrix);
        let mut moments: [f64; 3] = principal.moments.into();
        moments.sort_by(f64::total_cmp);
        let [least, middle, greatest] = moments;
        // NaN moments are rejected too.
        if least.is_nan() || least <= rounding {
            return Err(InertiaError::NotPositive(moments));
        }
        if greatest > (least + middle) * (1.0 + 1e-12) {
            return Err(InertiaError::TriangleInequality(moments));
        }
        let trace = matrix.trace();
        let unit = matrix / trace;
        let adjugate = adjugate(&unit);
        let determinant = unit.column(0).dot(&adjugate.row(0).transpose());
        Ok(Self {
            inverse: adjugate / (determinant * trace),
            nonstandard: Matrix3::from_diagonal_element(0.5 * trace) - matrix,
            rotation: DiscreteRotation::new(trace, &principal),
            principal,
            matrix,
        })
    }

    /// Creates the inertia of a body whose axes are principal axes with these moments.
    pub fn principal(moments: [f64; 3]) -> Result<Self, InertiaError> {
        Self::new(Matrix3::from_diagonal(&Vector3::from(moments)))
    }

    /// The inertia of the body stretched along its axes at the same mass, `J_d → S J_d S` with `S = diag(stretch)`. It
    /// is valid for any factors, because `J_d = ∫ρρᵀ dm` remains positive semidefinite.
    ///
    /// # Errors
    /// Returns an error if the factors cause overflow or underflow, or make the body so thin that its inertia is at
    /// rounding level.
    pub fn stretched(&self, stretch: &Vector3<f64>) -> Result<Self, InertiaError> {
        let s = Matrix3::from_diagonal(stretch);
        let mut j_d = s * self.nonstandard * s;
        for k in 0..3 {
            // Rounding can make this entry of a flat body negative.
            j_d[(k, k)] = j_d[(k, k)].max(0.0);
        }
        Self::new(Matrix3::from_diagonal_element(j_d.trace()) - j_d)
    }

    /// The principal moments, in no particular order.
    pub fn principal_moments(&self) -> [f64; 3] {
        self.principal.moments.into()
    }

    /// The standard inertia `J`.
    pub fn matrix(&self) -> &Matrix3<f64> {
        &self.matrix
    }

    /// `J⁻¹`.
    pub fn inverse(&self) -> &Matrix3<f64> {
        &self.inverse
    }

    /// The nonstandard inertia `J_d = ½ tr[J] I − J` (3.6).
    pub fn nonstandard(&self) -> &Matrix3<f64> {
        &self.nonstandard
    }
}

/// `adj(m)`, the matrix with `adj(m) m = det(m) I`.
fn adjugate(m: &Matrix3<f64>) -> Matrix3<f64> {
    Matrix3::from_rows(&[
        m.column(1).cross(&m.column(2)).transpose(),
        m.column(2).cross(&m.column(0)).transpose(),
        m.column(0).cross(&m.column(1)).transpose(),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derived_matrices_satisfy_their_definitions() {
        let matrix = Matrix3::new(2.0, 0.1, -0.2, 0.1, 3.0, 0.3, -0.2, 0.3, 2.5);
        let inertia = Inertia::new(matrix).unwrap();
        assert!((inertia.inverse * matrix - Matrix3::identity()).norm() < 1e-15);
        let j_d = inertia.nonstandard();
        assert!((Matrix3::from_diagonal_element(j_d.trace()) - j_d - matrix).norm() < 1e-15);
    }

    /// A stretched flat plate, rod or rotated body remains a rigid body. A stretch by 1 changes the inertia only by
    /// rounding.
    #[test]
    fn a_stretched_body_is_a_body() {
        let turned = lgvi_lie::exp(&Vector3::new(0.3, 0.5, -0.2));
        let mut rng = fastrand::Rng::with_seed(3);
        for moments in [[1.0, 2.0, 3.0], [1e-3, 0.7, 0.7], [1.0, 1.0, 1.0]] {
            let j = turned * Matrix3::from_diagonal(&Vector3::from(moments)) * turned.transpose();
            for inertia in [
                Inertia::principal(moments).unwrap(),
                Inertia::new(j).unwrap(),
            ] {
                let same = inertia.stretched(&Vector3::repeat(1.0)).unwrap();
                assert!((same.matrix() - inertia.matrix()).norm() < 1e-15);
                for _ in 0..200 {
                    let stretch = Vector3::from_fn(|_, _| 0.2 + 3.0 * rng.f64());
                    let other = inertia.stretched(&stretch).unwrap();
                    let expected = stretch[0] * stretch[1] * inertia.nonstandard()[(0, 1)];
                    assert!((other.nonstandard()[(0, 1)] - expected).abs() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn unphysical_matrices_are_refused_with_their_values() {
        let diagonal = |a, b, c| Inertia::principal([a, b, c]);
        assert_eq!(
            diagonal(1.0, 1.0, 3.0),
            Err(InertiaError::TriangleInequality([1.0, 1.0, 3.0]))
        );
        assert_eq!(
            diagonal(-1.0, 1.0, 1.0),
            Err(InertiaError::NotPositive([-1.0, 1.0, 1.0]))
        );
        assert_eq!(
            diagonal(0.0, 1.0, 1.0),
            Err(InertiaError::NotPositive([0.0, 1.0, 1.0]))
        );
        assert!(matches!(
            diagonal(1.0, f64::NAN, 1.0),
            Err(InertiaError::NotFinite {
                row: 2,
                column: 2,
                ..
            })
        ));
        let mut skewed = Matrix3::identity();
        skewed[(0, 2)] = 0.1;
        assert_eq!(
            Inertia::new(skewed),
            Err(InertiaError::NotSymmetric {
                row: 1,
                column: 3,
                upper: 0.1,
                lower: 0.0
            })
        );
        assert!(diagonal(1.0, 2.0, 3.0).is_ok(), "a flat body is a body");
    }
}
