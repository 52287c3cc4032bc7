//! The exponential chart (2.2): `exp(v)` is the rotation by `|v|` about `v`.

use nalgebra::{Matrix3, Vector3};

use crate::Tangent;

/// `exp(S(v))` by Rodrigues' formula (2.2).
pub fn exp(v: &Vector3<f64>) -> Matrix3<f64> {
    Tangent::at(*v).rotation()
}

/// The rotation vector of `R`, of length at most π.
///
/// It is computed from the unit quaternion of `R`, whose largest component is taken from the diagonal. So it is
/// accurate at every angle, including 0 and π.
pub fn log(r: &Matrix3<f64>) -> Vector3<f64> {
    let (w, u) = to_quaternion(r);
    let norm = u.norm();
    if norm < 1e-8 * w.abs() {
        return u * (2.0 / w);
    }
    let angle = 2.0 * libm::atan2(norm, w.abs());
    u * (angle.copysign(w) / norm)
}

/// Scalar and vector part of a quaternion of `R`. Its length is 1 to the accuracy with which `R` is a rotation.
///
/// The largest component is positive.
pub fn to_quaternion(r: &Matrix3<f64>) -> (f64, Vector3<f64>) {
    let trace = r.trace();
    let skew = 2.0 * crate::vee(r);
    let largest = r.diagonal().imax();
    if trace >= r[(largest, largest)] {
        let w = 0.5 * (1.0 + trace).sqrt();
        return (w, skew / (4.0 * w));
    }
    let (i, j, k) = (largest, (largest + 1) % 3, (largest + 2) % 3);
    let component = 0.5 * (1.0 + r[(i, i)] - r[(j, j)] - r[(k, k)]).sqrt();
    let mut u = Vector3::zeros();
    u[i] = component;
    u[j] = (r[(i, j)] + r[(j, i)]) / (4.0 * component);
    u[k] = (r[(i, k)] + r[(k, i)]) / (4.0 * component);
    (skew[i] / (4.0 * component), u)
}

/// The Cayley vector `tan(θ/2) n` of `exp(v)`, for `|v| < π`.
pub fn to_cayley(v: &Vector3<f64>) -> Vector3<f64> {
    let angle = v.norm();
    if angle < 1e-8 {
        0.5 * v
    } else {
        v * (libm::tan(0.5 * angle) / angle)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::{hat, orthogonality_error};

    fn unit(rng: &mut fastrand::Rng) -> Vector3<f64> {
        Vector3::from_fn(|_, _| 2.0 * rng.f64() - 1.0).normalize()
    }

    const ANGLES: [f64; 11] = [
        0.0,
        1e-300,
        1e-12,
        1e-7,
        3.1e-3,
        3.2e-3,
        0.5,
        2.0,
        3.1,
        PI - 1e-9,
        PI,
    ];

    #[test]
    fn exp_is_a_rotation_and_log_undoes_it_at_every_angle() {
        let mut rng = fastrand::Rng::with_seed(5);
        for angle in ANGLES {
            for _ in 0..50 {
                let v = angle * unit(&mut rng);
                let r = exp(&v);
                assert!(orthogonality_error(&r) < 4e-15);
                assert!((r.determinant() - 1.0).abs() < 4e-15);
                let back = log(&r);
                let error = (back - v).norm();
                let flipped = (back + v).norm();
                let at_half_turn = angle >= PI - 1e-8;
                assert!(
                    error < 2e-15 || (at_half_turn && flipped < 4e-9),
                    "angle {angle}: {back} for {v}"
                );
            }
        }
    }

    #[test]
    fn exp_matches_the_matrix_exponential_series() {
        let v = Vector3::new(0.7, -0.4, 0.9);
        let s = hat(&v);
        let (mut sum, mut term) = (Matrix3::identity(), Matrix3::identity());
        for n in 1..40 {
            term = term * s / f64::from(n);
            sum += term;
        }
        assert!((exp(&v) - sum).norm() < 1e-15);
    }
}
