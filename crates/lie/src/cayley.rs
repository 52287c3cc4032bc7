//! The Cayley chart (2.5): `cay(f) = (I + S(f))(I − S(f))⁻¹`, `f = tan(θ/2) n` for the rotation by θ about the unit
//! vector n. It covers all rotations of less than 180°.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::hat;

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

/// `cay(f) p`, which keeps `|p|` to rounding without bias.
pub fn rotate(f: &Vector3<f64>, p: &Vector3<f64>) -> Vector3<f64> {
    let fp = f.cross(p);
    p + factor(f) * (fp + f.cross(&fp))
}

/// `cay(f)ᵀ p`, which keeps `|p|` to rounding without bias.
#[inline(always)]
pub fn rotate_back(f: &Vector3<f64>, p: &Vector3<f64>) -> Vector3<f64> {
    rotate_back_by(factor(f), f, p)
}

#[inline(always)]
fn rotate_back_by(factor: f64, f: &Vector3<f64>, p: &Vector3<f64>) -> Vector3<f64> {
    let pf = p.cross(f);
    p + factor * (pf + pf.cross(f))
}

/// `R cay(f)`, orthogonal to rounding whatever the number of compositions.
///
/// Two rows of R are turned, by adding what they change by, and relieved of their rounding error to first order; the
/// third is their cross product. So errors of orthogonality do not accumulate.
#[inline(always)]
pub fn compose(r: &Matrix3<f64>, f: &Vector3<f64>) -> Matrix3<f64> {
    // cay(f) − I = k (S(f) + S(f)²)
    let kf = factor(f) * f;
    let (xx, yy, zz) = (kf.x * f.x, kf.y * f.y, kf.z * f.z);
    let (xy, yz, zx) = (kf.x * f.y, kf.y * f.z, kf.z * f.x);
    // Columns of both rows at once.
    let column = |j: usize| Vector2::new(r[(0, j)], r[(1, j)]);
    let (a, b, c) = (column(0), column(1), column(2));
    let x = a + (a * -(yy + zz) + b * (xy + kf.z) + c * (zx - kf.y));
    let y = b + (a * (xy - kf.z) + b * -(zz + xx) + c * (yz + kf.x));
    let z = c + (a * (zx + kf.y) + b * (yz - kf.x) + c * -(xx + yy));
    let lengths = x.component_mul(&x) + y.component_mul(&y) + z.component_mul(&z);
    let skew = 0.5 * (x.x * x.y + y.x * y.y + z.x * z.y);
    let scale = Vector2::new(1.5 - 0.5 * lengths.x, 1.5 - 0.5 * lengths.y);
    let relieved = |v: Vector2<f64>| v.component_mul(&scale) - skew * v.yx();
    let (x, y, z) = (relieved(x), relieved(y), relieved(z));
    let third = [
        y.x * z.y - z.x * y.y,
        z.x * x.y - x.x * z.y,
        x.x * y.y - y.x * x.y,
    ];
    Matrix3::new(x.x, y.x, z.x, x.y, y.y, z.y, third[0], third[1], third[2])
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
