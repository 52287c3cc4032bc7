use nalgebra::{Matrix3, Vector3};

/// Limit of sweeps, far beyond what Jacobi's method needs to converge.
const MAX_SWEEPS: u32 = 30;

/// Principal moments of inertia and their axes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PrincipalAxes {
    /// The moments, in no particular order.
    pub(crate) moments: Vector3<f64>,
    /// A right-handed triad of axes as columns, or `None` if they are the body axes.
    pub(crate) axes: Option<Matrix3<f64>>,
}

impl PrincipalAxes {
    /// Computes the principal moments and axes of a symmetric matrix.
    pub(crate) fn of(matrix: &Matrix3<f64>) -> Self {
        let moments = matrix.diagonal();
        if *matrix == Matrix3::from_diagonal(&moments) {
            return Self {
                moments,
                axes: None,
            };
        }
        let greatest = matrix.amax();
        let (moments, axes) = diagonalize(&(matrix / greatest));
        Self {
            moments: greatest * moments,
            axes: Some(lgvi_lie::polish(&axes)),
        }
    }
}

/// The principal moments of a symmetric positive definite `matrix` and, as columns, the principal axes (right-handed).
/// Uses Jacobi rotations, which preserve the relative accuracy of small moments. For a diagonal matrix, the axes are
/// exactly the coordinate axes.
fn diagonalize(matrix: &Matrix3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    let mut a = *matrix;
    let mut axes = Matrix3::identity();
    for _ in 0..MAX_SWEEPS {
        let mut turned = false;
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            let off = a[(i, j)];
            if off.abs() <= f64::EPSILON * 0.5 * (a[(i, i)] * a[(j, j)]).sqrt() {
                continue;
            }
            turned = true;
            let ratio = 0.5 * (a[(j, j)] - a[(i, i)]) / off;
            let tangent = (ratio.abs() + (1.0 + ratio * ratio).sqrt())
                .recip()
                .copysign(ratio);
            let cosine = (1.0 + tangent * tangent).sqrt().recip();
            let sine = tangent * cosine;
            let mut rotation = Matrix3::identity();
            rotation[(i, i)] = cosine;
            rotation[(j, j)] = cosine;
            rotation[(i, j)] = sine;
            rotation[(j, i)] = -sine;
            let (lower, upper) = (a[(i, i)] - tangent * off, a[(j, j)] + tangent * off);
            a = rotation.transpose() * a * rotation;
            (a[(i, i)], a[(j, j)]) = (lower, upper);
            (a[(i, j)], a[(j, i)]) = (0.0, 0.0);
            axes *= rotation;
        }
        if !turned {
            break;
        }
    }
    (a.diagonal(), axes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axes_are_right_handed_and_diagonalize() {
        let mut rng = fastrand::Rng::with_seed(5);
        for smallest in [1.0, 0.3, 1e-3, 1e-9] {
            for _ in 0..50 {
                let turn = Vector3::from_fn(|_, _| 6.0 * rng.f64() - 3.0);
                let r = lgvi_lie::exp(&turn);
                let moments = Vector3::new(smallest, 1.0, 1.0 + 0.5 * smallest);
                let matrix = r * Matrix3::from_diagonal(&moments) * r.transpose();
                let matrix = 0.5 * (matrix + matrix.transpose());
                let (found, axes) = diagonalize(&matrix);
                let rebuilt = axes * Matrix3::from_diagonal(&found) * axes.transpose();
                assert!((rebuilt - matrix).norm() < 3e-15);
                assert!((axes.transpose() * axes - Matrix3::identity()).norm() < 3e-15);
                assert!((axes.determinant() - 1.0).abs() < 3e-15);
                let mut sorted: [f64; 3] = found.into();
                sorted.sort_by(f64::total_cmp);
                assert!((Vector3::from(sorted) - moments).norm() < 3e-15);
            }
        }
        let diagonal = Matrix3::from_diagonal(&Vector3::new(2.0, 1.0, 2.0));
        assert_eq!(
            diagonalize(&diagonal),
            (diagonal.diagonal(), Matrix3::identity())
        );
    }
}
