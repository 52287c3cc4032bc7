//! The Cayley chart (2.5): `cay(f) = (I + S(f))(I − S(f))⁻¹`, where `f = tan(θ/2) n` for the rotation by θ about the
//! unit vector n. It covers all rotations of less than 180°.

use nalgebra::{Matrix3, Vector3};

use crate::{Quaternion, hat};

/// `2/(1 + |f|²)`, the factor that all Cayley formulas share.
#[inline(always)]
fn factor(f: &Vector3<f64>) -> f64 {
    2.0 / (1.0 + f.norm_squared())
}

/// The rotation matrix `cay(f) = I + s (S(f) + S(f)²)`, `s = 2/(1 + |f|²)`.
pub fn cay(f: &Vector3<f64>) -> Matrix3<f64> {
    let s = hat(f);
    Matrix3::identity() + factor(f) * (s + s * s)
}

/// `cay(f) p`. Keeps `|p|` up to unbiased rounding.
pub fn rotate(f: &Vector3<f64>, p: &Vector3<f64>) -> Vector3<f64> {
    let fp = f.cross(p);
    p + factor(f) * (fp + f.cross(&fp))
}

/// `cay(f)ᵀ p`. Keeps `|p|` up to unbiased rounding.
#[inline(always)]
pub fn rotate_back(f: &Vector3<f64>, p: &Vector3<f64>) -> Vector3<f64> {
    Quaternion::from_cayley(f).rotate_back(p)
}

/// `R cay(f)`, orthogonal to rounding after any number of compositions ([`Quaternion::compose`]).
#[inline(always)]
pub fn compose(r: &Matrix3<f64>, f: &Vector3<f64>) -> Matrix3<f64> {
    Quaternion::from_cayley(f).compose(r)
}

/// The rotation vector `θ n` of `cay(f)`.
pub fn to_rotation_vector(f: &Vector3<f64>) -> Vector3<f64> {
    let norm = f.norm();
    if norm < 1e-8 {
        2.0 * f
    } else {
        f * (2.0 * libm::atan(norm) / norm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{exp, orthogonality_error, to_cayley};

    fn random(rng: &mut fastrand::Rng, scale: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| scale * (2.0 * rng.f64() - 1.0))
    }

    #[test]
    fn cay_is_its_defining_quotient() {
        let mut rng = fastrand::Rng::with_seed(1);
        for _ in 0..100 {
            let f = random(&mut rng, 3.0);
            let inverse = (Matrix3::identity() - hat(&f)).try_inverse().unwrap();
            assert!((cay(&f) - (Matrix3::identity() + hat(&f)) * inverse).norm() < 1e-14);
        }
    }

    #[test]
    fn cay_and_exp_agree_through_the_change_of_chart() {
        let mut rng = fastrand::Rng::with_seed(2);
        for scale in [1e-12, 1e-6, 1e-3, 1.0, 1.8] {
            for _ in 0..100 {
                let v = random(&mut rng, scale);
                let f = to_cayley(&v);
                assert!((cay(&f) - exp(&v)).norm() < 4e-15);
                assert!((to_rotation_vector(&f) - v).norm() <= 4e-16 * v.norm() + 1e-300);
            }
        }
    }

    #[test]
    fn rotating_vectors_is_multiplying_by_the_matrix() {
        let mut rng = fastrand::Rng::with_seed(3);
        for _ in 0..100 {
            let (f, p) = (random(&mut rng, 2.0), random(&mut rng, 5.0));
            assert!((rotate(&f, &p) - cay(&f) * p).norm() < 1e-14);
            assert!((rotate_back(&f, &p) - cay(&f).transpose() * p).norm() < 1e-14);
        }
    }

    #[test]
    fn composition_multiplies_and_stays_orthogonal() {
        let mut rng = fastrand::Rng::with_seed(4);
        let mut r = Matrix3::identity();
        for _ in 0..1_000_000 {
            let f = random(&mut rng, 0.1);
            let product = r * cay(&f);
            r = compose(&r, &f);
            assert!((r - product).norm() < 4e-15);
        }
        assert!(orthogonality_error(&r) < 2e-15);
    }
}
