use nalgebra::{Const, Matrix3, SymmetricEigen};

/// Iteration limit. A finite matrix converges within about a dozen iterations.
const MOST: usize = 1000;

/// Eigenvalues and eigenvectors of a symmetric matrix, in no particular order, or `None` if an entry is not finite.
pub fn symmetric_eigen(m: &Matrix3<f64>) -> Option<SymmetricEigen<f64, Const<3>>> {
    if !m.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    SymmetricEigen::try_new(*m, f64::EPSILON, MOST)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without an iteration limit, the eigenvalue iteration would not terminate on these matrices.
    #[test]
    fn a_matrix_that_is_not_finite_has_no_eigenvalues() {
        for wrong in [f64::NAN, f64::INFINITY] {
            let mut m = Matrix3::new(2.0, 0.1, 0.2, 0.1, 3.0, 0.3, 0.2, 0.3, 4.0);
            assert!((symmetric_eigen(&m).unwrap().eigenvalues.sum() - 9.0).abs() < 1e-14);
            m[(0, 1)] = wrong;
            m[(1, 0)] = wrong;
            assert!(symmetric_eigen(&m).is_none());
        }
    }
}
